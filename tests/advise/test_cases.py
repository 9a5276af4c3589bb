"""The cases a wall has to bear: holds, corners, assumed numbers, the attack."""

import numpy as np
import pytest

from haploop.launch.scene.bundled import bundled
from haploop.launch.scene.file import load
from haploop.protocol.scene.paths import value_at
from haploop.tools.advise.advice import reach
from haploop.tools.advise.subject import assumptions
from haploop.tools.advise.walls.cases import HOLDS, Case, attack, every_case, hold_N, make_loop, slowness
from haploop.tools.advise.walls.corners import as_built, corner, corner_words, design, flipped, ranges, scale_quantities
from helpers.scenes.least import scene
from helpers.scenes.presets import SCENES, loop_of


def test_the_hold_of_a_scene_is_what_its_wall_bears_when_the_hands_own_spring_has_taken_its_part():
    fig6a = load(SCENES / "fig6a.toml")  # -0.65 N, of which 10 N/m take 0.6 N to the wall at -60 mm
    assert hold_N(make_loop(fig6a, has_task=True)) == pytest.approx(0.05)
    assert hold_N(make_loop(fig6a, has_task=False)) == 1.0
    assert hold_N(loop_of("touch")) == pytest.approx(0.2 * 3.3)


def test_a_late_loop_is_watched_for_sixty_round_trips():
    late = loop_of("touch", "clock.round_trip_delay=0.2")
    assert slowness(late) * 2.75 == pytest.approx(12.0, rel=0.02)
    assert Case(1.0).scene(late).duration >= 12.0


def test_every_corner_takes_every_quantity_both_ways_and_the_attack_has_other_cases_and_points_within():
    of = ranges(loop_of("premium15"))
    assert list(of) == ["device mass", "hand mass", "hand damping", "hand stiffness", "friction", "device damping",
                        "actuator force"]  # fmt: skip
    attacks = attack(of)
    assert not set(attacks) & set(every_case(of))
    assert {corner(of, number) for number in range(2**7)} <= {case.corner for case in attacks}
    within = [case for case in attacks if case.corner and all(f not in (0.8, 1.2) for _, f in case.corner)]
    assert len(within) == 160
    assert all(0.8 < factor < 1.2 for case in within for _, factor in case.corner)
    assert len(ranges(loop_of("premium15", "clock.round_trip_delay=0.002"))) == 8


def test_of_many_corners_the_search_takes_32_in_which_no_two_quantities_go_together_and_those_known_to_be_hardest():
    loop = loop_of("premium15_cable")
    of = ranges(loop, [key.key for key in assumptions(bundled("devices")["premium15_cable"])])
    corners = set(design(of)) - {()}
    signs = np.array([[factor > 1.0 for _, factor in one] for one in corners]) * 2.0 - 1.0
    assert signs.shape == (32, len(of))
    assert np.array_equal(signs.T @ signs, 32.0 * np.eye(len(of)))
    hard = next(one for one in (corner(of, number) for number in range(2 ** len(of))) if one not in corners)
    assert len(every_case(of, hardest=[hard])) == (1 + 32 + 1) * len(HOLDS)
    assert sum(case.corner == hard for case in attack(of, [hard])) == sum(not case.corner for case in attack(of))


def test_of_more_quantities_than_the_attack_has_corners_for_each_is_taken_both_ways():
    of = {str(number): (0.8, 1.2) for number in range(13)}
    for name in of:
        assert {dict(case.corner)[name] for case in attack(of) if case.corner} >= {0.8, 1.2}
    assert len(attack(of)) < 700


def test_an_assumed_number_is_taken_half_and_double_and_not_a_fifth_off_with_its_quantity_as_well():
    loop = loop_of("omega3")
    of = ranges(loop, ["device.mass", "friction.kinetic"])
    assert not {"device mass", "friction"} & set(of)
    assert of["device.mass"] == of["friction.kinetic"] == (0.5, 2.0)
    cable = scale_quantities(loop_of("premium15_cable"), {"device mass": 1.2, "transmission.motor_mass": 0.5})
    assert value_at(cable, "device.mass") == pytest.approx(1.2 * 0.0496)
    assert value_at(cable, "transmission.motor_mass") == pytest.approx(0.5 * 0.0029)


def test_all_that_is_measured_is_a_corner_and_what_no_case_varies_is_told():
    more = ("actuator.bandwidth=1000", "noise.deviation=1e-6", "noise.cutoff=200", "clock.round_trip_delay=0.001")
    loop = loop_of("premium15_cable", *more)
    of = ranges(loop)
    assert set(of.values()) == {(0.8, 1.2)}
    assert set(of) == {"delay", "device mass", "hand mass", "hand damping", "hand stiffness", "cable stiffness",
                       "friction", "device damping", "cable damping", "actuator bandwidth", "actuator force",
                       "noise"}  # fmt: skip
    assert as_built(loop, of) == ("encoder count", "accelerometer", "ticks")
    assumed = ranges(loop, ["friction.kinetic", "transmission.stiffness"])
    assert not {"cable stiffness", "friction"} & set(assumed)
    words = reach(assumed, as_built(loop, assumed))
    assert words.startswith("Not varied, as built: encoder count, accelerometer, ticks. Varied by 20 %: delay, ")
    assert words.endswith("Halved and doubled: friction, cable stiffness.")


def test_what_belongs_to_a_quantity_goes_with_it_and_a_device_breaks_away_at_no_less_than_it_slides_at():
    loop = loop_of("premium15_cable", "friction.breakaway=0.06")
    low = scale_quantities(loop, {"friction": 0.8, "device damping": 1.2})
    found = [value_at(low, key) for key in ("friction.kinetic", "friction.breakaway", "transmission.motor_damping")]
    assert found == pytest.approx([0.8 * 0.048, 0.8 * 0.06, 1.2 * 0.0114])
    assert value_at(scale_quantities(loop, {"friction.kinetic": 2.0}), "friction.breakaway") == pytest.approx(0.096)


def test_a_corner_is_told_in_plain_words_and_its_neighbours_differ_from_it_in_one_quantity():
    of = ranges(loop_of("omega3"), ["device.mass"])
    some = corner(of, 0)
    told = "halved: device mass; 20 % less: hand mass, hand damping, hand stiffness, friction, device damping"
    assert corner_words(some).startswith(told)
    assert Case(3.0, (("friction", 1.07), ("delay", 1.0))).words == "hold x 3, within: friction +7 %"
    near = flipped(of, some)
    assert len(near) == len(of)
    assert all(sum(a != b for a, b in zip(one, some, strict=True)) == 1 for one in near)


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
