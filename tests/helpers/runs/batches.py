"""Loops run together and alone, for the tests of arrays of scenes."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Annotated, Any

import numpy as np

from haploop.controller.dissipation import Element, Motion, Quantity
from haploop.launch.batch.batch import Batch
from haploop.launch.runs.in_process import run_in_process
from haploop.logger.summary import OF_THE_MACHINE, Summary
from haploop.protocol.scene.paths import with_value
from haploop.protocol.scene.scene import ElementTable, Scene
from helpers.scenes.least import KINDS, scene

PUSH = {"mass": 0.01, "stiffness": 10.0, "damping": 0.01, "force": {"kind": "ramp", "value": -0.8, "rise_time": 0.05}}


def alone(made: Scene, kinds: dict[str, type[Element]] = KINDS) -> Summary:
    summary = run_in_process(made, kinds)
    return {key: value for key, value in summary.items() if key not in OF_THE_MACHINE}


def together(scenes: list[Scene], kinds: dict[str, type[Element]] = KINDS) -> list[Summary | None]:
    loops = Batch(scenes, kinds, trajectories=True)
    loops.run()
    return loops.results


def pressed(**tables: Any) -> Scene:
    """A hand pushes the device into a wall with a damper."""
    whole: dict[str, Any] = {
        "duration": 0.15,
        "clock": {"round_trip_delay": 0.0013},
        "hand": PUSH,
        "encoder": {"resolution": 1e-5},
        "wall": {"position": -0.002, "stiffness": 300.0},
        "dissipation": [{"kind": "damping", "damping": 0.2}],
    }
    return scene(**{**whole, **tables})


def diverging() -> list[Scene]:
    """Some of these diverge, each at a different time; some do not."""
    return [
        pressed(
            duration=0.6,
            diverged_beyond=0.05,
            clock={"round_trip_delay": 0.004},
            dissipation=[{"kind": "damping", "damping": damping, "acts": "always"}],
            velocity={"estimator": "foaw", "ticks": 4},
        )
        for damping in np.linspace(1.0, 12.0, 16).tolist()
    ]


def with_stiffness(made: Scene, stiffness: float) -> Scene:
    """The scene with another stiffness of its wall."""
    return with_value(made, "wall.stiffness", stiffness)


def with_element(made: Scene, kind: str, **parameters: float) -> Scene:
    """The scene with one element that always acts, in place of its own."""
    return replace(made, dissipation=(ElementTable(name=kind, acts="always", parameters=parameters),))


class Stiffening(Element):
    """Written for a single loop: needs the plain number."""

    kind = "stiffening"
    force_N: Annotated[float, Quantity("N", at_least=0)] = 0.05

    def force(self, motion: Motion) -> float:
        return -math.tanh(motion.v / 0.01) * self.force_N if motion.v > 0 else 0.0
