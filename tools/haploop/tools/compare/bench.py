"""One stabilizer on one loop: tuned on conditions of its own, then tried under other seeds."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from haploop.protocol.scene.paths import value_at
from haploop.protocol.scene.scene import Scene
from haploop.tools.advise.changes import scaled
from haploop.tools.advise.families import STABILIZERS, Family, Values, box, halton
from haploop.tools.advise.walls.corners import ranges
from haploop.tools.advise.walls.limit import LEAST_N_M, MOST_N_M, Query, ladder, limits
from haploop.tools.advise.walls.rendered import Trying, tried
from haploop.tools.advise.walls.store import Store
from haploop.tools.advise.walls.trial import Trial
from haploop.tools.compare.conditions import draw

# How closely limits are found while parameters are compared, and afterwards.
_ROUGH, _CLOSE = 0.25, 0.08
# Rungs as multiples of the wall without any element, the same for all, so that those that bear the same get the same.
_RUNGS = ladder(1.7**-2, 1.7**2, 1.7)
# The share of the length of a box's logarithmic axes that is searched through the best point.
_ALONG = 0.6
# The very first parameters, almost no element, are this share of the smallest of the box.
_NONE = 1.0 / 16.0
# Every round of the tuning has seeds of its own, starting at this, at twice and at three times this number.
_TUNING = 1000
# What is changed by 20 %, all together, to show how sensitive the wall is to the device.
_DEVICE = ("device.mass", "device.damping", "friction.kinetic", "transmission.stiffness")
OFF = (0.8, 1.2)

Ends = tuple[float, float]
# A block of seeds, and parameters for it.
Choice = tuple[int, Values]


class Shown(NamedTuple):
    """The result of parameters under each seed: held stiffness, N/m, and the element's own force, r.m.s., N."""

    held_N_m: np.ndarray
    force_N: np.ndarray


# From choices, a round of the tuning and a number of seeds to what the choices show.
Shows = Callable[[Sequence[Choice], int, int], dict[Choice, Shown]]


@dataclass(frozen=True)
class Effort:
    """The effort spent on every stabilizer alike; each seed draws ``of_seed`` conditions.

    Attributes:
        points: how many parameters are tried over the whole box, besides the smallest of all, under ``first`` seeds.
        finalists: how many of them are tried further, with ``around`` more along the axes through the best, under
            ``tuning`` seeds.
        last: seeds under which the best of these, again ``finalists``, and the start of the search are tried, to find
            out which of them a few seeds break.
        seeds: seeds under which the best one is tried.
        moved: how many of these also try it with all parameters, and with the device, 20 % off.
    """

    points: int = 12
    first: int = 2
    finalists: int = 3
    around: int = 6
    tuning: int = 6
    last: int = 24
    seeds: int = 32
    moved: int = 6
    of_seed: int = 3


# If the parameters for a similar loop are known, the search begins and ends around them.
BESIDE = Effort(points=0, tuning=3, last=12, seeds=16, moved=0)


@dataclass(frozen=True)
class Job:
    """A stabilizer to be tuned and tried.

    Attributes:
        alone_N_m: roughly the stiffest wall without any.
        starts: blocks of seeds with which it is tuned and tried, each block separately, since they share no seeds; and
            the parameters from which each begins, None for the whole box.
    """

    loop: Scene
    family: str
    alone_N_m: float
    starts: tuple[tuple[int, Values | None], ...]
    effort: Effort


@dataclass(frozen=True)
class Row:
    """What was found of a stabilizer on a loop.

    Attributes:
        values: the parameters of the tuning, in the order of the family.
        at_edge: the parameters within a twentieth of the end of their search, and "wall" where no stiffest was found.
        seeds: the result of each seed with those parameters.
        parameter, device: the held stiffness with all parameters, or the device, 20 % less and more, over that without
            the change.
    """

    family: str
    block: int
    values: Values
    at_edge: tuple[str, ...]
    seeds: tuple[Trying, ...]
    parameter: tuple[float, ...] = ()
    device: tuple[float, ...] = ()


def family_of(name: str) -> Family:
    return next(family for family in STABILIZERS if family.name == name)


def alone(loop: Scene) -> float:
    """Returns roughly the stiffest wall that bears a few conditions without any element, N/m; 10 at least."""
    query = Query(loop, (), draw(ranges(loop), 0, 0, 6), ladder(10.0, 1e5, 1.6))
    with Trial(Store(), 1) as trial:
        return max(10.0 * LEAST_N_M, limits(trial, [query], _ROUGH)[0].stiffness_N_m)


