"""Series at several levels of detail: the newest rows in full, those of the whole run ever coarser."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from haploop.view.store.lod_level import LodLevel, Ring, extremes

# Buckets of a level that make one of the next: fewer levels cost less, and twice the buckets make up for it.
FOLD = 4
# Rows of a bucket of the first coarse level, at least.
_LEAST_ROWS = 4
# Buckets that a coarse level holds at least, two values each.
_BUCKETS = 4096
# Ticks for which buckets are made at once, and buckets of the coarser levels; fewer are not worth the calls.
_AT_ONCE_TICKS, _AT_ONCE_BUCKETS = 128, 8
# Columns that are kept, at most: elements come and go.
MOST_COLUMNS = 48


class LodSeries:
    """Keeps rows of named columns, a whole number of them a tick, from tick ``origin`` on.

    Level 0 holds the newest rows, of ``recent_ticks`` at least. Every other level holds the least and the greatest of
    buckets of some ticks, ``FOLD`` times as many as on the level before it; before a level would forget its oldest
    buckets there is a next one, so that some level always reaches back to the origin. So memory grows with the
    logarithm of the run's length alone.

    Attributes:
        first_tick: first tick that is known; None before anything is.
        end_tick: the tick before which every tick is known, or never will be.
        full_from_tick: the tick from which on rows are held in full.
    """

    def __init__(self, rows_per_tick: int, recent_ticks: int, origin: int) -> None:
        self.rows_per_tick, self.origin = rows_per_tick, origin
        self.first_tick: int | None = None
        self._columns: dict[str, int] = {}
        self._levels = [LodLevel(Ring(recent_ticks * rows_per_tick, 0), 1, rows_per_tick)]
        self._add_level()
        # No level is given more at once than half of what it surely holds, so that nothing is lost on the way up.
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

    def _add_level(self) -> None:
        first = max(1, _LEAST_ROWS // self.rows_per_tick)
        ticks = self._levels[-1].ticks * FOLD if len(self._levels) > 1 else first
        self._levels.append(LodLevel(Ring(2 * _BUCKETS, len(self._columns)), ticks, 2))

    def begin(self, tick: int) -> None:
        """Notes that rows begin at ``tick``; the first call counts."""
        if self.first_tick is None:
            self.first_tick = max(tick, self.origin)

    def append(self, tick: int, columns: Mapping[str, np.ndarray]) -> None:
        """Appends the rows of some ticks from ``tick`` on, name -> array of shape (ticks * rows_per_tick,).

        Ticks that are known already are passed over; ticks missing in between, and columns without rows here, are NaN.
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
        """Adds a column; where there are too many, in place of the oldest that is not present any more."""
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
                return  # far from forgetting anything, and short enough to be looked at as it is
            self._add_level()
        above = self._levels[depth + 1]
        buckets = (below.end - above.end) // above.ticks
        if buckets >= (_AT_ONCE_TICKS // above.ticks if depth == 0 else _AT_ONCE_BUCKETS):
            group = above.ticks // below.ticks * below.values
            above.ring.append(extremes(below.between(above.end, above.end + buckets * above.ticks), group))
            self._propagate(depth + 1)

    def extend_from(self, other: LodSeries) -> None:
        """Appends what another series holds in full and this one has not reached."""
        first, end = max(self.end_tick, other.full_from_tick), other.end_tick
        if first < end:
            rows = other.rows(other.names, first, end)
            self.append(first, dict(zip(other.names, rows, strict=True)))

    def rows(self, names: Sequence[str], from_tick: int, to_tick: int) -> np.ndarray:
        """Returns the rows in full between two ticks, shape (names, rows); NaN where there are none."""
        level, n = self._levels[0], self.rows_per_tick
        found = np.full((len(names), (to_tick - from_tick) * n), np.nan)
        first, end = max(from_tick, self.full_from_tick), min(to_tick, self.end_tick)
        if first < end:
            values = level.between(first - self.origin, end - self.origin)
            self._pick(values, names, found[:, (first - from_tick) * n : (end - from_tick) * n])
        return found

    def _pick(self, values: np.ndarray, names: Sequence[str], into: np.ndarray, group: int = 0) -> None:
        """Copies columns by name, reduced to the extremes of every ``group`` values unless it is 0."""
        known = [(row, self._columns[name]) for row, name in enumerate(names) if name in self._columns]
        if group and known:
            values = extremes(values[[place for _, place in known]], group)
            known = [(row, place) for place, (row, _) in enumerate(known)]
        for row, place in known:
            into[row] = values[place]

    def bucket_from(self, from_tick: int, bucket_ticks: int) -> int:
        """Returns the ticks of a bucket for :meth:`envelope`: ``bucket_ticks``, or more where the past is coarser."""
        fine = (level for level in self._levels if level.ticks <= bucket_ticks)
        if any(level.start <= self.aligned(from_tick, bucket_ticks) - self.origin for level in fine):
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
        at, end, filled = from_tick - self.origin, min(to_tick, self.end_tick) - self.origin, 0
        # From the coarsest level that is fine enough on; what has not been propagated to it comes from the finer ones.
        levels = [level for level in reversed(self._levels) if level.ticks <= bucket_ticks]
        for level in levels:
            buckets = max(0, min(level.end, end) - at) // bucket_ticks
            if buckets:
                values = level.between(at, at + buckets * bucket_ticks)
                group = bucket_ticks // level.ticks * level.values
                done = level is not self._levels[0] and group == 2
                self._pick(values, names, found[:, filled : filled + 2 * buckets], 0 if done else group)
                at, filled = at + buckets * bucket_ticks, filled + 2 * buckets
        rest = []
        for level in levels:
            until = min(level.end, end // level.ticks * level.ticks)
            rest += [level.between(at, until)] if until > at else []
            at = max(at, until)
        if rest:
            values = np.concatenate(rest, axis=1)
            self._pick(values, names, found[:, filled : filled + 2], values.shape[1])
        return found
