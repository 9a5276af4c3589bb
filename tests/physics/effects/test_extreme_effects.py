"""The books close in scenes with effects drawn from orders of magnitude beyond any device."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from haploop.protocol.scene.scene import Scene
from helpers.runs.captured import run
from helpers.scenes.effect_tables import slowly
from helpers.scenes.least import scene
from helpers.scenes.random_scenes import log_uniform


def extreme(seed: int) -> Scene:
    """Any subset of the effects of the plant, on any scale, thrown at a wall and shaken."""
    rng = np.random.default_rng(seed)
    rate, n = int(rng.choice([1_000, 10_000, 50_000])), int(rng.choice([1, 2, 10]))
    has = lambda: bool(rng.random() < 0.6)  # noqa: E731
    mass, steps = log_uniform(rng, 1e-3, 10), int(rng.integers(30))
    # Slower than a hundred steps: how fast effects come and go is drawn against the plant rate.
    stiffness = lambda: min(log_uniform(rng, 1.0, mass * (3 * rate) ** 2), 1e9)  # noqa: E731
    damping = lambda: mass * log_uniform(rng, 1e-6, 1e4) if has() else 0.0  # noqa: E731
    kinetic = log_uniform(rng, 1e-4, 10)
    tables: dict[str, Any] = {
        "seed": seed,
        "duration": 400 * n / rate,
        "diverged_beyond": float(rng.choice([1.0, 1e6])),
        "clock": {"plant_rate": rate, "control_rate": rate // n, "round_trip_delay": steps / rate},
        "device": {"mass": mass, "damping": damping(), "velocity": float(rng.choice([-1, 1])) * rng.uniform(0.05, 2)},
        "wall": {"position": float(rng.choice([0, -1e-3, 0.1])), "stiffness": log_uniform(rng, 1, 1e6)},
        "hand": {
            "mass": mass * log_uniform(rng, 1e-3, 1e3),
            "damping": damping(),
            "stiffness": stiffness() if has() else 0.0,
            "rest": rng.uniform(-0.1, 0.1),
            "force": {"kind": "sine", "amplitude": log_uniform(rng, 1e-3, 100), "frequency": log_uniform(rng, 1, rate)},
        },
    }
    if has():
        tables["hand"]["grip"] = {"stiffness": stiffness(), "damping": damping()}
    if has():
        motor = {"motor_mass": mass * log_uniform(rng, 1e-2, 1e2), "motor_damping": damping()}
        tables["transmission"] = motor | {"stiffness": stiffness(), "damping": damping()}
    if has():
        tables["friction"] = {"kinetic": kinetic}
        tables["friction"] |= {"breakaway": kinetic * rng.uniform(1, 3)} if has() else {}
        tables["friction"] |= (
            {"stribeck_velocity": log_uniform(rng, 1e-4, 1)} if "breakaway" in tables["friction"] else {}
        )
    if has():
        tables["actuator"] = {"bandwidth": log_uniform(rng, 0.1, 10 * rate)}
        tables["actuator"] |= {"saturation": log_uniform(rng, 0.1, 1e3)} if has() else {}
    if has():
        tables["jitter"] = {"kind": "uniform", "most": int(rng.integers(40)) / rate}
    if has():
        tables["dissipation"] = [{"kind": "damping", "damping": log_uniform(rng, 1e-3, 100), "acts": "always"}]
    return scene(**tables)


@pytest.mark.parametrize("seed", [*range(4), *slowly(range(4, 60))])
def test_the_books_close_to_1e_12_in_scenes_with_effects_drawn_from_far_too_wide_a_range(seed):
    ran = run(extreme(seed))
    assert ran.relative_residual < 1e-12
    assert ran.energy.get("friction_heat_J", 0.0) >= 0.0
    assert all(np.isfinite(column).all() for column in ran.plant.values())
