"""Which motion many loops of one structure ask for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from haploop.plant.choose import needs_chain
from haploop.plant.motion.one_mass_batch import LinearMotionArray
from haploop.protocol.ticks import Timebase

if TYPE_CHECKING:
    from haploop.plant.chain.motion_batch import ChainMotionArray


def motion_of(scene: dict[str, Any], time: Timebase) -> LinearMotionArray | ChainMotionArray:
    """The least that moves the loops of a stacked scene."""
    if "friction" in scene:
        from haploop.plant.friction.motion_batch import FrictionMotionArray

        return FrictionMotionArray(scene, time)
    if needs_chain(scene):
        from haploop.plant.chain.motion_batch import ChainMotionArray

        return ChainMotionArray(scene, time)
    return LinearMotionArray(scene, time)
