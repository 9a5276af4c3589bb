"""Scenes of one structure stacked into one: what differs from scene to scene becomes an array."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from haploop.launch.plan.effects import alone_perhaps
from haploop.plant.chain.chain import Chain
from haploop.plant.choose import needs_chain
from haploop.protocol.ticks import DELAY

# What says nothing of what is simulated.
_ASIDE = ("title", "seed", "run")
_TIMES = ("clock", "duration", "at", "delay")
# Members with friction have the same bodies.
_BODIES = ("device", "hand", "transmission", "friction", "actuator", "accelerometer")


def is_batchable(scene: dict[str, Any]) -> bool:
    """Tells whether a resolved scene takes the same way whatever its numbers, so that many can be run as one batch.

    Not so: jitter, loss, another integrator than the exact flow; a delay that changes; a chain whose damping needs the
    widest float; friction that has to be walked step by step.
    """
    if any(effect.is_in(scene) and not effect.batches_in(scene) for effect in alone_perhaps()):
        return False
    if any(DELAY in event.get("set", {}) for event in scene.get("event", [])):
        return False
    return not needs_chain(scene) or Chain.from_scene(scene).real_for(1.0 / scene["clock"]["plant_rate"]) is np.float64


def structure(scene: dict[str, Any]) -> Hashable:
    """Returns what scenes that are stacked must have in common: all but the values of their numbers.

    Times are common, too: the clock, the duration, delays, when events come, the points of a recorded force. So is
    whether a number is 0, which may mean that something is not there, and where there is friction all that moves.
    """
    return next(structures([scene]))


def structures(scenes: Iterable[dict[str, Any]]) -> Iterator[Hashable]:
    """Yields the structure of each scene; an entry that is the object of the scene before is not looked at again."""
    before: dict[str, Any] = {}
    parts: dict[str, Hashable] = {}
    for scene in scenes:
        by_value = _TIMES + _BODIES if "friction" in scene else _TIMES
        if "friction" in scene or "friction" in before:
            before = {}
        for key, value in scene.items():
            if key not in before or before[key] is not value:
                parts[key] = key, _structure(value, key in by_value)
        before = scene
        yield tuple([parts[key] for key in scene if key not in _ASIDE])


def _structure(value: Any, by_value: bool) -> Hashable:
    if value.__class__ is float:
        return value if by_value else value != 0.0
    if value.__class__ is dict:
        parts: list[Hashable] = []
        for key, entry in value.items():
            parts += (key, _structure(entry, by_value or key in _TIMES))
        return tuple(parts)
    if value.__class__ is list:
        of_numbers = bool(value) and value[0].__class__ is not dict
        return tuple([_structure(item, by_value or of_numbers) for item in value])
    return value


def stacked(scenes: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Returns one scene of many with the same structure; numbers that differ are arrays of shape (members,)."""
    return {key: _stacked([scene[key] for scene in scenes]) for key in scenes[0]}


def _stacked(values: Sequence[Any]) -> Any:
    first = values[0]
    if isinstance(first, dict):
        return {key: _stacked([value[key] for value in values]) for key in first}
    if isinstance(first, list):
        return [_stacked(items) for items in zip(*values, strict=True)]
    if isinstance(first, bool) or not isinstance(first, int | float):
        return first
    column = np.array(values)
    return first if (column == first).all() else column
