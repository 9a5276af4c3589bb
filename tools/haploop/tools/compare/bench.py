"""One stabilizer on one loop: tuned on conditions of its own, then tried under other seeds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from haploop.protocol.scene.paths import value_at
from haploop.protocol.scene.scene import Scene
from haploop.tools.advise.changes import scaled
from haploop.tools.advise.families import STABILIZERS, Family, Values, box, halton
from haploop.tools.advise.report import describe
from haploop.tools.advise.walls.cases import ranges
from haploop.tools.advise.walls.limit import LEAST_N_M, MOST_N_M, Query, ladder, limits
from haploop.tools.advise.walls.rendered import Trying, tried
from haploop.tools.advise.walls.trial import Store, Trial
from haploop.tools.compare.conditions import draw

# How closely limits are found while parameters are compared, and then.
_ROUGH, CLOSE = 0.25, 0.08
# Rungs of the tuning, as multiples of the wall without any element: softer walls have to bear everything, too.
_RUNGS = (0.3, 0.8, 1.0, 1.25, 1.55, 1.95, 2.5, 4.0, 7.0)
# Rungs of a trial, as multiples of the limit in the tuning.
_ABOUT = (0.15, 0.5, 0.7, 0.8, 0.9, 1.0, 1.12, 1.25, 1.5)
# The share of a box's logarithmic axes that is searched through the best.
_ALONG = 0.6
# What is 20 % off, together, to tell how sensitive the wall is to the device.
_DEVICE = ("device.mass", "device.damping", "friction.kinetic", "transmission.stiffness")
OFF = (0.8, 1.2)

Ends = tuple[float, float]
Choice = tuple[int, Values]
Tune = Callable[[Sequence[Choice]], dict[Choice, Trying]]


@dataclass(frozen=True)
class Effort:
    """How much is spent on every stabilizer alike.

    Attributes:
        points: parameters tried in the whole box, and as many along its axes through the best.
        cases: of the tuning.
        seeds: each draws ``of_seed`` cases.
    """

    points: int = 7
    cases: int = 4
    seeds: int = 6
    of_seed: int = 3


@dataclass(frozen=True)
class Job:
    """A stabilizer to be tuned and tried.

    Attributes:
        alone_N_m: about the stiffest wall without any.
        blocks: the seeds that it is tuned and tried by, each for itself; blocks share none.
        sensitive: whether its sensitivity is measured, by the first block.
    """

    loop: Scene
    family: str
    alone_N_m: float
    blocks: tuple[int, ...]
    effort: Effort
    sensitive: bool = True


@dataclass(frozen=True)
class Row:
    """What was found of a stabilizer on a loop.

    Attributes:
        values: the parameters that render most in the tuning, in the order of the family.
        at_edge: the parameters within a twentieth of the end of their search, and "wall" where no stiffest was found.
        seeds: what came of each seed with those parameters.
        breaks: the softest wall that failed under any of them, N/m, and what it did.
        parameter, device: the held stiffness with all parameters, or the device, 20 % less and more, over that without.
    """

    family: str
    block: int
    values: Values
    at_edge: tuple[str, ...]
    seeds: tuple[Trying, ...]
    breaks: tuple[float, str] | None
    parameter: tuple[float, ...] = ()
    device: tuple[float, ...] = ()


def family_of(name: str) -> Family:
    return next(family for family in STABILIZERS if family.name == name)


def alone(loop: Scene) -> float:
    """Returns about the stiffest wall that bears a few conditions without any element, N/m; 10 at least."""
    query = Query(loop, (), draw(ranges(loop), 0, 0, 6), ladder(10.0, 1e5, 1.6))
    with Trial(Store(), 1) as trial:
        return max(10.0 * LEAST_N_M, limits(trial, [query], _ROUGH)[0].stiffness_N_m)


def bench(job: Job) -> tuple[Row, ...]:
    """Tunes and tries one stabilizer by every block of seeds, side by side."""
    loop, family, effort, blocks = job.loop, family_of(job.family), job.effort, job.blocks
    of, ends = ranges(loop), box(family, loop, job.alone_N_m)
    tuning = {block: draw(of, block, 0, effort.cases) for block in blocks}
    with Trial(Store(), 1) as trial:

        def tune(choices: Sequence[Choice]) -> dict[Choice, Trying]:
            rungs = tuple(job.alone_N_m * times for times in _RUNGS)
            queries = [Query(loop, family.elements(values), tuning[block], rungs) for block, values in choices]
            return dict(zip(choices, tried(trial, queries, _ROUGH), strict=True))

        best = _tuned(tune, ends, effort.points, blocks)
        queries: list[Query] = []
        for block, (values, near) in best.items():
            elements = family.elements(values)
            rungs = tuple(times * (near.limit_N_m or job.alone_N_m / 3.0) for times in _ABOUT)
            drawn = [draw(of, block, seed, effort.of_seed) for seed in range(1, effort.seeds + 1)]
            queries += [Query(loop, elements, cases, rungs) for cases in drawn]
            if job.sensitive and block == blocks[0]:
                off = [family.elements(_times(values, ends, factor)) for factor in OFF] if values else []
                queries += [Query(loop, some, tuning[block], rungs) for some in (elements, *off)]
                queries += [Query(_device(loop, factor), elements, tuning[block], rungs) for factor in OFF]
        found = tried(trial, queries, CLOSE)
    later = (len(blocks) - 1) * effort.seeds
    parts = [
        found[: len(found) - later],
        *(found[at : at + effort.seeds] for at in range(len(found) - later, len(found), effort.seeds)),
    ]
    return tuple(
        _row(family, block, best[block][0], ends, part, effort.seeds) for block, part in zip(blocks, parts, strict=True)
    )


def _row(family: Family, block: int, values: Values, ends: Sequence[Ends], found: Sequence[Trying], count: int) -> Row:
    """Makes the row of a block: so many seeds, then the tuning again as it is and with what is 20 % off."""
    seeds, base, *moved = (found[:count], *(each.rendered.held_N_m for each in found[count:]), 0.0)
    shares = [each / base if base else 0.0 for each in moved[:-1]]
    worst = min((each for each in seeds if each.failure), key=lambda each: each.fails_N_m, default=None)
    return Row(
        family=family.name,
        block=block,
        values=values,
        at_edge=_at_edge(family, values, ends, seeds),
        seeds=tuple(seeds),
        breaks=(worst.fails_N_m, describe(worst.failure)) if worst and worst.failure else None,
        parameter=tuple(shares[: -len(OFF)]),
        device=tuple(shares[-len(OFF) :]),
    )


def _tuned(tune: Tune, ends: Sequence[Ends], count: int, blocks: Sequence[int]) -> dict[int, tuple[Values, Trying]]:
    """Returns what renders most in each block: of some over the whole box, then of as many along its axes.

    The first has the smallest of all parameters, which are about none.
    """
    first = [tuple(float(f"{low:.2g}") for low, _ in ends), *(halton(ends, count) if ends else [])]
    known = tune([(block, values) for block in blocks for values in first])

    def best(block: int) -> tuple[Values, Trying]:
        of_block = {values: each for (of, values), each in known.items() if of == block}
        return max(of_block.items(), key=lambda each: each[1].rendered.held_N_m)

    if ends:
        more = [(block, values) for block in blocks for values in along(best(block)[0], ends, _ALONG, count)]
        known |= tune([choice for choice in more if choice not in known])
    return {block: best(block) for block in blocks}


def along(best: Values, ends: Sequence[Ends], share: float, count: int) -> list[Values]:
    """Returns so many points on the axes through the best, over this share of an axis's length, to two digits."""
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