def bench(job: Job) -> tuple[Row, ...]:
    """Tunes and tries one stabilizer under every block of seeds, side by side."""
    loop, family, effort = job.loop, family_of(job.family), job.effort
    of, ends = ranges(loop), box(family, loop, job.alone_N_m)
    rungs = tuple(job.alone_N_m * times for times in _RUNGS)

    def queries(choice: Choice, first: int, count: int, device: float = 1.0) -> list[Query]:
        (block, values), moved = choice, loop if device == 1.0 else _device(loop, device)
        drawn = (draw(of, block, seed, effort.of_seed) for seed in range(first, first + count))
        return [Query(moved, family.elements(values), cases, rungs) for cases in drawn]

    with Trial(Store(), 1) as trial:

        def shown(choices: Sequence[Choice], turn: int, seeds: int) -> dict[Choice, Shown]:
            asked = [query for choice in choices for query in queries(choice, turn * _TUNING, seeds)]
            found = [(each.rendered.held_N_m, each.rendered.extra_rms_N) for each in tried(trial, asked, _ROUGH)]
            return {choice: Shown(*each.T) for choice, each in
                    zip(choices, np.reshape(found, (-1, seeds, 2)), strict=True)}  # fmt: skip

        best = _tuned(shown, ends, job)
        asked = [query for choice in best.items() for query in queries(choice, 1, effort.seeds)]
        (block, values), *_ = best.items()
        off = [(_times(values, ends, factor), 1.0) for factor in OFF] if values else []
        off += [(values, factor) for factor in OFF]
        asked += [query for some, device in off for query in queries((block, some), 1, effort.moved, device)]
        found = tried(trial, asked, _CLOSE)
    tries = [tuple(found[at * effort.seeds :][: effort.seeds]) for at in range(len(best))]
    shares = _shares(tries[0], found[len(best) * effort.seeds :], effort.moved)
    rows = [
        Row(family.name, block, values, _at_edge(family, values, ends, seeds), seeds)
        for (block, values), seeds in zip(best.items(), tries, strict=True)
    ]
    return replace(rows[0], parameter=shares[: -len(OFF)], device=shares[-len(OFF) :]), *rows[1:]


def _shares(as_is: Sequence[Trying], moved: Sequence[Trying], count: int) -> tuple[float, ...]:
    """Returns what is held with each change over what is held without it, over ``count`` seeds each."""
    base = sum(each.rendered.held_N_m for each in as_is[:count])
    sums = [sum(each.rendered.held_N_m for each in moved[at : at + count]) for at in range(0, len(moved), count or 1)]
    return tuple(each / base if base else 0.0 for each in sums)


def _tuned(shows: Shows, ends: Sequence[Ends], job: Job) -> dict[int, Values]:
    """Returns the parameters that render most in each block, by three rounds of trials.

    Tried are points over the whole box; then the best of them and others along the axes through the best; then the best
    of these and the start of the search: the smallest of all parameters, almost no element, or those for a similar
    loop. Of those that then hold as much, the ones that add the least force are returned.
    """
    if not ends:
        return {block: () for block, _ in job.starts}
    effort, smallest = job.effort, tuple(float(f"{low * _NONE:.2g}") for low, _ in ends)
    begins = {block: smallest if start is None else start for block, start in job.starts}
    points = [(block, values) for block, start in job.starts if start is None for values in halton(ends, effort.points)]
    known = shows([*begins.items(), *points], 1, effort.first) if points else {}
    going = list[Choice]()
    for block, begin in begins.items():
        order = _most(known, block)[: effort.finalists] or [begin]
        going += [(block, values) for values in dict.fromkeys([*order, *along(order[0], ends, _ALONG, effort.around)])]
    known = shows(going, 2, effort.tuning)
    last = [(block, values) for block in begins for values in
            dict.fromkeys([*_most(known, block)[: effort.finalists], begins[block]])]  # fmt: skip
    known = shows(last, 3, effort.last)
    return {block: gentlest({values: each for (of, values), each in known.items() if of == block}) for block in begins}


def _most(known: Mapping[Choice, Shown], block: int) -> list[Values]:
    """Returns the parameters of a block, those that render most first."""
    return sorted((values for of, values in known if of == block),
                  key=lambda values: -float(known[block, values].held_N_m.mean()))  # fmt: skip


def gentlest(known: Mapping[Values, Shown]) -> Values:
    """Returns the parameters that add the least force, of those that hold as much as the best within a standard error
    of the difference (the rule of Breiman et al. 1984): what holds most by chance is often near where it breaks."""
    best = max(known.values(), key=lambda each: float(each.held_N_m.mean()))
    off = {values: best.held_N_m - each.held_N_m for values, each in known.items()}
    alike = [values for values, each in off.items() if each.mean() <= np.std(each, ddof=1) / len(each) ** 0.5]
    return min(alike, key=lambda values: float(known[values].force_N.mean()))


def along(best: Values, ends: Sequence[Ends], share: float, count: int) -> list[Values]:
    """Returns ``count`` points on the axes through the best, over this share of an axis's length, to two digits."""
    points, count = list[Values](), count // len(ends)
    for axis, (value, (low, high)) in enumerate(zip(best, ends, strict=True)):
        wide = (high / low) ** (share / 2.0)
        left, right = max(low, value / wide), min(high, value * wide)
        for place in range(count):
            moved = float(f"{left * (right / left) ** ((place + 0.5) / count):.2g}")
            points.append((*best[:axis], moved, *best[axis + 1 :]))
    return list(dict.fromkeys(points))


def _times(values: Values, ends: Sequence[Ends], factor: float) -> Values:
    """Returns all parameters multiplied, but none beyond the end of its search."""
    return tuple(min(value * factor, max(high, value)) for value, (_, high) in zip(values, ends, strict=True))


def _device(loop: Scene, factor: float) -> Scene:
    for key in _DEVICE:
        if value_at(loop, key):
            loop = scaled(loop, key, factor)
    return loop


def _at_edge(family: Family, values: Values, ends: Sequence[Ends], seeds: Sequence[Trying]) -> tuple[str, ...]:
    found = []
    for (_, key), value, (low, high) in zip(family.parts, values, ends, strict=True):
        near = (high / low) ** 0.05
        found += [key] * (not low * near < value < high / near)
    return tuple(found + ["wall"] * any(each.limit_N_m >= MOST_N_M for each in seeds))
