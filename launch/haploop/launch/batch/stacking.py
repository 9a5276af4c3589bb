"""Scenes of one structure stacked into one: what differs from scene to scene becomes an array."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from haploop.launch.plan.effects import alone_perhaps
from haploop.plant.chain.chain import Chain
from haploop.plant.choose import needs_chain
from haploop.protocol.scene.scene import Scene
from haploop.protocol.scene.table import Table
from haploop.protocol.ticks import DELAY

# Keys that say nothing about what is simulated.
_ASIDE = ("title", "seed", "run")
_TIMES = ("clock", "duration", "at", "delay")
# The device and what it is joined to; how it moves and is pressed is not part of that.
_MOVES = ("position", "velocity", "rest", "force")
_BODIES = ("device", "hand", "transmission", "actuator", "accelerometer")


def is_batchable(scene: Scene) -> bool:
    """Tells whether a resolved scene takes the same path whatever its numbers, so that many can be run as one batch.

    Not batchable: jitter, loss, an integrator other than the exact flow; a delay that changes; a chain whose damping
    needs the widest float; friction that has to be followed step by step.
    """
    if any(effect.is_in(scene) and not effect.batches_in(scene) for effect in alone_perhaps()):
        return False
    if any(event.set and DELAY in event.set for event in scene.event):
        return False
    return not needs_chain(scene) or Chain.from_scene(scene).real_for(1.0 / scene.clock.plant_rate) is np.float64


def structure(scene: Scene) -> Hashable:
    """Returns what scenes must have in common to be stacked: everything except the values of their numbers.

    They also share times: the clock, the duration, delays, the times of events, the points of a recorded force; and
    whether a number is 0, which may mean that something is absent.
    """
    return next(structures([scene]))


def device_of(scene: Scene) -> Hashable:
    """Returns the numbers of a scene's bodies: scenes with the same numbers share what is computed from them."""
    return tuple(_structure(vars(scene)[key], True) for key in _BODIES)


def structures(scenes: Iterable[Scene]) -> Iterator[Hashable]:
    """Yields the structure of each scene; an entry that is the same object as before is not examined again."""
    before: Mapping[str, object] = {}
    parts: dict[str, Hashable] = {}
    for scene in scenes:
        entries = vars(scene)
        for key, value in entries.items():
            if before.get(key, _ASIDE) is not value and key not in _ASIDE:
                parts[key] = _structure(value, key in _TIMES)
        before = entries
        yield tuple(parts.values())


def _structure(value: Any, by_value: bool) -> Hashable:
    if value.__class__ is float:
        return value if by_value else value != 0.0
    if isinstance(value, Table | dict):
        entries = value if isinstance(value, dict) else vars(value)
        parts = [
            (key, _structure(entry, (by_value and key not in _MOVES) or key in _TIMES))
            for key, entry in entries.items()
        ]
        return value.__class__, *parts
    if isinstance(value, tuple | list):
        of_numbers = bool(value) and not isinstance(value[0], Table | dict)
        return tuple([_structure(item, by_value or of_numbers) for item in value])
    return value


def stacked(scenes: Sequence[Scene]) -> Scene:
    """Returns one scene made of many with the same structure; numbers that differ are arrays of shape (members,)."""
    return _stacked(scenes)


def _stacked(values: Sequence[Any]) -> Any:
    first = values[0]
    if len(set(map(id, values))) == 1:
        return first
    if isinstance(first, Table):
        return type(first)(**{key: _stacked([getattr(value, key) for value in values]) for key in vars(first)})
    if isinstance(first, dict):
        return type(first)((key, _stacked([value[key] for value in values])) for key in first)
    if isinstance(first, tuple | list):
        return type(first)(_stacked(items) for items in zip(*values, strict=True))
    if isinstance(first, bool) or not isinstance(first, int | float):
        return first
    column = np.array(values)
    return first if (column == first).all() else column
