"""Judgements: loops of which the end of the run alone would give the wrong word."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from haploop.controller.dissipation import registry
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.file import load
from haploop.launch.stability.decide import Finding, decide
from haploop.launch.stability.judge import judge
from haploop.launch.stability.looks import is_smooth
from haploop.launch.stability.swing import Pushed, Swing, measure
from haploop.launch.stability.traces import frequency_Hz, is_felt, most_felt, sizes, smallest_felt_m, trend, widths
from haploop.logger.verdict.ripple import ripple
from haploop.protocol.scene.effects import Friction
from helpers.runs.judged import ended, found
from helpers.scenes.least import scene
from helpers.scenes.unseen_loops import drawn

PLAIN = {
    "duration": 2.0,
    "device": {"mass": 0.1, "damping": 0.5},
    "wall": {"position": 0.0, "stiffness": 500.0},
    "clock": {"round_trip_delay": 0.0},
}


def pressed(value: float = -1.0, **tables) -> dict:
    """The plain loop pressed against the wall; for it alone K = 1 000 N/m is the limit."""
    return {**PLAIN, "hand": {"force": {"kind": "constant", "value": value}}, **tables}


def swing_of(x: np.ndarray, rate: float, command: np.ndarray | None = None) -> Swing:
    """The measures of a loop that swings so after the larger push, a tenth as wide after the smaller one."""
    one, large = np.ones(1), x[None]
    held = large if command is None else command[None]
    [swing] = measure(Pushed(0.1 * large, large, held, one, 0.0 * one, one > 0, one > 0, one > 0), rate)
    return swing


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


@pytest.mark.parametrize(("kinetic", "blown"), [(0.043, "swings on"), (0.17, "rests")])
def test_friction_that_stops_a_pushed_loop_is_told_to_let_a_blow_set_it_swinging(kinetic, blown):
    """A loop of rho(M) > 1 by its map: friction of 2 % of the hold stops what 0.3 of it set off, but not what 3 do."""
    loop = drawn(7026)
    assert loop
    assert loop.rate_1_s > 0.0
    finding = found(replace(loop.scene, friction=Friction(kinetic=kinetic)))
    assert (finding.word, finding.blown) == ("steady", blown)
    assert finding.blow_N == pytest.approx(10.0 * finding.push_N)
    assert f"{finding.blow_N:.3g} N" in finding.sentence()


def test_a_device_that_nobody_holds_at_the_wall_is_undecided():
    thrown = {"mass": 0.1, "damping": 0.0, "position": 0.01, "velocity": -0.1}
    finding = found(scene(**{**PLAIN, "device": thrown, "duration": 0.15}))
    assert (finding.word, finding.why) == ("undecided", "leaves the wall")


def test_the_limit_cycles_of_the_paper_are_found_and_the_chaotic_one_is_told():
    regular, chaotic = (found(load(f"launch/scenes/fig6{letter}.toml")) for letter in "ac")
    assert (regular.word, regular.chaotic, chaotic.word, chaotic.chaotic) == ("limit-cycle", False, "limit-cycle", True)
    assert chaotic.spread_m > 0.05 * chaotic.width_m


@pytest.mark.parametrize(("stiffness", "least", "most"), [(500.0, 0.0, 0.1), (1100.0, 0.8, 1.0)])
def test_the_share_of_a_swing_that_is_the_loops_own_is_what_remains_of_it(stiffness, least, most):
    """A hand that trembles on a wall that rests but for its encoder's counts, and on one that buzzes."""
    force = {"kind": "sine", "amplitude": 0.05, "frequency": 5.0, "offset": -1.0}
    tables = {**pressed(), "hand": {"force": force}, "wall": {"position": 0.0, "stiffness": stiffness}}
    summary = run_in_process(scene(**tables, encoder={"resolution": 2e-5}, run={"verdict": "pushed"}), registry())
    assert least <= summary["stability"]["own_share"] <= most


def test_a_steady_loop_that_noise_shakes_tells_the_ripple_of_the_run_and_what_moved_it():
    tables = {**pressed(), "wall": {"position": 0.0, "stiffness": 500.0}, "run": {"verdict": "pushed"}}
    still = run_in_process(scene(**tables), registry())
    shaken = run_in_process(scene(**tables, noise={"deviation": 3e-5, "cutoff": 400.0}), registry())
    assert {still["verdict"], shaken["verdict"]} == {"steady"}
    assert still["window"]["force_ripple_N"] < 0.01 < 0.05 < shaken["window"]["force_ripple_N"]
    assert (still["stability"]["moved_beside"], shaken["stability"]["moved_beside"]) == ([], ["noise"])
    assert shaken["stability"]["force_ripple_N"] < 0.001


