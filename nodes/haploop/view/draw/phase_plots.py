"""The two phase plots of Choi et al. 2022: force over penetration, and momentum over velocity."""

from __future__ import annotations

import re

import numpy as np

from haploop.view.draw.frame import Table, column
from haploop.view.store.history import History
from haploop.view.store.lod_series import LodSeries

# Simulated time that the plots show, and their number of rows at most.
_SHOWN_S, _MOST_ROWS = 0.4, 8000
_MASS = re.compile(r"mass\.(\d+)\.(.*)")


def phase_plots(history: History, first: int, end: int) -> list[Table]:
    """Returns the tables of the two plots from the last 0.4 s of some ticks, without those that have no data."""
    return [*force_position(history, first, end), *momentum(history, first, end)]


def _last(history: History, series: LodSeries, first: int, end: int) -> tuple[int, int]:
    """Returns the last of some ticks that a series holds in full, (first, end); (0, 0) for none."""
    end = min(end, series.end_tick)
    first = max(first, series.full_from_tick, end - round(_SHOWN_S * history.time.control_rate))
    return (first, end) if first < end else (0, 0)


def force_position(history: History, first: int, end: int) -> list[Table]:
    """Returns penetration (m, positive inside) and force out of the wall (N) at every plant step (Fig. 3).

    The force is the one applied, total of wall and elements, held while the position moves on. Where it runs
    counter-clockwise, the area within is energy given to the device. ``stiffness`` (N/m) is that of the ideal spring.
    """
    first, end = _last(history, history.steps, first, end)
    if first == end or not history.inward:
        return []
    n, time = history.time.steps_per_tick, history.time
    x, force = history.steps.rows(("x", "force"), first, end)
    position, stiffness = history.ticks.rows(("wall_position", "wall_stiffness"), first, end)
    depth = ((x.reshape(-1, n) - position[:, None]) * history.inward).ravel()
    each = n if len(x) > _MOST_ROWS else 1
    values = np.stack([depth, -force * history.inward])[:, ::each]
    columns = [column("penetration", "m", "penetration"), column("force", "N", "force out of the wall")]
    known = stiffness[np.isfinite(stiffness)]
    more = {"stiffness": float(known[-1]) if len(known) else None}
    return [Table("loop", first / time.control_rate, each / time.plant_rate, columns, values, more=more)]


def momentum(history: History, first: int, end: int) -> list[Table]:
    """Returns velocity v[k-1] and momentum m[k-1] v[k] of every virtual inertia at ticks (eq. 8 and Fig. 4).

    m[k] is the mass while the inertia is at work and 0 while it is not. The rectangles of width v[k-1] - v[k-2] and
    height m v[k] are the energy it takes in a step, so clockwise is dissipation.
    """
    series, rate = history.ticks, history.time.control_rate
    first, end = _last(history, series, first, end)
    found = [(match, name) for name in series.names if (match := _MASS.fullmatch(name))]
    if not found or end - first < 2:
        return []
    v, *masses = series.rows(("v", *(name for _, name in found)), first, end)
    columns, values = [column("v", "m/s", "velocity")], [v[:-1]]
    for (match, _), mass in zip(found, masses, strict=True):
        if np.isfinite(mass).any():
            columns.append(column(f"p.{match[1]}", "kg m/s", f"element {match[1]}: {match[2]}"))
            values.append(mass[:-1] * v[1:])
    return [Table("momentum", (first + 1) / rate, 1.0 / rate, columns, np.stack(values))] if len(values) > 1 else []
