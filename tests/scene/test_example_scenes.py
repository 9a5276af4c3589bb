"""The scenes that come with haploop say what they claim to say."""

from dataclasses import replace
from pathlib import Path

import pytest

from haploop.launch.scene.file import load
from haploop.protocol.scene.scene import Clock, ElementTable, Wall

SCENES = Path(__file__).parents[2] / "launch/scenes"


@pytest.mark.parametrize(
    ("name", "stiffness", "elements"),
    [
        ("fig6a", 80.0, []),
        ("fig6b", 150.0, [ElementTable(name="damping", parameters={"damping": 0.8})]),
        ("fig6c", 150.0, [ElementTable(name="unidirectional-inertia", parameters={"mass": 0.01})]),
    ],
)
def test_the_figure_6_scenes_hold_the_numbers_of_the_paper(name, stiffness, elements):
    """Choi et al. 2022, section V.A: parameters of device and hand, and the three cases."""
    scene = load(SCENES / f"{name}.toml")
    assert (scene.device.mass, scene.device.damping) == (0.01, 0.1)
    assert scene.hand is not None
    assert (scene.hand.mass, scene.hand.damping, scene.hand.stiffness) == (0.01, 0.01, 10.0)
    assert scene.clock == Clock(plant_rate=10_000, control_rate=1_000, round_trip_delay=0.002, integrator="exact")
    assert scene.wall == Wall(position=-0.06, stiffness=stiffness, occupies="below")
    assert scene.dissipation == (*elements,)


def test_the_swap_scene_is_figure_6b_until_the_swap_and_6c_from_then_on():
    swap, before, after = (load(SCENES / f"{name}.toml") for name in ("swap", "fig6b", "fig6c"))
    [event] = swap.event
    assert replace(swap, title="", event=()) == replace(before, title="")
    assert (event.swap,) == after.dissipation


def test_every_assumption_about_the_paper_is_marked():
    text = (SCENES / "fig6a.toml").read_text()
    assert text.count("ASSUMPTION") >= 4
