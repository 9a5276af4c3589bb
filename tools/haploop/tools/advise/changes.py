"""Changes of a device, one at a time, and what the limit becomes with each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from haploop.protocol.scene.paths import value_at, with_value
from haploop.protocol.scene.scene import Scene
from haploop.tools.advise.families import Values, around, scaled_values
from haploop.tools.advise.search import Found
from haploop.tools.advise.walls.cases import FIRST_HOLDS, Case
from haploop.tools.advise.walls.corners import ASSUMED, DELAY, Corner, delay_s, ranges, scale_quantities
from haploop.tools.advise.walls.limit import LEAST_N_M, Limit, Query, ladder, limits
from haploop.tools.advise.walls.trial import Trial

# How closely these limits are found.
CLOSE = 0.06
# One value halved or doubled: words, key, factor.
_SCALED = (
    ("encoder step halved", "encoder.resolution", 0.5),
    ("dry friction doubled", "friction.kinetic", 2.0),
    ("dry friction halved", "friction.kinetic", 0.5),
    ("device mass halved", "device.mass", 0.5),
    ("device mass doubled", "device.mass", 2.0),
    ("motor mass halved", "transmission.motor_mass", 0.5),
    ("transmission twice as stiff", "transmission.stiffness", 2.0),
    ("transmission damping doubled", "transmission.damping", 2.0),
    ("position noise halved", "noise.deviation", 0.5),
)
# Below this share of the wall it does not matter how little an element bears.
_LEAST = 0.1
# Viscous damping that is added, N s/m.
_ADDED_DAMPING = 1.0


def changes(loop: Scene) -> dict[str, Scene]:
    """Returns the loops with one change each, by what is changed; only values that exist and are not 0 are changed."""
    found = {words: scale_quantities(loop, {key: factor}) for words, key, factor in _SCALED if value_at(loop, key)}
    clock = loop.clock
    key = "transmission.motor_damping" if loop.transmission else "device.damping"
    found[f"{_ADDED_DAMPING:g} N s/m of viscous damping added"] = with_value(
        loop, key, value_at(loop, key) + _ADDED_DAMPING
    )
    rate = 2 * clock.control_rate
    if clock.plant_rate % rate == 0:
        found["ticks twice as often"] = with_value(loop, "clock.control_rate", rate)
    if clock.round_trip_delay:
        found[f"{DELAY} halved"] = with_value(loop, "clock.round_trip_delay", delay_s(loop, 0.5))
    return found


def assumed_otherwise(loop: Scene, keys: Sequence[str]) -> dict[tuple[str, float], Scene]:
    """Returns the loops with one assumed number halved or doubled, by (key, factor)."""
    return {(key, factor): scale_quantities(loop, {key: factor}) for key in keys for factor in ASSUMED}


def scaled(loop: Scene, key: str, factor: float) -> Scene:
    """Returns the loop with one value multiplied."""
    return with_value(loop, key, value_at(loop, key) * factor)


@dataclass(frozen=True)
class Borne:
    """What a loop bears in its hardest corners.

    Attributes:
        limit: with the element at its best size, or without one, whichever bears more.
        alone: without an element.
        values: that size; empty if the loop without an element bears as much.
    """

    limit: Limit
    alone: Limit
    values: Values = ()


def changed_limits(trial: Trial, loops: Sequence[Scene], found: Found) -> list[Borne]:
    """Returns what changed loops bear, with nothing else changed but the size of the element, which is tuned again.

    They are tried as described and in the corners hardest on the unchanged loop, as far as the change left these, at
    the holds tried first. Tried only as described, the largest element that just does not buzz would bear most, and a
    change would tell nothing.
    """
    best, near = found.advised, found.stiffness_N_m or found.advised.nominal.stiffness_N_m
    sizes = around(best.values) if best.values else []
    cases = [_cases(loop, found.hardest) for loop in loops]

    def query(place: int, values: Values) -> Query:
        least_N_m = max(LEAST_N_M, near * _LEAST)
        return Query(loops[place], best.family.elements(values), cases[place], _rungs(near), least_N_m)

    without = [Query(loop, (), of, _rungs(found.alone_N_m or near)) for loop, of in zip(loops, cases, strict=True)]
    asked = [(place, values) for place in range(len(loops)) for values in sizes]
    some = limits(trial, [*without, *(query(*each) for each in asked)], CLOSE)
    known: list[dict[Values, Limit]] = [{} for _ in loops]
    for (place, values), limit in zip(asked, some[len(loops) :], strict=True):
        known[place][values] = limit
    # If the best size for a changed loop is at an end of those tried, the true best may lie beyond.
    beyond = [(place, values) for place, of in enumerate(known) for values in outward(of)]
    for (place, values), limit in zip(beyond, limits(trial, [query(*each) for each in beyond], CLOSE), strict=True):
        known[place][values] = limit
    borne = []
    for alone, of in zip(some, known, strict=False):
        values, limit = max(of.items(), key=lambda row: row[1].stiffness_N_m, default=((), alone))
        with_one = limit.stiffness_N_m > alone.stiffness_N_m
        borne.append(Borne(limit, alone, values) if with_one else Borne(alone, alone))
    return borne


def outward(known: Mapping[Values, Limit]) -> list[Values]:
    """Returns two more sizes beyond the one that bears most, if that is the smallest or the largest."""
    sizes = sorted(known)
    if not sizes:
        return []
    most = max(sizes, key=lambda values: known[values].stiffness_N_m)
    ends = {sizes[0]: (-0.5, -1.0), sizes[-1]: (0.5, 1.0)}
    return [scaled_values(most, half) for half in ends.get(most, ())]


def _rungs(near_N_m: float) -> tuple[float, ...]:
    return ladder(max(LEAST_N_M, near_N_m / 2.0), max(LEAST_N_M, near_N_m) * 2.0, 1.3)


def _cases(loop: Scene, hardest: Sequence[Corner]) -> tuple[Case, ...]:
    """Returns the cases of a changed loop; quantities that the change removed are not varied, nor assumed ones."""
    names = ranges(loop)
    corners = [tuple((name, factor) for name, factor in corner if name in names) for corner in hardest]
    return tuple(Case(hold, corner) for corner in dict.fromkeys(((), *corners)) for hold in FIRST_HOLDS)
