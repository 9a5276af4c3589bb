"""Panels beside the charts over time: what each of them is sent, by its name."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Any, NamedTuple

import numpy as np

from haploop.logger.verdict.spectrum import amplitudes, main_line
from haploop.protocol.walls.registry import make_wall
from haploop.protocol.walls.wall import Spring
from haploop.view.draw.messages import Column, Table
from haploop.view.draw.over_time import Interval, are_there, by_place, own_columns
from haploop.view.look.budget import budget
from haploop.view.look.compare import Changes, Half
from haploop.view.store.history import History
from haploop.view.store.lod_series import LodSeries

# Phase plots show this many periods of a swing, which is looked for in this time, or all of that time; most rows.
_PERIODS, _PHASE_S, _MOST_ROWS = 2.0, 0.4, 8000
# They show at most this many turns of the position.
_MOST_TURNS = 24
# Most ticks, the newest, of which a spectrum is made; simulated time of the samples that are heard at once.
_SPECTRUM_TICKS, _SOUND_S = 2048, 0.25
# Points of the curve of a wall that is not a spring.
_CURVE = 60
_BOTH = [Column("x", "m", "position"), Column("force", "N", "force")]


class Look(NamedTuple):
    """What is looked at: the ticks from ``first`` to before ``end`` of a history, and the changes of its run."""

    history: History
    first: int
    end: int
    interval: Interval
    changes: Changes | None


# The tables of a panel, None for one without data, and what it adds to the header of the snapshot.
Sent = tuple[list[Table | None], dict[str, Any]]


def _loops(look: Look) -> Sent:
    """Returns the two phase plots of Choi et al. 2022, of two periods if a swing has a spectral line, else of 0.4 s."""
    newest = _newest_periods(look.history, look.first, look.end)
    return [made(look.history, newest, look.end) for made in (_force_position, _momentum)], {}


def _energy(look: Look) -> Sent:
    return [], {"budget": budget(look.history, look.first, look.end)}


def _compare(look: Look) -> Sent:
    """Returns the two sides of the last change."""
    pair, rate = look.changes and look.changes.pair(look.history), look.history.time.control_rate
    if not pair:
        return [], {}
    sides = [_trace(name, half, rate) for name, half in zip(("before", "after"), pair[1:], strict=True)]
    return sides, {"change": {"tick": pair[0], "t_s": pair[0] / rate}}


def _own(look: Look) -> Sent:
    """Returns what elements show besides their forces, a table for each unit."""
    parts = own_columns(look.history)
    return [look.interval.table(f"own.{place}", [part], are_there) for place, part in enumerate(parts)], {}


def _last(history: History, series: LodSeries, first: int, end: int) -> tuple[int, int]:
    """Returns the ticks (first, end) of a phase plot, the last that a series holds in full; (0, 0) without any."""
    end = min(end, series.end_tick, end if history.stop_tick is None else history.stop_tick)
    first = max(first, series.full_from_tick, end - round(_PHASE_S * history.time.control_rate))
    return (first, end) if first < end else (0, 0)


def _newest_periods(history: History, first: int, end: int) -> int:
    """Returns the tick at which the last two periods of the main swing of the last 0.4 s begin; ``first`` without one.

    There are ``_MOST_TURNS`` turns at most: a buzz on top of a slow motion would make a tangle of lines.
    """
    found, end = _last(history, history.steps, first, end)
    if found == end:
        return first
    rate, n = history.time.control_rate, history.time.steps_per_tick
    x = history.steps.rows(("x",), found, end)[0][::n]
    line = main_line(x, rate)
    first = max(first, end - math.ceil(_PERIODS * rate / line.frequency_Hz)) if line else first
    turns = found + np.flatnonzero(np.diff(np.sign(np.nan_to_num(np.diff(x)))))
    return max(first, int(turns[-_MOST_TURNS])) if len(turns) >= _MOST_TURNS else first


def _force_position(history: History, first: int, end: int) -> Table | None:
    """Returns penetration (m, positive inside) and force out of the wall (N) at every plant step (Fig. 3).

    The force is the one applied, total of wall and elements, held while the position moves on. Where the plot runs
    counter-clockwise, the enclosed area is energy given to the device. ``stiffness`` (N/m) is that of the ideal spring;
    for a wall that is not a spring, ``curve`` has depths (m) and the forces (N) that it stores there. There is neither
    if the law of the wall is not known.
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
    try:
        if not isinstance(wall := make_wall(history.at_work.wall), Spring):
            curve = np.linspace(0.0, max(float(depth.max()), 0.0), _CURVE)
            more["curve"] = [curve.tolist(), wall.held(curve).tolist()]
    except KeyError:  # a wall from a file, or from a package that is not installed: not a spring, and not known here
        more["stiffness"] = None
    return Table("loop", first / time.control_rate, each / time.plant_rate, columns, values, more=more)


