"""A force that is no number: no effect between element and device hides it, and no device is ever given one."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from haploop.controller.dissipation import Element, Motion
from helpers.runs.captured import run
from helpers.scenes.effect_tables import EFFECTS, slowly, tap
from helpers.scenes.least import KINDS


class Broken(Element):
    """A force that is no number, from the fiftieth tick on."""

    kind = "broken"
    value = math.nan

    def __post_init__(self) -> None:
        self.tick = -1

    def force(self, motion: Motion) -> float:
        self.tick += 1
        return self.value if self.tick >= 50 else 0.0


BEHIND: dict[str, dict[str, Any]] = {
    "saturation": {"actuator": {"saturation": 1.0}},
    "resolution": {"actuator": {"resolution": 0.01}},
    "bandwidth": {"actuator": {"bandwidth": 100.0}},
    "friction": {"friction": {"kinetic": 1e6}},
    "jitter": {"jitter": {"kind": "uniform", "most": 0.002}},
    "loss": {"loss": {"probability": 0.5}},
    "cable": EFFECTS["transmission"],
}


@pytest.mark.parametrize("value", [math.nan, -math.inf, *slowly([math.inf])])
@pytest.mark.parametrize("effect", BEHIND)
def test_no_effect_hides_a_force_that_is_no_finite_number(effect, value, monkeypatch):
    monkeypatch.setattr(Broken, "value", value)
    monkeypatch.setitem(KINDS, "broken", Broken)
    broken = tap((), **BEHIND[effect] | {"dissipation": [{"kind": "broken", "acts": "always"}]})
    ran = run(broken)
    assert ran.summary["ended"] == "failed"
    assert f"element 0 (broken) gave {value} at tick 50" in ran.summary["why"]
    assert ran.summary["verdict"] == "undecided"
    assert all(np.isfinite(column).all() for column in ran.plant.values()), "no device was ever given such a force"


def test_a_force_that_is_no_number_and_never_arrives_leaves_the_balance_as_it_is(monkeypatch):
    """The element is to blame all the same; what it asked for is in no true book."""
    monkeypatch.setitem(KINDS, "broken", Broken)
    ran = run(tap((), loss={"probability": 1.0}, dissipation=[{"kind": "broken", "acts": "always"}]))
    assert ran.summary["ended"] == "failed"
    assert ran.energy["residual_J"] <= 1e-12 * ran.energy["moved_J"]
    assert (ran.energy["elements"][0]["sampled_J"], ran.energy["elements"][0]["true_J"]) == (None, 0.0)
