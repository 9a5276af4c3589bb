"""A wall behind a coarse encoder whose small swing uses up the energy that a passivity observer has in store."""

from __future__ import annotations

from typing import Any

from haploop.protocol.scene.scene import Scene
from helpers.scenes.least import scene


def observed(stiffness: float = 1000.0, **tables: Any) -> Scene:
    """The loop: once the store is used up, after some ten seconds, the controller chatters, and a hand feels it."""
    return scene(
        duration=3.0, device={"mass": 0.3, "damping": 0.15}, encoder={"resolution": 0.2 / 4096},
        wall={"position": -0.005, "stiffness": stiffness}, clock={"round_trip_delay": 5e-4},
        actuator={"saturation": 1.5},
        hand={"mass": 0.269, "damping": 6.43, "stiffness": 105.3, "force": {"kind": "constant", "value": -2.0}},
        dissipation=[{"kind": "passivity-controller", "damping": 10.0}], **tables)  # fmt: skip
