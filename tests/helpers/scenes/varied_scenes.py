"""Scenes of one structure that differ in every number that may differ."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from haploop.protocol.scene.scene import Scene
from haploop.protocol.scene.table import Table
from helpers.scenes.least import scene
from helpers.scenes.random_scenes import tables_of

# Numbers that scenes of one structure share.
_SHARED = {"clock", "duration", "at", "delay", "time", "run", "diverged_beyond"}
ESTIMATORS: list[dict[str, Any]] = [
    {},
    {"velocity": {"cutoff": 90.0}, "acceleration": {"cutoff": 60.0}},
    {"velocity": {"estimator": "window", "ticks": 4}},
    {"velocity": {"estimator": "foaw", "ticks": 6}},
    {"velocity": {"estimator": "foaw", "ticks": 5, "fit": "best", "bound": 2e-5, "cutoff": 150.0}},
    {"velocity": {"estimator": "kalman", "jerk_density": 2e3}, "acceleration": {"source": "kalman"}},
    {"acceleration": {"source": "accelerometer", "cutoff": 80.0}},
    {"acceleration": {"estimator": "foaw", "ticks": 4, "bound": 0.05}},
]


def drawn_base(seed: int) -> Scene:
    """A scene with everything that runs in arrays, random parts included."""
    rng = np.random.default_rng(seed)
    tables = tables_of(seed, rng)
    if seed % 2:
        tables |= {"noise": {"deviation": 3e-6, "cutoff": 120.0}, "seed": seed}
        tables["encoder"] = {"resolution": 1e-5, "rounding": "floor" if seed % 4 == 1 else "nearest"}
    if seed % 3 == 1:
        tables["actuator"] = {"saturation": 0.25} | ({"resolution": 2e-3} if seed % 2 else {})
    tables |= ESTIMATORS[seed % len(ESTIMATORS)] if "encoder" in tables else {}
    return scene(**tables)


def drawn_chain(seed: int) -> Scene:
    """Bodies in a row, with any of a cable, a grip, an actuator's bandwidth and an accelerometer that is not ideal."""
    rng = np.random.default_rng([seed, 1])
    tables = tables_of(seed, rng)
    tables |= {"seed": seed, "duration": 0.15}
    if seed % 2:
        tables["transmission"] = {"motor_mass": 0.02, "stiffness": 2e4, "damping": 0.4, "motor_damping": 0.05}
    if seed % 3 == 0 and "hand" in tables:
        tables["hand"] = {**tables["hand"], "grip": {"stiffness": 600.0, "damping": 2.0}}
    if seed % 4 < 2 or seed % 6 == 2:
        limits = {"saturation": 0.25, "resolution": 2e-3} if seed % 5 < 2 else {}
        tables["actuator"] = {"bandwidth": rng.uniform(100.0, 400.0), **limits}
    if seed % 5 > 1:
        step_s = 1.0 / tables["clock"]["plant_rate"]
        sensor: dict[str, Any] = {"range": 15.0, "resolution": 0.01, "noise_density": 3e-3, "bias": 0.1}
        sensor |= {"bandwidth": 260.0, "delay": 3 * step_s}
        for name in rng.choice(sorted(sensor), rng.integers(3), replace=False):
            del sensor[name]
        tables |= {"accelerometer": sensor, "acceleration": {"source": "accelerometer"}}
    return scene(**tables)


def varied(base: Scene, rng: np.random.Generator) -> Scene:
    """Returns a scene of equal structure in which every number differs by up to a tenth, with another seed."""
    return replace(_varied(base, rng), seed=int(rng.integers(2**62)), title=f"varied {rng.integers(1000)}")


def _varied(value: Any, rng: np.random.Generator) -> Any:
    if isinstance(value, dict):
        return {key: entry if key in _SHARED else _varied(entry, rng) for key, entry in value.items()}
    if isinstance(value, Table):
        return type(value)(**_varied(vars(value), rng))
    if isinstance(value, tuple):
        return tuple(_varied(entry, rng) if isinstance(entry, Table) else entry for entry in value)
    return value * rng.uniform(0.9, 1.1) if isinstance(value, float) else value
