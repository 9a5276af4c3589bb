"""An estimator from outside the package: a class and a line in the register, and it works in every way of running."""

from __future__ import annotations

import importlib.util
from dataclasses import replace

import numpy as np
import pytest

from haploop.controller.estimators.choose import ESTIMATORS, estimator_class
from haploop.protocol.scene.estimators import Acceleration, Velocity
from haploop.protocol.scene.scene import Scene
from haploop.tools.linear.linearity import LinearController
from helpers.outside.haploop_outside import AlphaBeta
from helpers.runs.batches import alone, pressed, together
from helpers.runs.estimates import T, estimates, floats
from helpers.scenes.least import KINDS

ALPHA, BETA = 0.4, 0.1
TABLE = {"estimator": "alpha-beta", "alpha": ALPHA, "beta": BETA}


@pytest.fixture(autouse=True)
def registered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(ESTIMATORS, "alpha-beta", AlphaBeta)


def test_it_is_found_by_its_name_and_others_are_not() -> None:
    assert estimator_class("alpha-beta") is AlphaBeta
    with pytest.raises(KeyError):
        estimator_class("gamma-delta")


def test_it_follows_a_constant_velocity_and_lags_an_acceleration_as_its_gains_say() -> None:
    """The steady error of v under a unit acceleration is (alpha / beta - 1) T."""
    t = np.arange(400) * T
    v, a = estimates(floats(0.3 * t), velocity=TABLE)
    assert (v[-1], a[-1]) == (pytest.approx(0.3, rel=1e-9), pytest.approx(0.0, abs=1e-6))
    v, _ = estimates(floats(t * t / 2), velocity=TABLE)
    assert t[-1] - v[-1] == pytest.approx((ALPHA / BETA - 0.5) * T, rel=1e-6)


def scenes() -> list[Scene]:
    made = pressed(duration=0.1)
    tables = [Velocity.from_dict({**TABLE, "cutoff": 300.0, "beta": beta}) for beta in (0.05, 0.1, 0.15)]
    return [replace(made, velocity=table, acceleration=Acceleration()) for table in tables]


def test_members_of_a_batch_have_the_bits_of_each_alone() -> None:
    assert together(scenes()) == [alone(scene) for scene in scenes()]


@pytest.mark.slow
@pytest.mark.skipif(not importlib.util.find_spec("jax"), reason="needs jax")
def test_a_compiled_batch_with_an_estimator_of_a_package_agrees_with_each_run_alone() -> None:
    from haploop.launch.runs.in_jax import compiling
    from helpers.runs.compiled import agree, compiled

    compiled(scenes())
    before = compiling()[0]
    for result, exact in zip(compiled(scenes()), map(alone, scenes()), strict=True):
        del exact["trajectory_sha256"]
        assert agree(result, exact)
    assert compiling()[0] == before > 0


def test_its_memory_is_found_by_unit_vectors() -> None:
    """The poles of the filter are the roots of z^2 - (2 - alpha - beta) z + 1 - alpha."""
    made = replace(pressed(), velocity=Velocity.from_dict(TABLE))
    moved, _ = LinearController.from_scene(made, KINDS)
    poles = np.sort_complex(np.linalg.eigvals(moved[:, : len(moved)]))
    assert poles == pytest.approx(np.sort_complex(np.roots([1.0, ALPHA + BETA - 2.0, 1.0 - ALPHA])), abs=1e-9)
