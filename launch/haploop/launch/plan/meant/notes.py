"""The notes on a scene: for every rule that it breaks, and for numbers that hardly any loop has."""

from __future__ import annotations

from haploop.launch.plan.meant.loop import LOOP, SOFTEST_N_M
from haploop.launch.plan.meant.reach import REACH
from haploop.launch.plan.meant.rule import Found, Note, Rule
from haploop.protocol.filled import filled
from haploop.protocol.plugin_file import raised_in_file
from haploop.protocol.register import UnknownKind
from haploop.protocol.scene.paths import value_at
from haploop.protocol.scene.scene import Scene

# Beyond these bounds a number is valid, but more often a slip of the unit: key, least, most, unit.
_USUAL = (
    ("clock.round_trip_delay", 0.0, 1.0, "s"),
    ("wall.stiffness", SOFTEST_N_M, 2e5, "N/m"),
    ("device.mass", 1e-4, 10.0, "kg"),
    ("encoder.resolution", 1e-10, 1e-3, "m"),
    ("noise.deviation", 1e-10, 1e-3, "m"),
    ("actuator.saturation", 0.05, 1e3, "N"),
    ("hand.force.value", 1e-3, 200.0, "N"),
)
RULES = (*LOOP, *REACH)


def note_unmeant(scene: Scene) -> list[Note]:
    """Returns a sentence for every rule that a resolved scene breaks, and for numbers that hardly any loop has."""
    unusual = [
        Note(
            f"{key} is {value:g} {unit}; is that the unit you meant? Haptic loops have {least:g} to {most:g} {unit}.",
            key,
        )
        for key, least, most, unit in _USUAL
        if (value := value_at(scene, key)) and not least <= abs(value) <= most
    ]
    broken = [(rule, _broken(rule, scene)) for rule in RULES]
    return unusual + [
        Note(filled(rule.sentence, **found), rule.key.format(**found), rule.keeps_off)
        for rule, found in broken
        if found is not None
    ]


def _broken(rule: Rule, scene: Scene) -> Found | None:
    """Applies a rule; it says nothing if it needs a wall or a force that is not available, or whose code raises."""
    try:
        return rule.broken(scene)
    except UnknownKind:
        return None
    except Exception as error:
        if raised_in_file(error):  # the run will report it
            return None
        raise
