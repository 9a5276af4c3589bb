"""An effect at its neutral value changes nothing: not one bit, or no more than the rounding that is stated here.

Noise, accelerometer, actuator limits and estimators leave every bit as it is. Friction of no force, jitter of no length
and a loss that never happens have the motion of a chain in place of that of one mass: the same exact flow with its
terms added in another order, so that positions differ in their last digits, by 1e-10 of their size at most over these
runs, in which the wall multiplies what differs.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from helpers.runs.captured import run
from helpers.scenes.least import scene

HAND = {"mass": 0.01, "damping": 0.01, "stiffness": 10.0, "force": {"kind": "ramp", "value": -0.65, "rise_time": 0.1}}
PLAIN: dict[str, Any] = {
    "duration": 0.6,
    "clock": {"round_trip_delay": 0.0013},
    "hand": HAND,
    "encoder": {"resolution": 1e-5},
    "wall": {"position": -0.03, "stiffness": 80.0},
    "dissipation": [{"kind": "unidirectional-inertia", "mass": 0.005}],
}
FILTERED = {"velocity": {"cutoff": 200.0}, "acceleration": {"cutoff": 100.0}}
SENSED = {"acceleration": {"source": "accelerometer"}}
NO_BIT = {
    "noise": ({}, {"noise": {"deviation": 0.0, "cutoff": 100.0}}),
    "saturation": ({}, {"actuator": {"saturation": 1e6}}),
    "ideal accelerometer": (SENSED, {**SENSED, "accelerometer": {}}),
    "range": (SENSED, {**SENSED, "accelerometer": {"range": 1e6, "noise_density": 0.0, "bias": 0.0}}),
    "accelerometer that is not read": ({}, {"accelerometer": {"bandwidth": 100.0, "noise_density": 1.0}}),
    "window of one tick": (FILTERED, {**FILTERED, "velocity": {"cutoff": 200.0, "estimator": "window", "ticks": 1}}),
}
LAST_BITS = {
    "friction": {"friction": {"kinetic": 0.0}},
    "jitter": {"jitter": {"kind": "uniform", "most": 0.0}},
    "loss": {"loss": {"probability": 0.0}},
}


@pytest.mark.parametrize("name", NO_BIT)
def test_a_neutral_effect_leaves_every_bit_as_it_is(name):
    without, named = NO_BIT[name]
    hashes = [run(scene(**PLAIN | tables)).summary["trajectory_sha256"] for tables in (without, named)]
    assert hashes[0] == hashes[1]


@pytest.mark.parametrize("name", LAST_BITS)
def test_a_neutral_effect_that_needs_the_chain_changes_last_digits_only(name):
    """Without an encoder, whose counts would make a last digit a whole step."""
    smooth = {key: table for key, table in PLAIN.items() if key != "encoder"}
    plain, named = run(scene(**smooth)), run(scene(**smooth | LAST_BITS[name]))
    for column, size in (("x", 0.03), ("v", 0.3), ("force", 1.0)):
        np.testing.assert_allclose(named.plant[column], plain.plant[column], rtol=0.0, atol=1e-10 * size)


def test_an_effect_that_is_not_neutral_does_change_bits():
    noisy = {"noise": {"deviation": 1e-6, "cutoff": 100.0}}
    hashes = {run(scene(**PLAIN | tables)).summary["trajectory_sha256"] for tables in ({}, noisy)}
    assert len(hashes) == 2
