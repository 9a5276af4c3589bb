"""Judgements of many loops at once: each is what is found of the loop alone, to the last bit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from haploop.controller.dissipation import registry
from haploop.launch.batch.batch import Batch
from haploop.launch.runs.in_batch import run_batch, with_verdicts
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.file import load
from haploop.launch.stability.still_batch import StillBatch
from haploop.protocol.scene.effects import Friction, Noise
from haploop.protocol.scene.hand_force import Sine
from haploop.protocol.scene.paths import with_value
from haploop.protocol.scene.scene import Hand, Scene, by_window
from helpers.scenes.least import scene
from helpers.scenes.observed import observed
from helpers.scenes.pressed import THROWN


def shipped(name: str, stiffnesses: Sequence[float], **tables) -> list[Scene]:
    base = replace(load(f"launch/scenes/{name}.toml"), duration=1.0, **tables)
    return [replace(with_value(base, "wall.stiffness", k), seed=seed) for seed, k in enumerate(stiffnesses)]


def trembling() -> list[Scene]:
    """Hands that tremble, each at its force, at noisy walls of every kind."""
    sine = Sine(amplitude=0.1, frequency=4.0, offset=-0.65)
    noise = Noise(deviation=1e-6, cutoff=200.0)
    scenes = shipped("fig6b", np.geomspace(30.0, 2000.0, 3).tolist(), noise=noise)
    return [with_value(replace(each, hand=Hand(force=sine)), "hand.force.amplitude", 0.02 * i + 0.01)
            for i, each in enumerate(scenes)]  # fmt: skip


def rubbing() -> list[Scene]:
    return shipped("fig6a", [60.0, 400.0, 4000.0], friction=Friction(kinetic=0.02))


def friction_or_none() -> list[Scene]:
    scenes = shipped("fig6b", [150.0, 150.0, 2000.0], friction=Friction(kinetic=0.0))
    return [with_value(scenes[0], "friction.kinetic", 0.02), *scenes[1:]]


def devices() -> list[Scene]:
    """Premium 1.5s of other masses, of which friction alone holds some."""
    scenes = [replace(load("demo", ["event=[]"]), duration=1.0)] * 3
    return [
        with_value(with_value(scene, "device.mass", 0.05 + 0.02 * i), "wall.stiffness", 400.0 + 1000.0 * i)
        for i, scene in enumerate(scenes)
    ]


def swaying() -> list[Scene]:
    """Hands that sway from a hold of 1.15 N to one of 0.15 N, at walls of every kind."""
    return shipped("fig6a", [20.0, 30.0, 200.0], hand=Hand(force=Sine(amplitude=-0.5, frequency=0.75, offset=-0.65)))


def within_counts() -> list[Scene]:
    """A Premium 1.5 without friction that rests everywhere within a count, at one place of it, and nowhere."""
    base = replace(load("demo", ["event=[]"]), duration=0.8, friction=None)
    return [with_value(base, "wall.stiffness", k) for k in (200.0, 583.0, 850.0)]


def limited() -> list[Scene]:
    """Hands with a spring behind a Premium 1.5 whose actuator gives less than the walls command, and more."""
    base = replace(load("premium_press"), duration=0.8)
    return [with_value(base, "actuator.saturation", most_N) for most_N in (0.3, 2.0, 6.9)]


def thrown() -> list[Scene]:
    """Devices thrown at a wall behind coarse counts: the run of one swings on, though a push would end that."""
    base = scene(**THROWN, run={"verdict": "pushed"})
    return [with_value(base, "device.velocity", v) for v in (-0.3, -0.2, 0.0)]


FAMILIES: dict[str, Callable[[], list[Scene]]] = {
    "plain": lambda: shipped("fig6a", [20.0, 200.0, 3000.0]),
    "inertia": lambda: shipped("fig6c", [20.0, 60.0, 150.0]),
    "trembling": trembling,
    "friction": rubbing,
    "swaying": swaying,
    "counts": within_counts,
    "devices that rub": devices,
    "limited": limited,
    "thrown": thrown,
    "friction or none": friction_or_none,
    "observing": lambda: [observed(k, run={"verdict": "pushed"}) for k in (300.0, 2000.0)],
}


def told(result: Any) -> dict[str, Any] | None:
    """Word, sentence and numbers."""
    return result and {key: result[key] for key in ("verdict", "verdict_rule", "stability")}


@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES)
def test_a_loop_judged_among_others_has_the_words_and_bits_it_has_alone(family):
    scenes, kinds = FAMILIES[family](), registry()
    batch = Batch(scenes, kinds)
    batch.run()
    together = with_verdicts(batch, scenes)
    alone = [run_in_process(scene, kinds) for scene in scenes]
    assert [told(result) for result in together] == [told(result) for result in alone]
    assert len({result["verdict"] for result in alone}) > 1
    assert any(result["stability"].get("at_hardest") for result in alone) == (family == "swaying")
    assert any(result["stability"].get("deeper") == "swings on" for result in alone) == (family == "counts")
    assert any(result["stability"].get("frictionless") for result in alone) == (
        family in ("friction", "friction or none", "devices that rub", "thrown")
    )
    assert any(result["stability"].get("left") == "swings on" for result in alone) == (family == "thrown")


def test_where_all_loops_that_remember_are_told_at_once_nothing_goes_on():
    batch = Batch([replace(observed(k), duration=0.02) for k in (1500.0, 2000.0)], registry())
    batch.run()
    copies = StillBatch(batch.end([0, 1]), np.arange(2), np.full(2, -2.0), np.full(2, -0.6))
    assert copies.go_to(0.01) == []
    copies.keep(np.zeros(2, bool))
    assert copies.go_to(0.02) == []
    assert not len(copies.copy)


@pytest.mark.slow
def test_a_scene_may_ask_for_the_cheap_verdict_and_others_of_its_batch_are_judged_all_the_same():
    pushed = shipped("fig6a", [20.0, 80.0, 200.0, 300.0])
    mixed = [by_window(scene) if index % 2 else scene for index, scene in enumerate(pushed)]
    results = run_batch(mixed, registry(), fewest=2)
    assert ["stability" in result for result in results] == [True, False, True, False]
    assert results[::2] == run_batch(pushed[::2], registry(), fewest=2)


def test_one_loop_that_is_left_of_its_batch_is_judged_alone():
    """All others leave the limit."""
    scenes = [replace(scene, diverged_beyond=0.05) for scene in shipped("fig6a", [20.0, 3000.0, 4000.0])]
    results = run_batch(scenes, registry(), fewest=2)
    assert [result["verdict"] for result in results][1:] == ["diverged", "diverged"]
    assert results[0]["stability"] == run_in_process(scenes[0], registry())["stability"]
