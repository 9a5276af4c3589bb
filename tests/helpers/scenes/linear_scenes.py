"""Linear scenes drawn by seed: chains of bodies, delays, estimators and elements of every linear kind."""

from __future__ import annotations

from typing import Any

import numpy as np

from haploop.protocol.scene.scene import Scene
from helpers.scenes.least import scene

DELAYS = (0, 3, 10, 13, 20, 37)
RATES = ((10_000, 1_000), (10_000, 2_000), (8_000, 500), (5_000, 5_000), (12_000, 1_500))


def linear_scene(seed: int) -> Scene:
    """A scene whose loop in contact is a linear map, with all that such a map can have."""
    rng = np.random.default_rng(seed)
    return scene(**_plant(rng), **_estimators(rng), dissipation=_elements(rng))


def _plant(rng: np.random.Generator) -> dict[str, Any]:
    plant_rate, control_rate = RATES[rng.integers(len(RATES))]
    delay = DELAYS[rng.integers(len(DELAYS))] / plant_rate
    tables: dict[str, Any] = {
        "clock": {"plant_rate": plant_rate, "control_rate": control_rate, "round_trip_delay": delay},
        "device": {"mass": rng.uniform(0.02, 0.1), "damping": rng.uniform(0.05, 0.6)},
        "hand": {"mass": 0.01, "damping": rng.uniform(0.01, 2.0), "stiffness": rng.uniform(0.0, 300.0)},
    }
    if rng.random() < 0.3:
        tables["hand"]["grip"] = {"stiffness": rng.uniform(200, 2000), "damping": rng.uniform(0.5, 4.0)}
    if rng.random() < 0.3:
        cable = {"stiffness": rng.uniform(1e4, 1e5), "damping": rng.uniform(0.1, 1.0)}
        tables["transmission"] = {"motor_mass": rng.uniform(0.01, 0.05), "motor_damping": 0.05, **cable}
    if rng.random() < 0.3:
        tables["actuator"] = {"bandwidth": rng.uniform(200, 1000)}
    return tables


def _estimators(rng: np.random.Generator) -> dict[str, Any]:
    cutoffs = [{"cutoff": rng.uniform(40, 300)} if rng.random() < 0.4 else {} for _ in range(2)]
    velocity, acceleration = _velocity(rng), _acceleration(rng)
    tables: dict[str, Any] = {"velocity": velocity | cutoffs[0], "acceleration": acceleration | cutoffs[1]}
    if velocity.get("estimator") == "kalman" and rng.random() < 0.5:
        tables["acceleration"] = {"source": "kalman"} | cutoffs[1]
    if rng.random() < 0.5:
        bandwidth = {"bandwidth": rng.uniform(100, 1000)} if rng.random() < 0.5 else {}
        tables["accelerometer"] = {"delay": float(rng.choice([0.0, 0.001, 0.002])), **bandwidth}
    return {name: table for name, table in tables.items() if table}


def _velocity(rng: np.random.Generator) -> dict[str, Any]:
    kalman = {"estimator": "kalman", "jerk_density": rng.uniform(500, 5000), "measurement_noise": 3e-6}
    fused = kalman | {"accelerometer": True, "accelerometer_noise": rng.uniform(0.05, 1.0)}
    return [{}, {}, {"estimator": "window", "ticks": int(rng.integers(2, 7))}, kalman, fused][rng.integers(5)]


def _acceleration(rng: np.random.Generator) -> dict[str, Any]:
    window = {"estimator": "window", "ticks": int(rng.integers(2, 5))}
    return [{}, window, {"source": "accelerometer"}][rng.integers(3)]


def _elements(rng: np.random.Generator) -> list[dict[str, Any]]:
    drawn: list[dict[str, Any]] = []
    for _ in range(rng.integers(0, 3)):
        drawn.append({"kind": "damping", "damping": rng.uniform(0.02, 0.4)})
    for _ in range(rng.integers(0, 3)):
        drawn.append({"kind": "bidirectional-inertia", "mass": rng.uniform(2e-4, 4e-3)})
    return drawn
