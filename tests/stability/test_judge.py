"""Judgements: loops of which the end of the run alone would give the wrong word."""

from __future__ import annotations

from dataclasses import replace

import pytest

from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.file import load
from haploop.launch.stability.judge import judge, judge_scene
from haploop.launch.stability.looks import is_smooth
from haploop.protocol.scene.effects import Friction
from helpers.runs.judged import ended, found
from helpers.scenes import wild_loops
from helpers.scenes.least import scene
from helpers.scenes.pressed import PLAIN, THROWN, pressed
from helpers.scenes.unseen_loops import drawn


def word(**tables) -> str:
    finding = found(scene(**tables))
    return finding.word


def test_a_stable_wall_is_steady_and_one_beyond_its_limit_is_not():
    assert word(**pressed()) == "steady"
    assert word(**pressed(wall={"position": 0.0, "stiffness": 1100.0})) in ("growing", "limit-cycle")


def test_an_unstable_run_of_a_tenth_of_a_second_is_not_steady():
    assert word(**pressed(wall={"position": 0.0, "stiffness": 1100.0}, duration=0.1)) in ("growing", "limit-cycle")


def test_a_hand_that_trembles_at_a_stable_wall_is_no_limit_cycle():
    force = {"kind": "sine", "amplitude": 0.4, "frequency": 5.0, "offset": -1.0}
    assert word(**{**pressed(), "hand": {"force": force}}) == "steady"


def test_noise_of_the_sensor_is_no_limit_cycle():
    assert word(**pressed(noise={"deviation": 2e-5, "cutoff": 200.0})) == "steady"


def test_a_slow_decay_is_steady():
    """The width falls by e in 2 s: too slowly for the last half second to show."""
    tables = pressed(device={"mass": 0.5, "damping": 0.6}, wall={"position": 0.0, "stiffness": 200.0}, duration=1.0)
    finding = found(scene(**tables))
    assert finding.word == "steady"
    assert finding.rate_1_s == pytest.approx(-0.5, rel=0.1)  # -(b / 2m - K T / 4m), to first order in T


def test_the_chatter_of_a_coarse_encoder_is_a_limit_cycle_and_that_of_a_fine_one_is_not():
    coarse, fine = ({"resolution": resolution} for resolution in (1e-3, 1e-7))
    assert word(**pressed(encoder=coarse, wall={"position": 0.0, "stiffness": 800.0})) == "limit-cycle"
    assert word(**pressed(encoder=fine, wall={"position": 0.0, "stiffness": 800.0})) == "steady"


@pytest.mark.slow
def test_friction_that_holds_the_device_is_rest():
    assert word(**pressed(friction={"kinetic": 0.3})) == "steady"


@pytest.mark.slow
@pytest.mark.parametrize(("kinetic", "word", "blown"), [(0.043, "undecided", "swings on"), (0.17, "steady", "rests")])
def test_a_loop_that_friction_stops_after_a_push_but_not_after_a_blow_is_not_called_steady(kinetic, word, blown):
    """A loop of rho(M) > 1 by its map: friction of 2 % of the hold stops what 0.3 of it set off, but not what 3 do."""
    loop = drawn(7026)
    assert loop
    assert loop.rate_1_s > 0.0
    finding = found(replace(loop.scene, friction=Friction(kinetic=kinetic)))
    assert (finding.word, finding.blown) == (word, blown)
    assert finding.blow_N == pytest.approx(10.0 * finding.push_N)
    assert f"{finding.blow_N:.3g} N" in finding.sentence()


HELD = {
    "duration": 4.0,
    "clock": {"round_trip_delay": 0.001},
    "device": {"mass": 0.15, "damping": 0.3, "position": -0.00522},
    "friction": {"kinetic": 0.08},
    "encoder": {"resolution": 2e-5},
    "actuator": {"saturation": 8.0},
    "hand": {"mass": 0.01, "damping": 0.5, "stiffness": 10.0, "force": {"kind": "constant", "value": -0.6}},
    "wall": {"position": -0.005, "stiffness": 2500.0},
}


@pytest.mark.slow
@pytest.mark.parametrize("held_N", [-0.6, -0.62, -0.7])
def test_a_wall_that_friction_holds_until_it_is_tapped_is_not_called_steady(held_N):
    """A tap of 1.8 N for 10 ms sets it swinging by 1.6 mm for good; a blow into it of as much for 50 ms does not."""
    tap = {"kind": "trace", "time": [0.0, 1.0, 1.005, 1.01], "force": [held_N, held_N, held_N - 1.8, held_N]}
    at_rest, tapped = ({**HELD, "hand": {**HELD["hand"], "force": force}} for force in (
        {"kind": "constant", "value": held_N}, tap))  # fmt: skip
    assert word(**at_rest) == "undecided"
    assert word(**tapped) == "limit-cycle"


def test_a_loop_whose_run_swings_on_while_pushes_and_blows_end_the_swing_is_undecided():
    """Coarse counts, friction and a device thrown at the wall: 176 um at 70 Hz for as long as nobody touches it."""
    finding = found(scene(**THROWN))
    assert (finding.word, finding.blown, finding.left) == ("undecided", "rests", "swings on")
    assert finding.left_m == pytest.approx(176e-6, rel=0.02)
    assert "Not pushed, from where its run ended, it swings on, by 17" in finding.sentence()
    slower = found(scene(**{**THROWN, "device": {**THROWN["device"], "velocity": -0.2}}))
    assert (slower.word, slower.left) == ("steady", None), "a run that has come to rest is not watched once more"


