"""Which motion many loops of one structure ask for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from haploop.plant.linear_motion_array import LinearMotionArray
from haploop.plant.motion import needs_chain
from haploop.protocol.ticks import Timebase

if TYPE_CHECKING:
    from haploop.plant.chain_motion_array import ChainMotionArray


def motion_of(scene: dict[str, Any], time: Timebase) -> LinearMotionArray | ChainMotionArray:
    """The least that moves the loops of a stacked scene."""
    if "friction" in scene:
        from haploop.plant.friction_motion_array import FrictionMotionArray

        return FrictionMotionArray(scene, time)
    if needs_chain(scene):
        from haploop.plant.chain_motion_array import ChainMotionArray

        return ChainMotionArray(scene, time)
    return LinearMotionArray(scene, time)
