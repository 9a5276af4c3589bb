"""The cases a wall has to bear: holds, corners, assumed numbers, the attack."""

import numpy as np
import pytest

from haploop.launch.scene.bundled import bundled
from haploop.launch.scene.file import load
from haploop.protocol.scene.paths import value_at
from haploop.tools.advise.advice import reach
from haploop.tools.advise.subject import assumptions
from haploop.tools.advise.walls.cases import (
    HOLDS,
    Case,
    as_described,
    attack,
    every_case,
    hold_N,
    make_loop,
    ranges,
    scale_quantities,
    slowness,
)  # fmt: skip
from helpers.scenes.least import scene
from helpers.scenes.presets import SCENES, loop_of


def test_the_hold_of_a_scene_is_what_its_wall_bears_when_the_hands_own_spring_has_taken_its_part():
    fig6a = load(SCENES / "fig6a.toml")  # -0.65 N, of which 10 N/m take 0.6 N to the wall at -60 mm
    assert hold_N(make_loop(fig6a, has_task=True)) == pytest.approx(0.05)
    assert hold_N(make_loop(fig6a, has_task=False)) == 1.0
    assert hold_N(loop_of("touch")) == pytest.approx(0.3 * 3.3)


def test_a_late_loop_is_watched_for_sixty_round_trips():
    late = loop_of("touch", "clock.round_trip_delay=0.2")
    assert slowness(late) * 2.75 == pytest.approx(12.0, rel=0.02)
    assert Case(1.0).scene(late).duration >= 12.0


def test_every_corner_takes_every_quantity_both_ways_and_the_attack_has_other_cases():
    of = ranges(loop_of("premium15"))
    assert len(every_case(of)) == (1 + 2**4) * len(HOLDS)
    assert len({case.corner for case in attack(of)}) == 1 + 2**4
    assert not set(attack(of)) & set(every_case(of))
    assert len(ranges(loop_of("premium15", "clock.round_trip_delay=0.002"))) == 5


def test_of_many_corners_the_search_takes_32_in_which_no_two_quantities_go_together_and_the_attack_takes_all():
    loop = loop_of("premium15_cable")
    of = ranges(loop, [key.key for key in assumptions(bundled("devices")["premium15_cable"])])
    corners = {case.corner for case in every_case(of)} - {()}
    signs = np.array([[factor > 1.0 for _, factor in one] for one in corners]) * 2.0 - 1.0
    assert signs.shape == (32, len(of))
    assert np.array_equal(signs.T @ signs, 32.0 * np.eye(len(of)))
    assert len({case.corner for case in attack(of)}) == 1 + 2 ** len(of)


def test_an_assumed_number_is_taken_half_and_double_and_not_a_fifth_off_with_its_quantity_as_well():
    loop = loop_of("omega3")
    of = ranges(loop, ["device.mass", "friction.kinetic"])
    assert "device mass" not in of
    assert of["device.mass"] == of["friction.kinetic"] == (0.5, 2.0)
    cable = scale_quantities(loop_of("premium15_cable"), {"device mass": 1.2, "transmission.motor_mass": 0.5})
    assert value_at(cable, "device.mass") == pytest.approx(1.2 * 0.0496)
    assert value_at(cable, "transmission.motor_mass") == pytest.approx(0.5 * 0.0029)


def test_a_measured_cable_is_a_corner_and_what_no_case_varies_is_told():
    loop = loop_of("premium15_cable")
    assert ranges(loop)["cable stiffness"] == (0.8, 1.2)
    assert as_described(loop, ranges(loop))[:2] == ("friction", "cable damping")
    assumed = ranges(loop, ["friction.kinetic", "transmission.stiffness"])
    assert "cable stiffness" not in assumed
    assert "friction" not in as_described(loop, assumed)
    words = reach(assumed, as_described(loop, assumed))
    assert words.startswith("Not varied: cable damping, motor damping, encoder, ")
    assert words.endswith("Halved and doubled: friction.kinetic, transmission.stiffness.")


def test_a_delay_a_fifth_more_is_rounded_to_whole_steps_and_never_to_what_it_was():
    late = scene(clock={"round_trip_delay": 0.002}, wall={"position": 0.0, "stiffness": 1.0})
    assert scale_quantities(late, {"delay": 1.2}).clock.round_trip_delay == pytest.approx(0.0024)
    short = scene(clock={"round_trip_delay": 0.0001}, wall={"position": 0.0, "stiffness": 1.0})
    assert [scale_quantities(short, {"delay": f}).clock.round_trip_delay for f in (0.8, 1.2)] == [0.0, 0.0002]


def test_the_grip_is_scaled_with_the_hand_and_the_motor_with_the_device():
    cable = loop_of("premium15_cable")
    heavy = scale_quantities(cable, {"device mass": 1.2, "hand stiffness": 0.8})
    assert value_at(heavy, "transmission.motor_mass") == pytest.approx(1.2 * 0.0029)
    assert value_at(heavy, "hand.grip.stiffness") == pytest.approx(0.8 * 552.4)


def test_an_assumed_delay_is_taken_once_and_an_assumed_start_not_at_all_since_every_case_has_its_own():
    assert [each.key for each in assumptions(SCENES / "demo.toml")] == ["clock.round_trip_delay"]
    of = ranges(loop_of("premium15", "clock.round_trip_delay=0.002"), ["clock.round_trip_delay"])
    assert of["clock.round_trip_delay"] == (0.5, 2.0)
    assert "delay" not in of
