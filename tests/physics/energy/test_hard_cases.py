"""The books close in hard cases too; where they cannot, what is left is what the last bit of a position is worth."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from haploop.logger.books import one_mass
from haploop.protocol.scene.scene import Scene
from helpers.runs.captured import run
from helpers.scenes.least import scene
from helpers.scenes.random_scenes import log_uniform

STIFF_WALL = {"position": -1e-3, "stiffness": 5e4}
ALWAYS_INERTIA = {"kind": "unidirectional-inertia", "mass": 0.05, "acts": "always"}
LIGHT = {"mass": 1e-3, "damping": 1e-3, "velocity": -0.3}
GRIP = {"mass": 0.01, "damping": 1.0, "stiffness": 100.0}
HARD: dict[str, dict[str, Any]] = {
    "diverging": {"device": LIGHT, "wall": STIFF_WALL, "diverged_beyond": 1e6},
    "diverging late": {"device": LIGHT, "wall": STIFF_WALL, "clock": {"round_trip_delay": 0.0047}},
    "violent inertia": {"device": LIGHT, "dissipation": [ALWAYS_INERTIA], "diverged_beyond": 1e9},
    "coarse encoder": {"device": LIGHT, "hand": GRIP, "wall": STIFF_WALL, "encoder": {"resolution": 5e-3}},
    "stiff hand": {"device": LIGHT, "hand": {"stiffness": 1e7, "damping": 0.1}},
    "stiff overdamped hand": {"device": LIGHT, "hand": {"stiffness": 1e7, "damping": 1e3}},
    "crawling": {"device": LIGHT | {"velocity": 1e-9}, "hand": {"damping": 1e3, "stiffness": 1.0, "rest": -1e-3}},
    "heavy": {"device": {"mass": 1e6, "damping": 0.0, "velocity": -0.1}, "wall": STIFF_WALL},
    "feather": {
        "device": {"mass": 1e-6, "damping": 1e-6, "velocity": -0.1},
        "wall": {"position": 0.0, "stiffness": 1e-3},
    },
    "far from the origin": {"device": LIGHT | {"position": 0.9}, "hand": GRIP | {"rest": 0.9}},
    "shaken beyond the plant rate": {
        "device": LIGHT,
        "hand": GRIP | {"force": {"kind": "sine", "amplitude": 1e3, "frequency": 7321.0}},
    },
    "one step a tick": {
        "device": LIGHT,
        "hand": GRIP,
        "wall": STIFF_WALL,
        "clock": {"control_rate": 10_000, "round_trip_delay": 0.0007},
    },
}


@pytest.mark.parametrize("case", HARD)
def test_the_books_close_to_1e_12_in_every_hard_case(case):
    ran = run(scene(**HARD[case] | {"duration": 0.5}))
    assert ran.energy["moved_J"] > 0
    assert ran.relative_residual < 1e-12


def extreme(seed: int) -> Scene:
    """Orders of magnitude beyond any device, but in motion: millimetres at least, within half a metre of the origin."""
    rng = np.random.default_rng(seed)
    rate, n = int(rng.choice([1_000, 10_000, 50_000])), int(rng.choice([1, 2, 10]))
    maybe = lambda value: float(value) if rng.random() < 0.8 else 0.0  # noqa: E731
    mass = log_uniform(rng, 1e-3, 10)
    speed = float(rng.choice([-1, 1])) * log_uniform(rng, 0.05, 2)
    tables: dict[str, Any] = {
        "duration": 400 * n / rate,
        "diverged_beyond": float(rng.choice([1.0, 1e6])),
        "clock": {"plant_rate": rate, "control_rate": rate // n, "round_trip_delay": int(rng.integers(30)) / rate},
        "device": {"mass": mass, "damping": maybe(mass * log_uniform(rng, 1e-6, 1e4)), "velocity": speed},
        "wall": {"position": float(rng.choice([0, -1e-3, 0.1])), "stiffness": log_uniform(rng, 1, 1e6)},
        "hand": {
            "damping": maybe(mass * log_uniform(rng, 1e-6, 1e4)),
            "stiffness": maybe(log_uniform(rng, 1e-3, 1e6)),
            "rest": rng.uniform(-0.1, 0.1),
            "force": {"kind": "sine", "amplitude": log_uniform(rng, 1e-3, 100), "frequency": log_uniform(rng, 1, rate)},
        },
    }
    if rng.random() < 0.5:
        tables["encoder"] = {"resolution": log_uniform(rng, 1e-8, 1e-3)}
    if rng.random() < 0.5:
        tables["dissipation"] = [{"kind": "damping", "damping": log_uniform(rng, 1e-3, 100), "acts": "always"}]
    return scene(**tables)


@pytest.mark.parametrize("seed", [*range(8), *(pytest.param(s, marks=pytest.mark.slow) for s in range(8, 250))])
def test_the_books_close_to_1e_12_in_scenes_drawn_from_far_too_wide_a_range(seed):
    assert run(extreme(seed)).relative_residual < 1e-12


@pytest.mark.parametrize(("push", "mass"), [(1e-5, 69.0), (1e-4, 1.0), (1e-3, 30.0)])
def test_motion_of_picometres_far_from_the_origin_is_booked_beyond_the_last_bit_of_its_position(push, mass):
    """At 0.6 m a float knows ways to 1e-16 m, too little for books of a way of 1e-12 m; what rounding left helps."""
    device = {"mass": mass, "damping": 0.0, "position": 0.6}
    ran = run(scene(duration=0.01, device=device, hand={"force": {"kind": "constant", "value": push}}))
    assert 0 < np.ptp(ran.plant["x"]) < 1e-7
    assert ran.relative_residual < 1e-12
    assert push * np.spacing(0.6) > 1e-12 * ran.energy["moved_J"]  # what one last bit would be worth


WIDE = np.finfo(np.longdouble).eps < np.finfo(float).eps


@pytest.mark.skipif(not WIDE, reason="this machine has no float wider than 64 bits")
@pytest.mark.parametrize("damping", [1e3, 1e5, 1e7])
def test_a_damper_that_stops_the_device_within_a_ten_millionth_of_a_step_is_booked_too(damping, monkeypatch):
    """Heat is a form whose terms cancel in the ratio of step to time constant; its squares do not."""

    def term_by_term(factors, w):
        a, b, _, d, _, _ = factors
        return a * w[0] * w[0] + 2.0 * a * b * w[0] * w[1] + (a * b * b + d) * w[1] * w[1]

    stopped = scene(duration=0.1, device={"mass": 1e-4, "damping": damping, "velocity": 0.5})
    assert run(stopped).relative_residual < 1e-12
    monkeypatch.setattr(one_mass, "sum_squares", term_by_term)
    assert (run(stopped).relative_residual < 1e-12) == (damping < 1e4)
