"""Provisos told in the same breath as ``steady``: friction that holds, one hold of many, a force that ripples."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from haploop.controller.dissipation import registry
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.runs.loaded_scene import load
from haploop.launch.scene.bundled import bundled
from haploop.launch.stability import looks
from haploop.launch.stability.decide import decide
from haploop.launch.stability.finding import Finding
from haploop.launch.stability.judge import judge, judge_scene
from haploop.launch.stability.looks import LOOKS_S
from haploop.launch.stability.swing import Pushed, Swing, measure
from haploop.protocol.scene.effects import Friction
from helpers.runs.judged import ended, found
from helpers.scenes import wild_loops
from helpers.scenes.least import KINDS, scene
from helpers.scenes.pressed import pressed
from helpers.scenes.unseen_loops import drawn


def with_friction_asked(of) -> Finding:
    return judge(ended(of), LOOKS_S, thorough=True)


@pytest.mark.slow
def test_a_wall_beyond_its_limit_that_friction_holds_is_told_apart_from_one_that_rests_without():
    """The first is beyond rho(M) = 1, the second far below."""
    loop = drawn(7026)
    assert loop
    assert loop.rate_1_s > 0.0
    held = with_friction_asked(replace(loop.scene, friction=Friction(kinetic=0.17)))
    stable = with_friction_asked(scene(**pressed(friction={"kinetic": 0.02})))
    assert (held.word, held.frictionless, held.entries()["stability"]["provisos"]) == (
        "steady", "swings on", ["only friction holds it"])  # fmt: skip
    assert (stable.word, stable.frictionless, stable.entries()["stability"]["provisos"]) == ("steady", "rests", [])


@pytest.mark.slow
def test_a_wall_is_steady_that_a_blow_takes_the_device_off_where_friction_keeps_it():
    """The hold of 0.3 N does not overcome 0.4 N of friction; nothing moves after the first look."""
    finding = found(scene(**pressed(
        hand={"force": {"kind": "constant", "value": -0.3}}, friction={"kinetic": 0.4},
        device={"mass": 0.1, "damping": 0.0, "position": 1e-4, "velocity": -0.2})))  # fmt: skip
    assert (finding.word, finding.blown, finding.watched_s) == ("steady", "rests off the wall", LOOKS_S[0])


@pytest.mark.slow
@pytest.mark.parametrize(("watched_s", "needs_s", "told"), [
    (16.0, 1e5, "haploop judge, which watches for up to 64 s, might show it"),
    (16.0, 40.0, "haploop judge, which watches for up to 64 s, might show it"),
    (64.0, 200.0, "watching for about 200 s might show it"),
    (64.0, 1e5, "a much longer run might show it"),
])  # fmt: skip
def test_an_undecided_loop_is_told_what_may_tell_more(watched_s, needs_s, told):
    """Of a loop that haploop judge decided in 32 s it was said that no run of less than an hour might show it."""
    of = Finding("undecided", "too slow", width_m=1e-3, frequency_Hz=50.0, watched_s=watched_s, needs_s=needs_s)
    assert told in of.sentence()


def test_the_settling_time_is_that_of_the_second_order_loop():
    """x decays as e^(-rate t): 5 % are passed at ln(20) / rate, but for half a period (b = 3 N s/m of the device)."""
    tables = pressed(device={"mass": 0.5, "damping": 3.0}, wall={"position": 0.0, "stiffness": 300.0})
    finding = found(scene(**tables))
    rate, half_s = 3.0 / (2 * 0.5) - 300.0 * 1e-3 / (4 * 0.5), math.pi / math.sqrt(300.0 / 0.5)
    assert finding.settles_s == pytest.approx(math.log(20.0) / rate, abs=half_s)


@pytest.mark.parametrize(("force", "said"), [
    ({"kind": "constant", "value": -1.0}, []),
    ({"kind": "sine", "amplitude": 0.4, "frequency": 5.0, "offset": -1.0}, ["tried at only some holds of its hand"]),
])  # fmt: skip
def test_the_word_for_a_hand_that_moves_is_one_of_some_holds(force, said):
    of = scene(**{**pressed(), "hand": {"force": force}})
    beside = ["the hand's motion"] if said else []
    assert found(of).entries(1e-4, beside)["stability"]["provisos"] == said


@pytest.mark.parametrize(("hold_N", "ripple_N", "is_said"), [(0.5, 0.04, False), (0.5, 0.06, True), (5.0, 0.12, True),
                                                             (5.0, 0.08, False), (1.0, None, False)])  # fmt: skip
def test_a_force_that_ripples_by_a_tenth_of_the_hold_or_of_a_newton_is_told_beside_the_word(hold_N, ripple_N, is_said):
    for word, why in (("steady", "rest"), ("limit-cycle", "lasts")):
        said = Finding(word, why, push_N=0.3 * hold_N, felt=True).entries(ripple_N=ripple_N)["stability"]["provisos"]
        assert said == ["its force ripples"] * (is_said and word == "steady")


@pytest.mark.parametrize(
    ("free", "told"),
    [(Finding("limit-cycle", "lasts", width_m=1.2e-5), "a swing of 12.0 µm peak to peak would last."),
     (Finding("growing", "grows", width_m=1.0), "its swing would grow."),
     (Finding("steady", "rest"), "Held like this, it would also rest without its friction.")],
)  # fmt: skip
def test_a_small_swing_by_counts_is_told_from_a_growing_one_of_a_loop_that_friction_holds(free, told):
    found = Finding("steady", "rest", 0.3, 1.0, settles_s=0.1).without_friction(free)
    assert found.sentence().endswith(told)
    assert found.frictionless_m == (free.width_m if free.word == "limit-cycle" else None)


@pytest.mark.parametrize(
    ("why", "felt", "is_said"), [("decays", True, True), ("decays", False, False), ("rest", True, False)]
)
def test_a_swing_that_is_still_felt_when_it_was_last_looked_at_is_told_beside_steady(why, felt, is_said):
    found = Finding("steady", why, 0.3, 16.0, -0.05, 0.001, 12.0, 5e-3, felt=felt, settles_s=1.0)
    assert found.entries()["stability"]["provisos"] == ["its swing dies slowly"] * is_said
    assert ("changing by -0.05 +- 0.001 1/s" in found.sentence()) == (why == "decays")


@pytest.mark.slow
def test_what_a_window_shows_of_a_loop_that_was_changed_within_it_is_no_proviso_of_the_loop_judged():
    for at_s, changed_s in ((1.99, 1.99), (0.5, None)):
        event = f"event=[{{at={at_s}, set={{'wall.stiffness'=100}}}}]"
        summary = run_in_process(load(bundled("scenes")["demo"], [event]).scene, registry())
        assert summary["window"]["changed_s"] == changed_s
        assert (summary["verdict"], summary["stability"]["provisos"]) == ("steady", [])


@pytest.mark.slow
def test_a_loop_without_friction_that_noise_moves_by_as_much_as_a_hand_feels_says_so_beside_the_word():
    """0.1 kg, 2 N s/m, 2 N/mm, held by 5 N: at rest without the noise of 30 µm, which moves it by 60 µm."""
    of = scene(**pressed(
        device={"mass": 0.1, "damping": 2.0}, wall={"position": 0.0, "stiffness": 2000.0}, encoder={"resolution": 5e-6},
        noise={"deviation": 3e-5, "cutoff": 200.0}, hand={"force": {"kind": "constant", "value": -5.0}},
        run={"verdict": "pushed"}))  # fmt: skip
    summary = run_in_process(of, registry())
    assert summary["verdict"] == "steady"
    assert {"noise shakes it", "its force ripples"} <= {*summary["stability"]["provisos"]}


@pytest.mark.parametrize(("most_N", "depth_m", "is_said"), [(0.3, (1.0 - 0.3) / 200.0, True), (5.0, 1 / 700.0, False)])
def test_a_loop_whose_actuator_is_at_its_limit_where_it_rests_says_so_beside_the_word(most_N, depth_m, is_said):
    """A hand of 1 N and 200 N/m: its spring takes what an actuator of 0.3 N does not give; a wall of 500 N/m else."""
    of = scene(**pressed(
        device={"mass": 0.1, "damping": 5.0}, actuator={"saturation": most_N},
        hand={"force": {"kind": "constant", "value": -1.0}, "stiffness": 200.0, "rest": 0.0}))  # fmt: skip
    end = ended(of)
    finding = judge(end)
    assert end.plant.state()["x"] == pytest.approx(-depth_m, rel=1e-3)
    assert (finding.word, finding.saturated) == ("steady", is_said)
    assert finding.entries()["stability"]["provisos"] == ["its actuator is at its limit"] * is_said


def test_of_a_push_that_friction_withstands_it_is_said_that_nothing_moved():
    finding = found(scene(**pressed(friction={"kinetic": 0.9})))
    assert (finding.word, finding.why, finding.settles_s) == ("steady", "unmoved", None)


def test_a_limit_cycle_that_no_hand_feels_is_told_so_beside_the_word_in_a_unit_that_suits():
    finding = Finding("limit-cycle", "forgets", 1.0, width_m=3.45e-7, frequency_Hz=40.0)
    assert finding.entries()["stability"]["provisos"] == ["less than a hand feels"]
    assert "the same swing, 345 nm peak to peak" in finding.sentence()
    assert replace(finding, felt=True, width_m=1e-3).entries()["stability"]["provisos"] == []
    assert "1.00 mm peak" in replace(finding, width_m=1e-3).sentence()


@pytest.mark.parametrize(
    ("rate_1_s", "error_1_s", "said"),
    [(-1.25, 0.009, ", and still decaying by 1.25 +- 0.009 1/s."),
     (-1.25, 0.5, "."), (0.0, 1.0, ".")],
)  # fmt: skip
def test_what_no_hand_feels_is_told_to_decay_still_where_it_does_by_three_standard_errors(rate_1_s, error_1_s, said):
    finding = Finding("steady", "unfelt", 1.0, 4.0, rate_1_s, error_1_s, 12.5, 1.9e-5, settles_s=2.4)
    assert finding.sentence().endswith("feels" + said)


@pytest.mark.parametrize("watched_s", [1.0, 2.0, 4.0])
@pytest.mark.parametrize("rate_1_s", [0.06, 0.09, 0.2])
def test_what_grows_is_never_steady_however_little_it_grew_while_it_was_watched(watched_s, rate_1_s):
    change = rate_1_s * watched_s / 2.0
    swing = Swing(
        watched_s, 1.0, 1e-5, True, True, False, (change, change), (1e-4, 1e-4), rate_1_s, 1e-4, width_m=4e-6,
        told_m=4e-6, spread_m=1e-7, most_m=5e-6, moved_m=5e-6, at_first=1.0, at_last=1.0, frequency_Hz=40.0,
        ripple_N=0.0, covers=True, times_felt=0.2, settles_s=0.2,
    )  # fmt: skip
    assert decide(swing, last=False).word != "steady"
    still = swing._replace(changes=(0.0, 0.0))
    assert decide(still, last=False).word == "steady"


@pytest.mark.parametrize("larger_rests", [True, False])
def test_a_loop_that_rests_after_one_push_and_swings_on_after_the_other_is_undecided_at_its_frequency(larger_rests):
    t = np.arange(4000) / 1000.0
    swings, dies = 1e-3 * np.sin(2 * np.pi * 40.0 * t), 1e-3 * np.exp(-40.0 * t) * np.sin(2 * np.pi * 40.0 * t)
    small, large = (swings, dies) if larger_rests else (dies, swings)
    one = np.ones(1)
    [swing] = measure(Pushed(small[None], large[None], large[None], one, 0 * one, one > 0, one > 0, one > 0), 1000.0)
    found = decide(swing, last=True)
    assert (found.word, found.tells) == ("undecided", True)
    assert found.why == ("larger rests" if larger_rests else "smaller rests")
    assert (found.frequency_Hz, found.width_m) == pytest.approx((40.0, 2e-3), rel=0.02)
    assert "either may happen" in found.sentence()
    tiny = Pushed(1e-3 * small[None], 1e-3 * large[None], large[None], one, 1e-5 * one, one > 0, one > 0, one > 0)
    [unfelt] = measure(tiny, 1000.0)
    assert decide(unfelt, last=True).word == "steady"


@pytest.mark.slow
def test_a_wall_of_ridges_that_the_smaller_push_alone_sets_swinging_is_not_called_too_slow_to_tell():
    ridges = ["wall.kind='texture'", "wall.ridge_spacing=0.0005", "wall.ridge_force=0.5"]
    sets = ["event=[]", "clock.round_trip_delay=0.001", "wall.stiffness=1000", *ridges]
    finding = judge_scene(load(bundled("scenes")["demo"], sets).scene, KINDS)
    assert (finding.word, finding.why) == ("undecided", "larger rests")
    assert finding.frequency_Hz == pytest.approx(39.6, rel=0.02)


def test_of_an_unfelt_swing_that_was_there_all_along_no_time_is_told_after_which_it_came(monkeypatch):
    swings: list[Swing] = []
    monkeypatch.setattr(looks, "decide", lambda swing, *, last: swings.append(swing) or decide(swing, last=last))
    settled = found(scene(**pressed(encoder={"resolution": 1e-5}, wall={"position": 0.0, "stiffness": 300.0})))
    assert settled.why == "unfelt"
    width = f"{settled.width_m * 1e6:.3g} µm"
    assert f" within 1.7 s except for {width}" in settled.sentence()
    swing = next(each for each in swings if decide(each, last=True).why == "unfelt")
    throughout = decide(swing._replace(settles_s=0.0), last=True)
    assert (throughout.word, throughout.settles_s) == ("steady", None)
    assert f"it swung by no more than {width}" in throughout.sentence()
    assert " within " not in throughout.sentence()


@pytest.mark.slow
def test_of_a_motion_too_slow_for_its_watch_no_frequency_is_told():
    tables = pressed(
        device={"mass": 0.5, "damping": 0.02}, wall={"position": 0.0, "stiffness": 0.3}, diverged_beyond=100.0
    )
    end = ended(scene(**tables))
    finding = judge(end, (1.0, 2.0))
    assert (finding.word, finding.why, finding.frequency_Hz, finding.rate_1_s) == ("undecided", "too few", 0.0, None)
    assert "Hz" not in finding.sentence()


SWAYING: dict[str, Any] = {
    "duration": 5.0,
    "clock": {"round_trip_delay": 0.001},
    "device": {"mass": 0.15, "damping": 0.3, "position": 0.0},
    "friction": {"kinetic": 0.08},
    "encoder": {"resolution": 2e-5},
    "actuator": {"saturation": 8.0},
    "hand": {"mass": 0.01, "damping": 0.5, "stiffness": 10.0},
    "wall": {"position": -0.005, "stiffness": 3500.0},
}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("stiffness", "word", "there"),
    [(3500.0, "undecided", "swings on"), (60.0, "steady", "rests")],
)
def test_a_wall_that_rests_at_the_lightest_hold_of_a_hand_is_steady_only_if_it_rests_at_the_hardest_too(
    stiffness, word, there
):
    """The hand sways from 0.3 to 1.7 N once in 4 s and ends light; the stiff wall throws the device off all along."""
    force = {"kind": "sine", "amplitude": 0.7, "frequency": 0.25, "offset": -1.0}
    of = scene(**{**SWAYING, "wall": {"position": -0.005, "stiffness": stiffness},
                  "hand": {**SWAYING["hand"], "force": force}})  # fmt: skip
    finding = judge(ended(of), LOOKS_S)
    assert (finding.word, finding.at_hardest) == (word, there)
    assert finding.hardest_N == pytest.approx(1.7, rel=0.01)


@pytest.mark.parametrize(("seen_um", "is_other"), [
    (79, False), (90, False), (67, False), (108, True), (163, True), (58, True), (20, True), (0, True)])  # fmt: skip
def test_a_swing_after_the_push_that_is_not_as_wide_as_its_runs_is_told_as_another(seen_um: float, is_other: bool):
    """Widths of 79 +- 2 um: a fifth beyond two spreads is told; not where a hand or noise was in the run."""
    swing = Finding("limit-cycle", "lasts", width_m=79e-6, spread_m=2e-6, frequency_Hz=40.0, felt=True)

    def said(of: Finding, beside: tuple[str, ...] = ()) -> list[str]:
        return of.entries(seen_um * 1e-6, beside)["stability"]["provisos"]

    assert said(swing) == ["of another width than in its run"] * is_other
    assert said(swing, ("noise",)) == []
    apart = seen_um in (163, 20, 0)  # by half and more: a chaotic swing of such a spread is another one, too
    assert said(replace(swing, chaotic=True)) == ["of another width than in its run"] * apart
    assert said(replace(swing, frequency_Hz=1.0)) == []  # its run's last half second holds no period of it


@pytest.mark.slow
@pytest.mark.parametrize("seed", [40174, 40224])
def test_a_run_that_ends_on_the_way_to_its_swing_is_told_to_have_another_and_one_that_goes_on_is_not(seed: int):
    short = wild_loops.drawn(seed)
    assert short
    for scene_of, said in ((short, ["of another width than in its run"]), (replace(short, duration=2.0), [])):
        summary = run_in_process(scene_of, registry())
        assert (summary["verdict"], summary["stability"]["provisos"]) == ("limit-cycle", said)


@pytest.mark.parametrize(("word", "felt"), [("steady", False), ("limit-cycle", False), ("limit-cycle", True)])
@pytest.mark.parametrize(("times_felt", "is_edge"), [(None, False), (0.5, False), (0.9, True), (1.1, True), (3, False)])
def test_a_swing_at_the_edge_of_what_a_hand_feels_says_so_whatever_its_word(
    word: str, felt: bool, times_felt: float | None, is_edge: bool
) -> None:
    finding = Finding(word, "unfelt", 0.1, width_m=1e-5, felt=felt, times_felt=times_felt)
    told = finding.entries()["stability"]["provisos"]
    assert ("at the edge of what a hand feels" in told) == is_edge
    assert ("less than a hand feels" in told) == (word == "limit-cycle" and not felt and not is_edge)
