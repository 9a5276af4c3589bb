"""Changes of a device, one at a time, and what the limit becomes with each."""

from __future__ import annotations

from collections.abc import Sequence

from haploop.launch.plan.effects import all_effects
from haploop.protocol.scene.paths import value_at, with_value
from haploop.protocol.scene.scene import Scene
from haploop.tools.advise.walls.cases import FIRST_HOLDS, Case
from haploop.tools.advise.walls.corners import ASSUMED, DELAY, delay_s, scale_quantities
from haploop.tools.advise.walls.limit import Limit, Query, ladder, limits
from haploop.tools.advise.walls.trial import Trial
from haploop.tools.advise.withstand import Best

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
# Viscous damping that is added, N s/m.
_ADDED_DAMPING = 1.0


def changes(loop: Scene) -> dict[str, Scene]:
    """Returns the loops with one change each, by what is changed; only what is there and not 0 can be."""
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


def idealised(loop: Scene) -> dict[str, Scene]:
    """Returns the loops without one cause of buzzing each, which no change of a device reaches: they tell the cause."""
    found = {f"no {DELAY}": with_value(loop, "clock.round_trip_delay", 0.0)} if loop.clock.round_trip_delay else {}
    for name in dict.fromkeys(name for effect in all_effects() for name in effect.frees):
        changed = loop
        for effect in all_effects():
            if name in effect.frees and effect.is_in(changed):
                changed = effect.frees[name](changed)
        if changed is not loop:
            found[f"no {name}"] = changed
    return found


def assumed_otherwise(loop: Scene, keys: Sequence[str]) -> dict[tuple[str, float], Scene]:
    """Returns the loops with one assumed number halved or doubled, by (key, factor)."""
    return {(key, factor): scale_quantities(loop, {key: factor}) for key in keys for factor in ASSUMED}


def scaled(loop: Scene, key: str, factor: float) -> Scene:
    """Returns the loop with one value multiplied."""
    return with_value(loop, key, value_at(loop, key) * factor)


def changed_limits(trial: Trial, loops: Sequence[Scene], best: Best) -> list[Limit]:
    """Returns the limits of changed loops, nothing else changed, at the holds tried first.

    With the element advised or without any, whichever bears more: what suits one loop may not suit the other.
    """
    top = max(1.0, best.nominal.stiffness_N_m)
    cases, rungs = tuple(Case(hold) for hold in FIRST_HOLDS), ladder(top / 4.0, top * 4.0, 1.26)
    choices = [best.family.elements(best.values)] + [()] * bool(best.values)
    found = limits(trial, [Query(loop, elements, cases, rungs) for loop in loops for elements in choices], CLOSE)
    each = len(choices)
    return [max(found[i : i + each], key=lambda limit: limit.stiffness_N_m) for i in range(0, len(found), each)]
