"""Series at several levels of detail: the newest rows in full, those of the whole run more and more coarsely."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from haploop.view.store.lod_level import LodLevel, Ring, extremes

# Buckets of a level that make one of the next: fewer levels cost less, and twice the buckets make up for it.
FOLD = 4
# Ticks of a bucket of the first coarse level: at least so many, and as many as give the ticks in full so many buckets.
_LEAST_TICKS, _LEAST_BUCKETS = 4, 800
# Least number of buckets that a coarse level holds, two values each.
_BUCKETS = 4096
# Ticks for which buckets are made at once, and buckets of the coarser levels; fewer are not worth the calls.
_AT_ONCE_TICKS, _AT_ONCE_BUCKETS = 128, 256
# Up to this many values are read row by row: the calls for level after level would take longer.
_FEW_VALUES = 8192
# Envelopes that are kept, so that the next ones of the same names and buckets compute only what is new.
_MOST_KNOWN = 16
# Ticks of ranges that are taken from another series at once.
_RANGES_AT_ONCE = 4096
# Columns that are kept, at most: elements come and go.
MOST_COLUMNS = 48


class LodSeries:
    """Keeps rows of named columns, a whole number of rows per tick, from tick ``origin`` on.

    Level 0 holds the newest rows, of ``recent_ticks`` at least. Every other level holds the least and the greatest of
    buckets of some ticks, ``FOLD`` times as many as on the level before it. Before a level would forget its oldest
    buckets, a next one is added, so that some level always reaches back to the origin. So memory grows only with the
    logarithm of the run's length.

    Attributes:
        first_tick: first tick that is known; None before anything is.
        end_tick: the tick before which every tick is known, or never will be.
        full_from_tick: the tick from which on rows are held in full.
    """

    def __init__(self, rows_per_tick: int, recent_ticks: int, origin: int) -> None:
        self.rows_per_tick, self.origin = rows_per_tick, origin
        self.first_tick: int | None = None
        self._columns: dict[str, int] = {}
        self._found: dict[tuple[str, ...], tuple[list[int], np.ndarray]] = {}
        # By names and ticks of a bucket: the first tick of the last envelope, and its buckets that are complete.
        self._known: dict[tuple[tuple[str, ...], int], tuple[int, np.ndarray]] = {}
        self._levels = [LodLevel(Ring(recent_ticks * rows_per_tick, 0), 1, rows_per_tick)]
        self._add_level(1 << max(_LEAST_TICKS, recent_ticks // _LEAST_BUCKETS).bit_length() - 1)
        # No level is given more at once than half of what it certainly holds, so that nothing is lost on the way up.
        self._at_once = min(recent_ticks, _BUCKETS * self._levels[1].ticks) * rows_per_tick // 2

    @property
    def names(self) -> list[str]:
        return list(self._columns)

    @property
    def nbytes(self) -> int:
        return sum(level.ring.nbytes for level in self._levels)

    @property
    def end_tick(self) -> int:
        return self.origin + self._levels[0].end

    @property
    def full_from_tick(self) -> int:
        return self.origin + self._levels[0].start

    def _add_level(self, ticks: int) -> None:
        self._levels.append(LodLevel(Ring(2 * _BUCKETS, len(self._columns)), ticks, 2))

    def begin(self, tick: int) -> None:
        """Records that rows begin at ``tick``; the first call counts."""
        if self.first_tick is None:
            self.first_tick = max(tick, self.origin)

    def append(self, tick: int, columns: Mapping[str, np.ndarray]) -> None:
        """Appends the rows of some ticks from ``tick`` on, name -> array of shape (ticks * rows_per_tick,).

        Ticks that are known already are skipped; ticks missing in between, and columns without rows here, are NaN.
        """
        rows = len(next(iter(columns.values())))
        known = (self.end_tick - tick) * self.rows_per_tick
        if known >= rows:
            return
        self.begin(tick)
        if known < 0:
            self._take(-known, {})
        for name in columns:
            if name not in self._columns:
                self._open(name, columns.keys())
        known = max(0, known)
        self._take(rows - known, {name: column[known:] for name, column in columns.items()})

    def _open(self, name: str, present: Collection[str]) -> None:
        """Adds a column; if there are too many, it replaces the oldest one that is no longer present."""
        self._found.clear()
        self._known.clear()
        if len(self._columns) < MOST_COLUMNS:
            self._columns[name] = len(self._columns)
            for level in self._levels:
                level.ring.grow(len(self._columns))
        elif oldest := next((old for old in self._columns if old not in present), None):
            self._columns[name] = place = self._columns.pop(oldest)
            for level in self._levels:
                level.ring.clear(place)

    def _take(self, rows: int, columns: Mapping[str, np.ndarray]) -> None:
        for start in range(0, rows, self._at_once):
            end = min(rows, start + self._at_once)
            room = self._levels[0].ring.extend(end - start)
            for name, place in self._columns.items():
                room[place] = columns[name][start:end] if name in columns else np.nan
            self._propagate(0)

    def _propagate(self, depth: int) -> None:
        """Appends what is new on this level to the next coarser one, if there is enough of it."""
        below = self._levels[depth]
        if depth + 1 == len(self._levels):
            if below.ring.end < below.ring.capacity // 4:
                return  # far from forgetting anything, and short enough to be read as it is
            self._add_level(below.ticks * FOLD)
        above = self._levels[depth + 1]
        buckets = (below.end - above.end) // above.ticks
        if buckets >= (_AT_ONCE_TICKS // above.ticks if depth == 0 else _AT_ONCE_BUCKETS):
            group = above.ticks // below.ticks * below.values
            above.ring.append(extremes(below.between(above.end, above.end + buckets * above.ticks), group))
            self._propagate(depth + 1)

    def extend_from(self, other: LodSeries) -> None:
        """Appends what another series holds and this one has not reached.

        Where the other series holds only ranges, rows alternate between the least and the greatest of an interval, and
        everything before the end of the ranges counts as ranges here, too.
        """
        n, begun = (
            self.rows_per_tick,
            self.end_tick if other.first_tick is None else max(self.end_tick, other.first_tick),
        )
        full = max(begun, other.full_from_tick)
        if begun < full:
            bucket = other.bucket_from(begun, 1)
            full = min(full + (other.origin - full) % bucket, other.end_tick)
            for tick in range(begun, full, _RANGES_AT_ONCE):
                end, first = min(tick + _RANGES_AT_ONCE, full), other.aligned(tick, bucket)
                pairs = other.envelope(other.names, first, end + (first - end) % bucket, bucket)
                at = np.arange((tick - first) * n, (end - first) * n)
                rows = pairs[:, 2 * (at // (bucket * n)) + at % 2]
                self.append(tick, dict(zip(other.names, rows, strict=True)))
        if full < other.end_tick:
            rows = other.rows(other.names, full, other.end_tick)
            self.append(full, dict(zip(other.names, rows, strict=True)))
        if begun < full:
            self._levels[0].ring.forget((full - self.origin) * n)

    def rows(self, names: Sequence[str], from_tick: int, to_tick: int) -> np.ndarray:
        """Returns the rows in full between two ticks, shape (names, rows); NaN where there are none."""
        level, n = self._levels[0], self.rows_per_tick
        begin, now = self.full_from_tick, self.end_tick
        if begin <= from_tick <= to_tick <= now:
            return self._picked(level.between(from_tick - self.origin, to_tick - self.origin), names)
        found = np.full((len(names), (to_tick - from_tick) * n), np.nan)
        first, end = max(from_tick, begin), min(to_tick, now)
        if first < end:
            values = level.between(first - self.origin, end - self.origin)
            found[:, (first - from_tick) * n : (end - from_tick) * n] = self._picked(values, names)
        return found

    def _picked(self, values: np.ndarray, names: Sequence[str], group: int = 0) -> np.ndarray:
        """Returns columns by name, NaN where unknown; as extremes of every ``group`` values unless it is 0."""
        rows, places = self._places(names)
        picked = extremes(values[places], group) if group else values[places]
        if len(picked) == len(names):
            return picked
        found = np.full((len(names), picked.shape[1]), np.nan)
        found[rows] = picked
        return found

    def _places(self, names: Sequence[str]) -> tuple[list[int], np.ndarray]:
        """Returns where the known ones are among these names, and the places of their columns; kept, for speed."""
        if (key := tuple(names)) not in self._found:
            rows = [row for row, name in enumerate(names) if name in self._columns]
            self._found[key] = rows, np.array([self._columns[names[row]] for row in rows], dtype=np.intp)
        return self._found[key]

    def bucket_from(self, from_tick: int, bucket_ticks: int) -> int:
        """Returns the ticks of a bucket for :meth:`envelope`: ``bucket_ticks``, or more where the past is coarser."""
        begin = self.aligned(from_tick, bucket_ticks) - self.origin
        for level in reversed(self._levels):
            if level.ticks <= bucket_ticks and level.start <= begin:
                return bucket_ticks
        return self.bucket_from(from_tick, 2 * bucket_ticks)

    def aligned(self, tick: int, bucket_ticks: int) -> int:
        """Returns the first tick of the bucket that holds a tick."""
        return tick - (tick - self.origin) % bucket_ticks

    def envelope(self, names: Sequence[str], from_tick: int, to_tick: int, bucket_ticks: int) -> np.ndarray:
        """Returns the :func:`extremes` of consecutive buckets, NaN where there are none.

        Args:
            from_tick, to_tick: begin of the first bucket and end of the last one, ``aligned``.
            bucket_ticks: a power of two, from :meth:`bucket_from`.

        Returns:
            Shape (names, 2 * buckets).
        """
        found = np.full((len(names), (to_tick - from_tick) // bucket_ticks * 2), np.nan)
        begin, known = self._known.pop(key := (tuple(names), bucket_ticks), (from_tick, found[:, :0]))
        passed = (from_tick - begin) // bucket_ticks * 2
        known = known[:, passed : passed + found.shape[1]] if passed >= 0 else known[:, :0]
        found[:, : known.shape[1]] = known
        end = min(to_tick, self.end_tick)
        self._fill(found, known.shape[1], names, from_tick, end, bucket_ticks)
        if len(self._known) == _MOST_KNOWN:
            del self._known[next(iter(self._known))]
        self._known[key] = from_tick, found[:, : max(0, (end - from_tick) // bucket_ticks * 2)]
        return found

    def _fill(
        self, found: np.ndarray, filled: int, names: Sequence[str], from_tick: int, to_tick: int, bucket_ticks: int
    ) -> None:
        """Fills in an envelope from column ``filled`` on, up to the last bucket that has begun."""
        at, end = from_tick + filled // 2 * bucket_ticks - self.origin, to_tick - self.origin
        # Begins at the coarsest level that is fine enough; what has not been propagated to it comes from finer ones.
        levels = [(level, level.end) for level in reversed(self._levels) if level.ticks <= bucket_ticks]
        rows, few = self._levels[0], _FEW_VALUES // (self.rows_per_tick * max(1, len(names)))
        for level, known in levels:
            if level is not rows and end - at <= few and rows.start <= at:
                continue
            buckets = (min(known, end) - at) // bucket_ticks
            if buckets > 0:
                values = level.between(at, at + buckets * bucket_ticks)
                group = bucket_ticks // level.ticks * level.values
                done = level is not rows and group == 2
                found[:, filled : filled + 2 * buckets] = self._picked(values, names, 0 if done else group)
                at, filled = at + buckets * bucket_ticks, filled + 2 * buckets
        rest = []
        for level, known in levels[-1:] if end - at <= few and rows.start <= at else levels:
            until = min(known, end // level.ticks * level.ticks)
            if until > at:
                rest.append(level.between(at, until))
                at = until
        if rest:
            values = np.concatenate(rest, axis=1) if len(rest) > 1 else rest[0]
            found[:, filled : filled + 2] = self._picked(values, names, values.shape[1])
