"""Snapshots of a history: the tables that a page draws, at a resolution that fits its width."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from haploop.protocol.walls.registry import make_wall, wall_names
from haploop.view.draw.messages import Column, Table, encode
from haploop.view.look.budget import budget
from haploop.view.look.compare import Changes, Half
from haploop.view.look.spectrum import amplitudes, main_line
from haploop.view.store.history import TRUE, WALL_BOOK, History
from haploop.view.store.lod_series import LodSeries

# Rows per point of the page at most; beyond, the rows are summed up in so many buckets per point.
_ROWS_A_POINT, _BUCKETS_A_POINT = 3.5, 0.75
# Phase plots show so many periods of a swing, which is looked for in so much time, or all of that time; rows at most.
_PERIODS, _PHASE_S, _MOST_ROWS = 2.0, 0.4, 8000
PANELS = ("loops", "energy", "spectrum", "compare", "motion")
# Simulated time of the samples that are heard at once.
_SOUND_S = 0.25
# Ticks of which a spectrum is made at most, the newest; parts of an overview of the run.
_SPECTRUM_TICKS, _OVERVIEW_PARTS = 2048, 256
# Points of the curve of a wall that is no spring.
_CURVE = 60
_BODIES = {"x": "position", "tip_x": "position of the tip", "hand_x": "position of the hand"}
_MEASURED = {"wall_position": Column("wall", "m", "wall"), "x_measured": Column("x_measured", "m", "measured position")}
_MAKING = re.compile(r"-\d+$")


@dataclass(frozen=True)
class Viewport:
    """The interval that a page shows, and its width.

    Attributes:
        span_s: length of the interval in simulated time, s; None for the whole run.
        points: about how many points fit side by side.
        end_s: end of the interval, s; None for the newest tick.
        panel: what is shown beside the charts over time, of ``PANELS``.
        sound: whether the newest samples of the force are wanted, to be heard.
    """

    span_s: float | None = 2.0
    points: int = 1000
    end_s: float | None = None
    panel: str = PANELS[0]
    sound: bool = False


# Columns of one series by name, each with its header entry.
Part = tuple[LodSeries, Mapping[str, Column]]
# Whether a column is worth showing, from its values in the interval.
IsShown = Callable[[Column, np.ndarray], bool]


def snapshot(
    history: History, viewport: Viewport, changes: Changes | None = None, overlay: History | None = None
) -> bytes:
    """Returns everything a page shows as bytes, packed by :func:`haploop.view.draw.messages.encode`.

    Tables over time are position, force and energy; each row by row where the page has room for it, else as an envelope
    whose rows are the two extremes of consecutive buckets in the order in which they came. Then comes an overview of
    the whole run, and what the page's panel asks for: the two phase plots of Choi et al. 2022, row by row, of two
    periods where a swing has a line, else of the last 0.4 s; the energy budget; spectra; the two sides of the last of
    ``changes``. Position and total force of ``overlay``, another run, come beside. A table without data is left out.
    """
    rate = history.time.control_rate
    from_tick, to_tick = _window(history, viewport)
    known_from = to_tick if history.first_tick is None else history.first_tick
    first, end = max(from_tick, known_from), min(to_tick, history.end_tick)
    tables: list[Table | None] = []
    more: dict[str, Any] = {}
    if first < end:
        interval = _Interval(first, end, rate, viewport.points)
        tables = [interval.table(*made(history)) for made in (_position, _force, _energy)]
        tables.append(_overview(history, known_from))
        tables += _laid_over(overlay, from_tick / rate, to_tick / rate, viewport.points) if overlay else []
        if viewport.sound:
            tables.append(_sound(history))
        if viewport.panel == "loops":
            newest = _newest_periods(history, first, end)
            tables += _force_position(history, newest, end), _momentum(history, newest, end)
        elif viewport.panel == "energy":
            more["budget"] = budget(history, first, end)
        elif viewport.panel == "spectrum":
            table, more["lines"] = _spectrum(history, first, end)
            tables.append(table)
        elif viewport.panel == "compare" and changes and (pair := changes.pair(history)):
            tables += [_trace(name, half, rate) for name, half in zip(("before", "after"), pair[1:], strict=True)]
            more["change"] = {"tick": pair[0], "t_s": pair[0] / rate}
    return encode(from_tick / rate, to_tick / rate, [table for table in tables if table], **more)


def _window(history: History, viewport: Viewport) -> tuple[int, int]:
    """Returns (first, end); at the start of a run the interval reaches beyond the newest tick."""
    rate = history.time.control_rate
    end = max(1, history.end_tick if viewport.end_s is None else math.ceil(viewport.end_s * rate))
    if viewport.span_s is None:
        return min(end - 1, history.first_tick or 0), end
    ticks = max(1, round(viewport.span_s * rate))
    first = max(0, end - ticks)
    return first, first + ticks


class _Interval:
    """Makes tables over time for some ticks, fit for a number of points."""

    def __init__(self, first: int, end: int, rate: int, points: int) -> None:
        self._first, self._end, self._rate, self._points = first, end, rate, points

    def table(self, name: str, parts: list[Part], is_shown: IsShown) -> Table | None:
        """Returns a table of columns of some series, the first of which has the most rows a tick; None for none."""
        all_series, most = [series for series, _ in parts], parts[0][0].rows_per_tick
        in_full = all(series.full_from_tick <= self._first for series in all_series)
        if in_full and (self._end - self._first) * most <= _ROWS_A_POINT * self._points:
            first, step = float(self._first), 1.0 / most
            values = [
                series.rows(list(columns), self._first, self._end).repeat(most // series.rows_per_tick, axis=1)
                for series, columns in parts
            ]
        else:
            in_full, bucket = False, self._bucket(all_series)
            begins = all_series[0].aligned(self._first, bucket)
            ends = self._end + (begins - self._end) % bucket
            values = [series.envelope(list(columns), begins, ends, bucket) for series, columns in parts]
            first, step = begins + bucket / 4.0, bucket / 2.0
        rows, columns = np.concatenate(values), [known for _, columns in parts for known in columns.values()]
        shown = [i for i, known in enumerate(columns) if is_shown(known, rows[i])]
        if not shown:
            return None
        columns = [columns[i] for i in shown]
        return Table(name, first / self._rate, step / self._rate, columns, rows[shown], envelope=not in_full)

    def _bucket(self, all_series: list[LodSeries]) -> int:
        """Returns the ticks of a bucket: the least power of two that leaves no more buckets than there is room for."""
        room = _BUCKETS_A_POINT * self._points
        bucket = 1 << max(0, math.ceil(math.log2((self._end - self._first) / room)))
        for series in all_series * 2:  # what is coarse enough for one may begin too early for another
            bucket = series.bucket_from(self._first, bucket)
        return bucket


def _position(history: History) -> tuple[str, list[Part], IsShown]:
    moving = {name: Column(name, "m", label) for name, label in _BODIES.items() if name in history.steps.names}
    return "position", [(history.steps, moving), (history.ticks, _MEASURED)], lambda *_: True


def _force(history: History) -> tuple[str, list[Part], IsShown]:
    """Lists wall, elements by place and total, each shown where it has values in the interval."""
    columns = {"wall": Column("wall", "N", "wall")} if history.at_work.wall else {}
    for name, place, kind in sorted(_by_place(history, "element"), key=lambda element: int(element[1])):
        columns[name] = Column(name, "N", f"element {place}: {kind}")
    columns["total"] = Column("total", "N", "total")
    return "force", [(history.ticks, columns)], lambda _, values: bool(np.isfinite(values).any())


def _by_place(history: History, what: str) -> Iterator[tuple[str, str, str]]:
    """Yields name, place and kind of the columns ``<what>.<place>.<kind>``."""
    for name in history.ticks.names:
        if name.startswith(f"{what}."):
            _, place, kind = name.split(".", 2)
            yield name, place, kind


def _energy(history: History) -> tuple[str, list[Part], IsShown]:
    """Lists the books of the wall, of the elements at work, and of those whose energy changes in the interval."""
    columns = {WALL_BOOK: Column("wall", "J", "wall")} if history.at_work.wall else {}
    books = [name.removesuffix(TRUE) for name in history.energy.names if name.endswith(TRUE) and name != WALL_BOOK]
    columns |= {f"{name}{TRUE}": Column(name, "J", name) for name in books}
    columns["residual"] = Column("residual", "J", "residual")
    always = {"wall", "residual", *_books_at_work(history, books)}

    def is_shown(known: Column, values: np.ndarray) -> bool:
        finite = values[np.isfinite(values)]
        return bool(len(finite)) and (known.name in always or bool(finite.min() < finite.max()))

    return "energy", [(history.energy, columns)], is_shown


def _books_at_work(history: History, books: list[str]) -> list[str]:
    """Returns the newest books of each kind, as many as elements of the kind are at work; the others are closed."""
    found: list[str] = []
    for element in history.at_work.elements:
        found += [name for name in books if name not in found and _MAKING.sub("", name) == element.name][-1:]
    return found


def _last(history: History, series: LodSeries, first: int, end: int) -> tuple[int, int]:
    """Returns the ticks of a phase plot, the last that a series holds in full, (first, end); (0, 0) for none."""
    end = min(end, series.end_tick)
    first = max(first, series.full_from_tick, end - round(_PHASE_S * history.time.control_rate))
    return (first, end) if first < end else (0, 0)


def _newest_periods(history: History, first: int, end: int) -> int:
    """Returns the tick from which on two periods of the main swing of the last 0.4 s lie, ``first`` without one."""
    found, end = _last(history, history.steps, first, end)
    rate, n = history.time.control_rate, history.time.steps_per_tick
    line = main_line(history.steps.rows(("x",), found, end)[0][::n], rate) if found < end else None
    return max(first, end - math.ceil(_PERIODS * rate / line.frequency_Hz)) if line else first


def _force_position(history: History, first: int, end: int) -> Table | None:
    """Returns penetration (m, positive inside) and force out of the wall (N) at every plant step (Fig. 3).

    The force is the one applied, total of wall and elements, held while the position moves on. Where it runs
    counter-clockwise, the area within is energy given to the device. ``stiffness`` (N/m) is that of the ideal spring;
    of a wall that is none, ``curve`` has depths (m) and the forces (N) that it stores there.
    """
    first, end = _last(history, history.steps, first, end)
    inward = history.at_work.into_wall
    if first == end or not inward:
        return None
    n, time = history.time.steps_per_tick, history.time
    x, force = history.steps.rows(("x", "force"), first, end)
    position, stiffness = history.ticks.rows(("wall_position", "wall_stiffness"), first, end)
    depth = ((x.reshape(-1, n) - position[:, None]) * inward).ravel()
    each = n if len(x) > _MOST_ROWS else 1
    values = np.stack([depth, -force * inward])[:, ::each]
    columns = [Column("penetration", "m", "penetration"), Column("force", "N", "force out of the wall")]
    known = stiffness[np.isfinite(stiffness)]
    more: dict[str, Any] = {"stiffness": float(known[-1]) if len(known) else None}
    if (wall := history.at_work.wall) and wall.kind in wall_names()[1:]:
        curve = np.linspace(0.0, max(float(depth.max()), 0.0), _CURVE)
        more["curve"] = [curve.tolist(), make_wall(wall).held(curve).tolist()]
    return Table("loop", first / time.control_rate, each / time.plant_rate, columns, values, more=more)


def _momentum(history: History, first: int, end: int) -> Table | None:
    """Returns velocity v[k-1] and momentum m[k-1] v[k] of every virtual inertia at ticks (eq. 8 and Fig. 4).

    m[k] is the mass while the inertia is at work and 0 while it is not. The rectangles of width v[k-1] - v[k-2] and
    height m v[k] are the energy it takes in a step, so clockwise is dissipation.
    """
    series, rate = history.ticks, history.time.control_rate
    first, end = _last(history, series, first, end)
    inertias = [*_by_place(history, "mass")]
    if not inertias or end - first < 2:
        return None
    v, *masses = series.rows(("v", *(name for name, _, _ in inertias)), first, end)
    columns, values = [Column("v", "m/s", "velocity")], [v[:-1]]
    for (_, place, kind), mass in zip(inertias, masses, strict=True):
        if np.isfinite(mass).any():
            columns.append(Column(f"p.{place}", "kg m/s", f"element {place}: {kind}"))
            values.append(mass[:-1] * v[1:])
    return Table("momentum", (first + 1) / rate, 1.0 / rate, columns, np.stack(values)) if len(values) > 1 else None


def _overview(history: History, first: int) -> Table | None:
    """Returns the position over the whole run, the two extremes of each of its parts."""
    end = history.end_tick
    bucket = 1 << max(0, math.ceil(math.log2(max(1, end - first) / _OVERVIEW_PARTS)))
    bucket = history.steps.bucket_from(first, bucket)
    begins, ends = history.steps.aligned(first, bucket), end + (history.steps.aligned(first, bucket) - end) % bucket
    values = history.steps.envelope(["x"], begins, ends, bucket)
    rate = history.time.control_rate
    columns = [Column("x", "m", "position")]
    return Table("overview", (begins + bucket / 4.0) / rate, bucket / 2.0 / rate, columns, values, envelope=True)


def _sound(history: History) -> Table | None:
    """Returns the newest samples of the applied force, at plant steps."""
    end = history.steps.end_tick
    first = max(history.steps.full_from_tick, end - round(_SOUND_S * history.time.control_rate))
    if first >= end:
        return None
    force = history.steps.rows(["force"], first, end)
    time = history.time
    return Table("sound", first / time.control_rate, 1.0 / time.plant_rate, [Column("force", "N", "force")], force)


def _laid_over(history: History, from_s: float, to_s: float, points: int) -> list[Table | None]:
    """Returns position and total force of another run in the same interval of its own simulated time."""
    rate = history.time.control_rate
    first, end = max(history.first_tick or 0, math.floor(from_s * rate)), min(history.end_tick, math.ceil(to_s * rate))
    if first >= end:
        return []
    interval = _Interval(first, end, rate, points)
    x, total = {"x": Column("x", "m", "position")}, {"total": Column("total", "N", "total")}
    parts: list[tuple[str, Part]] = [("position", (history.steps, x)), ("force", (history.ticks, total))]
    return [interval.table(f"overlay_{name}", [part], lambda *_: True) for name, part in parts]


def _spectrum(history: History, first: int, end: int) -> tuple[Table | None, dict[str, Any]]:
    """Returns amplitudes of position and applied force over frequency, ``t`` in Hz, and the line that stands out."""
    rate = history.time.control_rate
    end = min(end, history.steps.end_tick, history.stop_tick or end)
    first = max(first, end - _SPECTRUM_TICKS, history.steps.full_from_tick)
    if end - first < 32:
        return None, {}
    samples = history.steps.rows(("x", "force"), first, end)[:, :: history.time.steps_per_tick]
    if not np.isfinite(samples).all():
        return None, {}
    at, height = amplitudes(samples, rate)
    columns = [Column("x", "m", "position"), Column("force", "N", "force")]
    lines = {name: main_line(row, rate) for name, row in zip(("x", "force"), samples, strict=True)}
    found = {name: line and line._asdict() for name, line in lines.items()}
    seen = {"from_s": first / rate, "to_s": end / rate}
    return Table("spectrum", float(at[0]), float(at[1] - at[0]), columns, height), {**found, **seen}


def _trace(name: str, half: Half | None, rate: int) -> Table | None:
    """Returns position and force on one side of a change, with what was seen and its energy budget."""
    if half is None:
        return None
    columns = [Column("x", "m", "position"), Column("force", "N", "force")]
    more = {"sight": asdict(half.sight), "budget": half.budget}
    from_s = half.sight.to_s - half.traces.shape[1] / rate
    return Table(name, from_s, 1.0 / rate, columns, half.traces, more=more)