def test_a_device_that_nobody_holds_at_the_wall_is_undecided():
    thrown = {"mass": 0.1, "damping": 0.0, "position": 0.01, "velocity": -0.1}
    finding = found(scene(**{**PLAIN, "device": thrown, "duration": 0.15}))
    assert (finding.word, finding.why) == ("undecided", "leaves the wall")


@pytest.mark.slow
def test_the_limit_cycles_of_the_paper_are_found_and_the_chaotic_one_is_told():
    regular, chaotic = (found(load(f"launch/scenes/fig6{letter}.toml")) for letter in "ac")
    assert (regular.word, regular.chaotic, chaotic.word, chaotic.chaotic) == ("limit-cycle", False, "limit-cycle", True)
    assert chaotic.spread_m > 0.05 * chaotic.width_m


def test_judging_leaves_the_run_as_it_was():
    """A plant and a controller that are judged go on to the bits of those that are not."""
    judged, other = ended(load("launch/scenes/fig6c.toml")), ended(load("launch/scenes/fig6c.toml"))
    judge(judged)
    ends = []
    for end in (judged, other):
        end.plant.run_until(end.plant.tick + 500, lambda _, samples, end=end: list(end.controller.answer(samples)))
        ends.append(end.plant.take_block()[2])
    assert ends[0] == ends[1]


def test_an_element_that_keeps_attributes_is_judged_on_a_copy_of_them():
    end = ended(load("launch/scenes/fig6b.toml"))
    element = end.controller.params.elements[0].element
    fork = end.controller.fork()
    assert fork.params.elements[0].element is not element


def test_an_element_that_fails_while_the_loop_is_watched_leaves_it_undecided(monkeypatch):
    end = ended(load("launch/scenes/fig6b.toml"))

    def fails(self, motion):
        raise ValueError("worn out")

    monkeypatch.setattr(type(end.controller.params.elements[0].element), "force", fails)
    finding = judge(end)
    assert (finding.word, finding.why) == ("undecided", "failed")
    assert "worn out" in finding.sentence()


def test_a_chatter_of_the_encoder_at_a_shipped_device_is_no_rest():
    """Beside 9 um at 26 Hz, unfelt, 3.8 um at 118 Hz: an independent loop swings so after 40 s, too."""
    finding = found(
        scene(
            clock={"round_trip_delay": 0.003},
            device={"mass": 0.05, "damping": 0.05, "position": 0.001184},
            hand={
                "mass": 0.204,
                "damping": 18.06,
                "stiffness": 271.7,
                "grip": {"stiffness": 769.9, "damping": 0.776},
                "force": {"kind": "minimum-jerk", "value": -2.509, "rise_time": 0.266},
            },
            wall={"position": 0.0, "stiffness": 1381.0},
            encoder={"resolution": 1e-5},
            dissipation=[{"kind": "bidirectional-inertia", "mass": 0.03524}],
            velocity={"cutoff": 284.8},
        )
    )
    assert finding.word != "steady"


@pytest.mark.slow
def test_what_dies_on_counts_that_still_move_is_no_rest():
    """A swing of 2.6 um at 18 Hz, unfelt, that dies within 2 s leaves 0.36 um at 305 Hz, which is felt."""
    loop = wild_loops.drawn(194)
    assert loop
    assert found(loop).word == "limit-cycle"


def test_a_swing_that_decays_by_an_element_that_switches_behind_an_encoder_is_not_known_to_die():
    """Unidirectional inertia of 19 g at an encoder of 0.14 um: in an independent loop 74 um remain for good."""
    plain = scene(**pressed(encoder={"resolution": 1.4e-7}))
    switching = scene(
        **pressed(encoder={"resolution": 1.4e-7}, dissipation=[{"kind": "unidirectional-inertia", "mass": 0.019}])
    )
    assert [is_smooth(each) for each in (plain, switching, replace(switching, encoder=None))] == [True, False, True]


def test_a_scene_without_noise_is_judged_the_same_with_its_noise_off():
    plain = scene(**pressed(noise={"deviation": 1e-12, "cutoff": 100.0}))
    finding, without = found(plain), found(replace(plain, noise=None))
    assert finding.word == without.word == "steady"


@pytest.mark.parametrize("duration", [0.45, 0.7, 1.2])
def test_contact_anywhere_in_the_window_is_contact_for_the_verdict_too(duration: float) -> None:
    """A device thrown at a wall leaves it early in the window, which is the second half of a shorter run."""
    from_s = max(duration - 0.5, 0.0) if duration >= 0.5 else duration / 2.0
    thrown = scene(
        duration=duration, device={"mass": 0.01, "damping": 0.0, "velocity": -0.1},
        wall={"position": -0.1 * (from_s + 0.03), "stiffness": 500.0}, run={"verdict": "pushed"},
    )  # fmt: skip
    summary = run_in_process(thrown, {})
    assert summary["window"]["from_s"] == pytest.approx(from_s)
    assert 0.8 < summary["window"]["outside_fraction"] < 1.0
    assert summary["verdict"] != "no-contact"
    assert judge_scene(thrown, {}).word == summary["verdict"]