def _momentum(history: History, first: int, end: int) -> Table | None:
    """Returns velocity v[k-1] and momentum m[k-1] v[k] of every virtual inertia at ticks (eq. 8 and Fig. 4).

    m[k] is the mass while the inertia is at work and 0 while it is not. The rectangles of width v[k-1] - v[k-2] and
    height m v[k] are the energy it takes in a step, so clockwise is dissipation.
    """
    series, rate = history.ticks, history.time.control_rate
    first, end = _last(history, series, first, end)
    inertias = [*by_place(history, "mass")]
    if not inertias or end - first < 2:
        return None
    v, *masses = series.rows(("v", *(name for name, _, _ in inertias)), first, end)
    columns, values = [Column("v", "m/s", "velocity")], [v[:-1]]
    for (_, place, kind), mass in zip(inertias, masses, strict=True):
        if np.isfinite(mass).any():
            columns.append(Column(f"p.{place}", "kg m/s", f"element {place}: {kind}"))
            values.append(mass[:-1] * v[1:])
    return Table("momentum", (first + 1) / rate, 1.0 / rate, columns, np.stack(values)) if len(values) > 1 else None


def sound(history: History) -> Table | None:
    """Returns the newest samples of the applied force, at plant steps."""
    end = history.steps.end_tick
    first = max(history.steps.full_from_tick, end - round(_SOUND_S * history.time.control_rate))
    if first >= end:
        return None
    force, time = history.steps.rows(["force"], first, end), history.time
    return Table("sound", first / time.control_rate, 1.0 / time.plant_rate, _BOTH[1:], force)


def _spectrum(look: Look) -> Sent:
    """Returns amplitudes of position and applied force over frequency, ``t`` in Hz, and the line that stands out."""
    history, rate = look.history, look.history.time.control_rate
    end = min(look.end, history.steps.end_tick, history.stop_tick or look.end)
    first = max(look.first, end - _SPECTRUM_TICKS, history.steps.full_from_tick)
    if end - first < 32:
        return [], {}
    samples = history.steps.rows(("x", "force"), first, end)[:, :: history.time.steps_per_tick]
    if not np.isfinite(samples).all():
        return [], {}
    at, height = amplitudes(samples, rate)
    lines = {name: main_line(row, rate) for name, row in zip(("x", "force"), samples, strict=True)}
    found = {name: line and line._asdict() for name, line in lines.items()}
    seen = {"from_s": first / rate, "to_s": end / rate}
    return [Table("spectrum", float(at[0]), float(at[1] - at[0]), _BOTH, height)], {"lines": {**found, **seen}}


def _trace(name: str, half: Half | None, rate: int) -> Table | None:
    """Returns position and force on one side of a change, with what was seen and its energy budget."""
    if half is None:
        return None
    more = {"sight": asdict(half.sight), "budget": half.budget}
    from_s = half.sight.to_s - half.traces.shape[1] / rate
    return Table(name, from_s, 1.0 / rate, _BOTH, half.traces, more=more)


# By name, in the order of their tabs; the page draws motion from the tables over time.
PANELS: Mapping[str, Callable[[Look], Sent]] = {
    "loops": _loops,
    "energy": _energy,
    "spectrum": _spectrum,
    "compare": _compare,
    "motion": lambda _: ([], {}),
    "own": _own,
}
