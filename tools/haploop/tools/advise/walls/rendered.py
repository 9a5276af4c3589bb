"""Rendering of a wall that is safe: stiffness at the hand, ripple, and the force that an element adds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from haploop.protocol.scene.scene import Clock, Wall
from haploop.tools.advise.walls.cases import LASTS_S, slowness
from haploop.tools.advise.walls.felt import ripple
from haploop.tools.advise.walls.limit import Query, limits
from haploop.tools.advise.walls.loops import Seen, make_loops
from haploop.tools.advise.walls.store import Failure
from haploop.tools.advise.walls.trial import FROM_S, STRETCH_S, Trial
from haploop.tools.linear.linearity import installed_kinds

# If less than this share of a wall is rendered, its element hides it: softer walls are measured, too.
_HIDDEN, _HALVINGS = 0.5, 16


class Rendered(NamedTuple):
    """What a wall renders, over all cases of a query; 0 throughout where no wall is safe.

    Attributes:
        held_N_m: mean force over mean measured penetration, from 0.75 s on; the force is the one in effect, a delay
            later.
        contact_N_m: slope of the same force over the true penetration, by least squares, on the first way in.
        ripple_N: largest peak to peak of the command above 30 Hz in a quarter of a second, mean of the cases.
        extra_N, extra_rms_N: largest and root mean square force of the elements.
    """

    held_N_m: float = 0.0
    contact_N_m: float = 0.0
    ripple_N: float = 0.0
    extra_N: float = 0.0
    extra_rms_N: float = 0.0


class Trying(NamedTuple):
    """The wall that renders most, among those that bear everything.

    Attributes:
        limit_N_m: the stiffest that bears everything; 0 if none does.
        wall_N_m: the one that was measured; the same unless the element hides it.
    """

    limit_N_m: float
    wall_N_m: float
    rendered: Rendered
    fails_N_m: float
    failure: Failure | None


def rendered(queries: Sequence[Query], stiffnesses_N_m: Sequence[float]) -> list[Rendered]:
    """Measures each query's wall of that stiffness in its cases, all side by side."""
    members = [(index, case) for index, query in enumerate(queries) if stiffnesses_N_m[index] for case in query.cases]
    scenes = [
        replace(
            case.scene(queries[index].loop),
            wall=Wall(position=0.0, stiffness=stiffnesses_N_m[index]),
            dissipation=queries[index].elements,
        )
        for index, case in members
    ]
    rows: list[list[Rendered]] = [[] for _ in queries]
    for group, loops in make_loops(scenes, installed_kinds()):
        scene = scenes[group[0]]
        seen = loops.go_on(round(slowness(queries[members[group[0]][0]].loop) * LASTS_S * scene.clock.control_rate))
        stiffness = np.array([stiffnesses_N_m[members[place][0]] for place in group])
        for place, row in zip(group, _measure(seen, stiffness, scene.clock), strict=True):
            rows[members[place][0]].append(row)
    return [Rendered(*np.mean(row, axis=0).tolist()) if row else Rendered() for row in rows]


def tried(trial: Trial, queries: Sequence[Query], tolerance: float) -> list[Trying]:
    """Finds the limit of each query, and measures what is rendered there; for a hidden wall, softer ones, too."""
    found = limits(trial, queries, tolerance)
    best = [(limit.stiffness_N_m, each) for limit, each in zip(
        found, rendered(queries, [limit.stiffness_N_m for limit in found]), strict=True)]  # fmt: skip
    hidden = [place for place, (wall_N_m, each) in enumerate(best) if each.held_N_m < _HIDDEN * wall_N_m]
    softer = [(place, best[place][0] * 0.5**times) for place in hidden for times in range(1, _HALVINGS + 1)]
    shown = rendered([queries[place] for place, _ in softer], [wall_N_m for _, wall_N_m in softer])
    for (place, wall_N_m), each in zip(softer, shown, strict=True):
        if each.held_N_m > best[place][1].held_N_m:
            best[place] = wall_N_m, each
    return [
        Trying(limit.stiffness_N_m, *each, limit.fails_N_m, limit.failure)
        for limit, each in zip(found, best, strict=True)
    ]


def _measure(seen: Seen, stiffness_N_m: np.ndarray, clock: Clock) -> list[Rendered]:
    rate = float(clock.control_rate)
    # What is commanded acts a round trip later, to the nearest tick.
    acts = np.roll(seen.command, late_ticks := round(clock.round_trip_delay * rate), axis=0)
    acts[:late_ticks] = 0.0
    depth, force = np.maximum(-seen.x, 0.0), np.where(seen.x < 0.0, acts, 0.0)
    read, late = np.maximum(-seen.measured, 0.0), slice(round(FROM_S * rate), None)
    held = _share(force[late].sum(axis=0), read[late].sum(axis=0))
    # The first way in: from contact until the device first moves out, or does not move.
    inside = np.maximum.accumulate(depth > 0.0, axis=0)
    out = np.diff(depth, axis=0, prepend=0.0) <= 0.0
    way_in = inside & ~np.logical_or.accumulate(inside & out, axis=0)
    contact = _share((way_in * force * depth).sum(axis=0), (way_in * depth * depth).sum(axis=0))
    stretch, swing = round(STRETCH_S * rate), np.zeros(seen.x.shape[1])
    for at in range(late.start, len(seen.x) - stretch + 1, stretch):
        swing = np.maximum(swing, ripple(seen.command[at : at + stretch], rate)[0])
    extra = seen.command - stiffness_N_m * read
    peak, rms = np.abs(extra).max(axis=0), np.sqrt((extra**2).mean(axis=0))
    return [Rendered(*row) for row in np.stack([held, contact, swing, peak, rms], axis=1).tolist()]


def _share(force: np.ndarray, depth: np.ndarray) -> np.ndarray:
    return np.divide(force, depth, out=np.zeros_like(force), where=depth > 0.0)
