"""A step allocates nothing that grows."""

from __future__ import annotations

import gc
import tracemalloc
from pathlib import Path

import pytest

from haploop.controller.controller import Controller
from haploop.controller.dissipation import registry
from haploop.launch.scene.file import load
from haploop.plant.plant import Plant
from haploop.protocol.ticks import Timebase

SCENES = Path(__file__).parents[3] / "launch/scenes"


@pytest.mark.slow
def test_plant_and_controller_hold_no_more_in_their_sixth_thousand_ticks_than_in_their_third():
    """Blocks are taken as a node takes them; the responses to the hand's force, kept for a while, come and go."""
    scene = load(SCENES / "all_effects.toml", ["duration=60", "diverged_beyond=1e9"])
    time, kinds = Timebase.from_scene(scene), registry()
    plant, controller = Plant(scene, time), Controller(scene, time, kinds)
    held = []
    tracemalloc.start()
    try:
        while plant.tick < 6_000:
            plant.run_until(plant.tick + 200, lambda _, samples: controller.answer(samples))
            plant.take_block()
            controller.recorder.take()
            gc.collect()
            held.append(tracemalloc.get_traced_memory()[0])
    finally:
        tracemalloc.stop()
    assert max(held[25:]) <= max(held[10:15]) + 50_000
