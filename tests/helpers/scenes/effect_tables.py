"""One table for every effect that moves or disturbs the loop, and a loop to try them in, alone and together."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations
from typing import Any

import pytest

from haploop.protocol.scene.scene import Scene
from helpers.scenes.least import scene

EFFECTS: dict[str, dict[str, Any]] = {
    "friction": {"friction": {"kinetic": 0.04, "breakaway": 0.05}},
    "transmission": {
        "transmission": {"motor_mass": 0.02, "stiffness": 2e4, "damping": 0.4, "motor_damping": 0.05},
    },
    "grip": {"hand": {"grip": {"stiffness": 600.0, "damping": 2.0}}},
    "bandwidth": {"actuator": {"bandwidth": 250.0}},
    "jitter": {"jitter": {"kind": "uniform", "most": 0.0025}},
    "loss": {"loss": {"probability": 0.3}},
    "noise": {"noise": {"deviation": 2e-6, "cutoff": 150.0}},
    "accelerometer": {
        "accelerometer": {
            "range": 40.0,
            "resolution": 0.01,
            "noise_density": 3e-3,
            "bandwidth": 260.0,
            "delay": 0.0003,
            "bias": 0.1,
        },
        "acceleration": {"source": "accelerometer"},
    },
}


def slowly(values: Iterable[Any]) -> list[Any]:
    """These parameters, for the slow tests only."""
    return [pytest.param(value, marks=pytest.mark.slow) for value in values]


def subsets(least: int, most: int, of: Iterable[str] = tuple(EFFECTS)) -> list[tuple[str, ...]]:
    """All sets of ``least`` to ``most`` effects."""
    return [chosen for size in range(least, most + 1) for chosen in combinations(of, size)]


def tap(effects: Iterable[str], **more: Any) -> Scene:
    """A hand presses the device into a wall with every kind of element in a third of a second, with these effects."""
    push = {"kind": "ramp", "value": -1.5, "rise_time": 0.1}
    tables: dict[str, Any] = {
        "duration": 0.3,
        "seed": 7,
        "clock": {"round_trip_delay": 0.0013},
        "device": {"mass": 0.05, "damping": 0.1, "velocity": -0.1},
        "hand": {"mass": 0.1, "damping": 1.0, "stiffness": 80.0, "rest": 1e-3, "force": push},
        "encoder": {"resolution": 1e-5},
        "wall": {"position": -0.002, "stiffness": 400.0},
        "dissipation": [
            {"kind": "damping", "damping": 0.2},
            {"kind": "unidirectional-damping", "damping": 0.1, "acts": "always"},
            {"kind": "unidirectional-inertia", "mass": 0.004},
            {"kind": "bidirectional-inertia", "mass": 0.002},
        ],
    }
    for table in (*(EFFECTS[name] for name in effects), more):
        for name, value in table.items():
            adds = isinstance(value, dict) and "kind" not in value
            tables[name] = {**tables.get(name, {}), **value} if adds else value
    return scene(**tables)


def creeping() -> Scene:
    """Comes to rest on an overdamped hand: without rounding v would fall for ever, and never be 0."""
    force, grip = {"kind": "constant", "value": -0.24}, {"stiffness": 772.0, "damping": 1.3}
    hand = {"mass": 0.1, "damping": 9.5, "stiffness": 190.0, "force": force, "grip": grip}
    return scene(
        duration=1.0,
        device={"mass": 0.022, "damping": 0.07},
        hand=hand,
        friction={"kinetic": 0.043},
        wall={"position": -1.0, "stiffness": 100.0},
    )