def test_of_a_swing_that_nothing_beside_the_loop_moves_no_share_is_told():
    finding = Finding("limit-cycle", "lasts", width_m=1e-3)
    assert finding.entries(1.2e-3)["stability"]["own_share"] is None
    assert finding.entries(1.2e-3, ["noise"])["stability"]["own_share"] == pytest.approx(1 / 1.2)


def test_no_share_is_told_of_a_run_that_swung_less_than_its_loop_does():
    finding = Finding("limit-cycle", "lasts", width_m=1e-3)
    assert finding.own_share(2e-3) == 0.5
    assert finding.own_share(5e-4) is None
    assert finding.own_share(0.0) is None
    assert Finding("growing", "grows", width_m=1e-3).own_share(2e-3) is None


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


def test_what_a_finger_feels_is_that_of_the_source_and_falls_with_frequency():
    assert [smallest_felt_m(f) for f in (10.0, 20.0, 320.0)] == pytest.approx([26e-6, 8.5e-6, 0.06e-6])
    assert smallest_felt_m(5.0) > 26e-6 > smallest_felt_m(100.0) > smallest_felt_m(400.0)
    assert is_felt(3e-6, 120.0)
    assert not is_felt(3e-6, 20.0)


def test_growth_frequency_and_ripple_of_a_sine_are_its_own():
    rate = 1000
    t = np.arange(4000) / rate
    x = 1e-4 * np.exp(0.3 * t) * np.sin(2 * np.pi * 40.0 * t) + 5e-3 * t
    found_trend = trend(widths(x, 200), 0.2)
    assert found_trend.rate_1_s == pytest.approx(0.3, abs=3 * float(found_trend.error_1_s))
    assert found_trend.rate_1_s == pytest.approx(0.3, rel=0.05)
    assert frequency_Hz(x - 5e-3 * t, rate) == pytest.approx(40.0, abs=0.3)
    force = 2.0 * np.sin(2 * np.pi * 97.0 * t) + 7.0 * np.sin(2 * np.pi * 5.0 * t)
    assert ripple(force, rate) == pytest.approx(4.0, rel=0.02)


def test_the_force_ripple_is_that_of_the_last_quarter():
    """A buzz of the command that ends before it leaves none, though the swing of the device goes on."""
    t = np.arange(4000) / 1000.0
    command = np.where(t < 2.9, np.sin(2 * np.pi * 100.0 * t), 0.0)
    swing = swing_of(1e-4 * np.sin(2 * np.pi * 40.0 * t), 1000.0, command)
    assert swing.ripple_N == 0.0
    assert swing.frequency_Hz == pytest.approx(40.0)


@pytest.mark.parametrize(("fast_m", "word"), [(2e-6, "limit-cycle"), (2e-8, "steady")])
def test_a_fast_chatter_that_is_felt_is_not_hidden_by_a_slow_swing_that_is_not(fast_m, word):
    """Of 10 um at 6 Hz nothing is felt, of 4 um at 150 Hz much: 0.23 um of amplitude are (Israr et al. 2006)."""
    t = np.arange(8000) / 1000.0
    x = 5e-6 * np.sin(2 * np.pi * 6.0 * t) + fast_m * np.sin(2 * np.pi * 150.0 * t)
    one = np.ones(1)
    alike = Pushed(x[None], x[None], x[None], one, 1e-5 * one, one > 0, one > 0, one > 0)
    [swing] = measure(alike, 1000.0)
    assert swing.times_felt == pytest.approx(np.hypot(fast_m / 0.233e-6, 5e-6 / 59.3e-6), rel=0.02)
    finding = decide(swing, last=False)
    assert (finding.word, finding.felt) == (word, word == "limit-cycle")
    assert finding.frequency_Hz == pytest.approx(150.0 if finding.felt else 6.0)


def test_what_is_felt_adds_over_the_frequencies_and_is_that_of_a_sine_alone():
    t = np.arange(4000) / 1000.0
    sines = [1e-6 * np.sin(2 * np.pi * f * t) for f in (100.0, 200.0)]
    one, two, both = (float(most_felt(x, 1000.0)[0]) for x in (*sines, sines[0] + sines[1]))
    assert one == pytest.approx(1e-6 / smallest_felt_m(100.0), rel=1e-3)
    assert both == pytest.approx(np.hypot(one, two), rel=1e-3)


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


