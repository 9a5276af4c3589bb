"""The two loops of the paper, from the newest rows of a history."""

from __future__ import annotations

import re

import numpy as np

from haploop.view.draw.table import Table, column
from haploop.view.store.history import History
from haploop.view.store.lod_series import Track

# The loops show this much time, in so many rows at most.
_LOOP_S, _MOST_ROWS = 0.4, 8000
_MASS = re.compile(r"mass\.(\d+)\.(.*)")


def loops(history: History, first: int, end: int) -> list[Table]:
    """Those of the two loops that there is something for in the last of some ticks."""
    return [*force_position(history, first, end), *momentum(history, first, end)]


def _last(history: History, track: Track, first: int, end: int) -> tuple[int, int]:
    """The last of some ticks that a track holds in full; (0, 0) for none."""
    end = min(end, track.end_tick)
    first = max(first, track.full_from_tick, end - round(_LOOP_S * history.time.control_rate))
    return (first, end) if first < end else (0, 0)


def force_position(history: History, first: int, end: int) -> list[Table]:
    """Penetration (m, positive inside) and force out of the wall (N) at every plant step (Choi et al. 2022, Fig. 3).

    The force is the one applied, total of wall and elements, held while the position moves on. Where it runs
    counter-clockwise, the area within is energy given to the device. ``stiffness`` (N/m) is that of the ideal spring.
    """
    first, end = _last(history, history.steps, first, end)
    if first == end or not history.into_wall:
        return []
    n, time = history.time.steps_per_tick, history.time
    x, force = history.steps.rows(("x", "force"), first, end)
    position, stiffness = history.ticks.rows(("wall_position", "wall_stiffness"), first, end)
    depth = ((x.reshape(-1, n) - position[:, None]) * history.into_wall).ravel()
    each = n if len(x) > _MOST_ROWS else 1
    values = np.stack([depth, -force * history.into_wall])[:, ::each]
    columns = [column("penetration", "m", "penetration"), column("force", "N", "force out of the wall")]
    known = stiffness[np.isfinite(stiffness)]
    more = {"stiffness": float(known[-1]) if len(known) else None}
    return [Table("loop", first / time.control_rate, each / time.plant_rate, columns, values, more=more)]


def momentum(history: History, first: int, end: int) -> list[Table]:
    """Velocity v[k-1] and momentum m[k-1] v[k] of every virtual inertia at ticks (Choi et al. 2022, eq. 8 and Fig. 4).

    m[k] is the mass while the inertia is at work and 0 while it is not. The rectangles of width v[k-1] - v[k-2] and
    height m v[k] are the energy it takes in a step, so clockwise is dissipation.
    """
    track, rate = history.ticks, history.time.control_rate
    first, end = _last(history, track, first, end)
    found = [(match, name) for name in track.names if (match := _MASS.fullmatch(name))]
    if not found or end - first < 2:
        return []
    v, *masses = track.rows(("v", *(name for _, name in found)), first, end)
    columns, values = [column("v", "m/s", "velocity")], [v[:-1]]
    for (match, _), mass in zip(found, masses, strict=True):
        if np.isfinite(mass).any():
            columns.append(column(f"p.{match[1]}", "kg m/s", f"element {match[1]}: {match[2]}"))
            values.append(mass[:-1] * v[1:])
    return [Table("momentum", (first + 1) / rate, 1.0 / rate, columns, np.stack(values))] if len(values) > 1 else []
