"""Size of the push of a loop: a share of what its hand presses the wall with, its spring counted."""

from __future__ import annotations

from dataclasses import replace

import pytest

from haploop.controller.dissipation import registry
from haploop.launch.runs.in_batch import run_batch
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.file import load
from haploop.launch.stability.looks import push_of
from haploop.launch.stability.still_hand import harder_hold
from haploop.protocol.scene.hand_force import Sine
from haploop.protocol.scene.scene import Hand
from haploop.protocol.ticks import Timebase
from helpers.live.launched import SCENES
from helpers.scenes.least import scene
from helpers.scenes.pressed import pressed


@pytest.mark.slow
def test_a_hand_that_presses_by_the_rest_position_of_its_spring_alone_is_pushed_as_hard_as_it_presses():
    """It rests, held by 0.15 N of friction, under 1.5 N, and swings on after a blow, as under a constant force of that.

    A push of 0.3 times a force of 0 N moved nothing, and that was called steady.
    """
    demo = load(SCENES / "demo.toml", [
        "event=[]", "duration=2", "device.velocity=0", "device.position=-0.0024", "friction.kinetic=0.15",
        "dissipation.0.kind=damping", "dissipation.0.damping=1", "hand.force.value=0", "hand.rest=-0.0165",
    ], registry())  # fmt: skip
    summary = run_in_process(demo, registry())
    assert demo.hand
    assert demo.wall
    press_N = demo.hand.stiffness * (demo.wall.position - demo.hand.rest)
    assert (summary["verdict"], summary["stability"]["blown"]) == ("undecided", "swings on")
    assert summary["stability"]["push_N"] == pytest.approx(0.3 * press_N)
    assert run_batch([demo, demo], registry())[0]["verdict"] == "undecided"


def test_a_hand_that_moves_by_rounding_alone_has_no_harder_hold():
    hand = Hand(stiffness=50.0, rest=-2.6e-3, force=Sine(amplitude=1e-15, frequency=5.0))
    of = replace(scene(**pressed()), hand=hand)
    assert of.wall
    time = Timebase.from_scene(of)
    assert harder_hold(of, time, time.ticks, 0.0, of.wall.position) is None
    assert push_of(0.0, hand, of.wall.position) == pytest.approx(0.3 * 50.0 * (-2.6e-3 - of.wall.position))


@pytest.mark.slow
def test_a_wall_that_an_event_moved_is_where_the_hand_presses_it():
    """The spring of its hand is stretched half as far there."""
    of = load(SCENES / "demo.toml", [
        'event=[{at=0.5, set={"wall.position"="-8.3 mm"}}]', "duration=1", "hand.force.value=0", "hand.rest=-0.0166",
        "hand.stiffness=100",
    ], registry())  # fmt: skip
    assert of.wall
    assert of.wall.position > -0.005
    pushes_N = [result["stability"]["push_N"] for result in run_batch([of, of], registry(), fewest=2)]
    assert pushes_N == pytest.approx([0.3 * 100.0 * 0.0083] * 2)
    assert run_in_process(of, registry())["stability"]["push_N"] == pushes_N[0]