def test_a_swing_that_decays_by_an_element_that_switches_behind_an_encoder_is_not_known_to_die():
    """Unidirectional inertia of 19 g at an encoder of 0.14 um: in an independent loop 74 um remain for good."""
    plain = scene(**pressed(encoder={"resolution": 1.4e-7}))
    switching = scene(
        **pressed(encoder={"resolution": 1.4e-7}, dissipation=[{"kind": "unidirectional-inertia", "mass": 0.019}])
    )
    assert [is_smooth(each) for each in (plain, switching, replace(switching, encoder=None))] == [True, False, True]


@pytest.mark.parametrize("frequency", [0.1, 0.25, 0.375, 0.6])
def test_a_slow_swing_that_grows_is_not_taken_for_one_that_dies_unfelt(frequency):
    """What a hand feels at a quarter of a hertz is wide, and half a period may fall while its growing."""
    for seconds in (1.0, 2.0, 4.0, 8.0, 16.0):
        t = np.arange(round(1000.0 * seconds)) / 1000.0
        for phase in np.arange(12.0) / 2.0:
            x = 2e-3 * np.exp(0.0105 * t) * np.sin(2 * np.pi * frequency * t + phase)
            finding = decide(swing_of(x, 1000.0), last=seconds == 16.0)
            assert finding.word in ("undecided", "growing"), (seconds, phase, finding.sentence())


def test_a_swing_said_to_last_is_bounded_by_the_one_of_the_two_that_changes_more():
    t = np.arange(8000) / 1000.0
    sine, one = 2e-2 * np.sin(2 * np.pi * 7.9 * t)[None], np.ones(1)
    small, is_so = np.exp(0.0009 * t) * sine, one > 0
    [swing] = measure(Pushed(small, sine, sine, one, 0.0 * one, is_so, is_so, is_so), 1000.0)
    finding = decide(swing, last=False)
    assert finding.why == "lasts"
    assert finding.rate_1_s is not None
    assert finding.error_1_s is not None
    assert finding.most_1_s is not None
    of_the_steadier = abs(finding.rate_1_s) + 2.0 * finding.error_1_s
    assert finding.most_1_s == pytest.approx(of_the_steadier + 0.0009, rel=0.02)
    assert f"no more than {finding.most_1_s:.2g} 1/s" in finding.sentence()


@pytest.mark.parametrize("rate_1_s", [-0.0045, -0.0033, 0.0033])
def test_a_swing_that_surely_changes_is_not_said_to_last_however_slowly_it_does(rate_1_s):
    """Both copies swing alike, as where what the run had set going is wider than what the pushes add."""
    for seconds in (4.0, 8.0, 16.0):
        t = np.arange(round(1000.0 * seconds)) / 1000.0
        x, one = 2e-2 * np.exp(rate_1_s * t) * np.sin(2 * np.pi * 7.9 * t)[None], np.ones(1)
        alike = Pushed(0.75 * x, x, x, one, 0.0 * one, one > 0, one > 0, one > 0)
        [swing] = measure(alike, 1000.0)
        assert decide(swing, last=seconds == 16.0).word != "limit-cycle"


def test_a_slow_creep_that_grows_is_not_taken_for_rest():
    """Its pieces are straight lines to less than a nanometre."""
    for seconds in (1.0, 2.0, 4.0):
        t = np.arange(round(1000.0 * seconds)) / 1000.0
        assert decide(swing_of(1e-2 * np.exp(0.01 * t), 1000.0), last=False).word == "undecided"


@pytest.mark.parametrize("periods", [2.0, 2.3, 3.1, 4.05, 7.02])
def test_a_sine_that_does_not_grow_is_not_said_to_however_its_pieces_fall(periods):
    """The widths alone, of pieces that do not hold whole periods, seem to grow by several of their standard errors."""
    rate, seconds = 1000.0, 4.8
    t = np.arange(round(seconds * rate)) / rate
    said = {sizes: 0.0, widths: 0.0}
    for phase in np.arange(12.0) / 2.0:
        x = 1e-4 * np.sin(2 * np.pi * periods * t / 0.2 + phase)
        for measured in said:
            growth = trend(measured(x, 200)[12:], 0.2)
            said[measured] = max(said[measured], abs(float(growth.change)))
        swing = swing_of(x, rate)
        assert all(abs(change) < 3.0 * error for change, error in zip(swing.changes, swing.errors, strict=True))
        assert abs(swing.changes[0]) < 0.03
    assert said[sizes] < 0.4 * said[widths]


def test_a_scene_without_noise_is_judged_the_same_with_its_noise_off():
    plain = scene(**pressed(noise={"deviation": 1e-12, "cutoff": 100.0}))
    finding, without = found(plain), found(replace(plain, noise=None))
    assert finding.word == without.word == "steady"
