"""Many loops side by side do what one run does, and a wall is tried in all its cases."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from haploop.launch.stability.judge import judge_scene
from haploop.plant.chain.chain import Chain
from haploop.plant.friction import projected
from haploop.protocol.scene.paths import with_value
from haploop.protocol.scene.scene import ElementTable, Scene
from haploop.tools.advise.report import describe
from haploop.tools.advise.walls.cases import HOLDS, Case, make_loop
from haploop.tools.advise.walls.corners import corner, ranges
from haploop.tools.advise.walls.felt import slow_swing_m
from haploop.tools.advise.walls.loops import LoneLoop, Loops, make_loops
from haploop.tools.advise.walls.store import Job, Store, Tried
from haploop.tools.advise.walls.trial import Trial
from haploop.tools.linear.one_tick import OneTickMap
from helpers.scenes.least import KINDS, scene
from helpers.scenes.presets import loop_of


def placed(loop: Scene, case: Case, stiffness: float, *elements: ElementTable) -> Scene:
    return replace(with_value(case.scene(loop), "wall.stiffness", stiffness), dissipation=elements)


DAMPING, INERTIA = (ElementTable(name=name, parameters={key: value}) for name, key, value in (
    ("damping", "damping", 1.0), ("unidirectional-inertia", "mass", 0.002)))  # fmt: skip


def test_without_friction_loops_side_by_side_whatever_simple_elements_they_have_keep_the_bits_of_each_alone():
    loop = replace(loop_of("touch"), friction=None)
    some = ((), (DAMPING,), (DAMPING, INERTIA))
    scenes = [placed(loop, Case(hold), 900.0, *elements) for hold in (0.3, 1.0) for elements in some]
    [(group, loops)] = make_loops(scenes, KINDS)
    assert group == [*range(len(scenes))]
    together = loops.go_on(400)
    for place, one in enumerate(scenes):
        alone = LoneLoop(one, KINDS).go_on(400)
        assert np.array_equal(together.x[:, place], alone.x[:, 0])
        assert np.array_equal(together.command[:, place], alone.command[:, 0])


@pytest.mark.parametrize(
    ("damping", "stiffness", "is_borne"), [(0.16, 120.0, False), (0.16, 60.0, True), (6.0, 120.0, True)]
)
def test_a_wall_off_which_a_device_bounces_for_good_is_not_borne_however_slowly(damping, stiffness, is_borne):
    """0.3 kg behind 1.4 ms beyond its limit of 90 N/m: 62 mm at 3 Hz, of two turns a quarter second.

    A wall of 120 N/m was called safe; with more damping it is.
    """
    of = scene(
        device={"mass": 0.3, "damping": damping}, friction={"kinetic": 0.024}, encoder={"resolution": 5e-6},
        clock={"round_trip_delay": 0.0014}, hand=None,
    )  # fmt: skip
    with Trial(Store(None)) as trial:
        [failure] = trial.failures(make_loop(of, has_task=False), [Tried(stiffness)], [Case(hold) for hold in HOLDS])
    assert (failure is None) == is_borne
    if failure:
        assert re.match(
            r"after 11 s it still swings slowly, or is off the wall, 6\d mm peak to peak; hold", describe(failure)
        )


def test_a_hand_that_sways_over_a_second_does_not_swing_slowly_and_a_line_of_three_hertz_does():
    t = np.linspace(0.0, 1.0, 400)
    sway, swing = -0.02 + 6e-3 * np.sin(np.pi * t + 0.3), 1e-3 * np.sin(2.0 * np.pi * 3.0 * t)
    bounce = np.maximum(-0.01, 0.03 * np.sin(2.0 * np.pi * 1.0 * t))
    still, swings, bounces, gone = slow_swing_m(np.stack([sway, sway + swing, bounce, np.full(400, np.nan)], axis=1))
    assert (still, gone) == (0.0, 0.0)
    assert swings == pytest.approx(2e-3, rel=0.2)
    assert bounces == pytest.approx(0.04, rel=0.01)


@pytest.mark.slow
def test_projected_friction_in_machine_code_has_the_bits_of_numpy_also_when_members_leave(monkeypatch):
    pytest.importorskip("numba")
    monkeypatch.setattr(projected.LOOPS, "asked", 0)
    for device in ("omega3", "premium15_cable"):
        loop = loop_of(device)
        of = ranges(loop)
        scenes = [placed(loop, Case(1.0, corner(of, n)), 90.0 * n, DAMPING) for n in range(1, 101)]
        found = []
        for pays in (math.inf, 0.0):
            monkeypatch.setattr(projected.LOOPS, "pays", pays)
            loops = Loops(scenes, KINDS)
            before = loops.go_on(150)
            loops.select(np.arange(100) % 3 > 0)
            found.append((before, loops.go_on(150)))
        assert projected.LOOPS.module() is not None
        assert all(np.array_equal(*pair) for some in zip(*found, strict=True) for pair in zip(*some, strict=True))


@pytest.mark.slow
def test_projected_friction_follows_the_exact_one_and_ever_closer_with_shorter_steps():
    def apart(rate: int) -> float:
        loop = loop_of("premium15", f"clock.plant_rate={rate}", "encoder.resolution=1e-9")
        scenes = [placed(loop, Case(hold), 1500.0, DAMPING) for hold in (0.5, 1.0)]
        together = Loops(scenes, KINDS).go_on(300)
        alone = [LoneLoop(one, KINDS).go_on(300).x[:, 0] for one in scenes]
        return float(max(np.abs(together.x[:, place] - x).max() for place, x in enumerate(alone)))

    coarse, fine = apart(10_000), apart(80_000)
    assert coarse < 5e-6, "of a motion of a millimetre"
    assert fine < 0.3 * coarse


@pytest.mark.slow
def test_what_sticks_under_projected_friction_does_not_move_by_a_bit():
    loop = loop_of("touch")
    seen = Loops([placed(loop, Case(1.0, sway=0.0), 1000.0)], KINDS).go_on(2000)
    assert np.ptp(seen.x[-500:]) == 0.0


def test_members_may_differ_in_bodies_friction_holds_walls_and_gains_and_be_one_array():
    loop = loop_of("premium15_cable")
    corner = (("device mass", 1.2), ("hand damping", 0.8))
    rubs = with_value(loop, "friction.kinetic", 0.1)
    some = [placed(loop, Case(0.3), 500.0, DAMPING), placed(loop, Case(3.0, corner), 900.0, DAMPING),
            placed(rubs, Case(1.0), 700.0, replace(DAMPING, parameters={"damping": 2.0}))]  # fmt: skip
    [(group, loops)] = make_loops(some, KINDS)
    assert group == [0, 1, 2]
    together = loops.go_on(200)
    for place, one in enumerate(some):
        assert np.allclose(Loops([one], KINDS).go_on(200).x[:, 0], together.x[:, place], rtol=0.0, atol=1e-15)


@pytest.mark.slow
def test_a_loop_with_jitter_runs_by_itself_and_is_judged_all_the_same():
    loop = loop_of("premium15_cable", "jitter.kind=uniform", "jitter.most=0.001")
    with Trial(Store()) as trial:
        soft, stiff = trial.failures(loop, [Tried(200.0), Tried(6000.0)], [Case(1.0)])
    assert soft is None
    assert stiff


@pytest.mark.slow
def test_above_what_friction_bridges_a_wall_chatters_and_below_it_rests():
    loop = loop_of("premium15")  # 2 f_c / q = 3.34 N/mm
    with Trial(Store()) as trial:
        below, above = trial.failures(loop, [Tried(3100.0), Tried(3900.0)], [Case(hold) for hold in (0.3, 1.0, 3.0)])
    assert below is None
    assert above
    assert above.by_force


@pytest.mark.slow
def test_a_hold_of_the_task_alone_does_not_tell_a_wall_that_buzzes_at_another():
    loop = loop_of("omega3")
    with Trial(Store()) as trial:
        [at_its_own] = trial.failures(loop, [Tried(20_000.0)], [Case(1.0)])
        [at_three_times] = trial.failures(loop, [Tried(20_000.0)], [Case(3.0)])
    assert at_its_own is None
    assert at_three_times


@pytest.mark.parametrize(
    ("friction_N", "mass", "limit_m", "told"),
    [
        (0.5, 1.0, 1.0, "cannot be judged: in no case is the device still at the wall after 0.75 s"),
        (0.0, 100.0, 1.0, "the device leaves its limits; hold x 0.3"),
        (0.0, 100.0, 9.0, "after 11 s it still swings slowly, or is off the wall, 173 mm peak to peak; hold x 0.3"),
    ],
)
def test_a_wall_that_throws_the_device_off_for_good_is_not_borne(friction_N, mass, limit_m, told):
    thrown = scene(device={"mass": mass, "damping": 0.0}, friction={"kinetic": friction_N}, diverged_beyond=limit_m)
    with Trial(Store()) as trial:
        [failure] = trial.failures(make_loop(thrown, has_task=False), [Tried(1e5)], [Case(0.3)])
    assert failure
    assert describe(failure) == told


@pytest.mark.parametrize("factor", [0.8, 1.15])
def test_where_the_loop_is_linear_a_wall_is_borne_below_the_limit_of_the_exact_map_and_not_above(factor):
    read = scene(
        device={"mass": 0.05, "damping": 1.0}, hand={"stiffness": 20.0, "damping": 0.5},
        clock={"round_trip_delay": 0.002}, wall={"position": 0.0, "stiffness": 100.0},
    )  # fmt: skip
    limit = OneTickMap.from_scene(read).stiffness_limit()
    with Trial(Store()) as trial:
        [failure] = trial.failures(make_loop(read, has_task=False), [Tried(factor * limit)], [Case(1.0)])
    assert (failure is None) == (factor < 1.0)


def test_the_hands_share_of_a_corner_reaches_the_bodies():
    loop = loop_of("premium15")
    changed = Case(1.0, (("hand mass", 0.8),)).scene(loop)
    assert Chain.from_scene(changed).masses_kg[-1] == pytest.approx(0.8 * 0.269)


@pytest.mark.slow
def test_loops_of_other_bodies_and_friction_are_tried_in_one_array_each_by_its_own_threshold():
    loop = loop_of("premium15")
    others = [with_value(loop, "friction.kinetic", 0.024), with_value(loop, "encoder.resolution", 57.4e-6)]
    cases = (Case(0.3), Case(1.0))
    jobs = [Job(each, (Tried(1500.0), Tried(2500.0)), cases) for each in (loop, *others)]
    with Trial(Store()) as trial:
        together = trial.of_jobs(jobs)
    alone = []
    for job in jobs:
        with Trial(Store()) as trial:
            alone += trial.of_jobs([job])
    told = [[(each.case, each.at_s, pytest.approx(each.times_felt)) if each else None for each in of] for of in alone]
    assert [[(each.case, each.at_s, each.times_felt) if each else None for each in of] for of in together] == told
    assert [[failure is None for failure in of_job] for of_job in together] == [
        [True, True], [True, False], [True, False]
    ]  # fmt: skip


@pytest.mark.slow
def test_no_wall_that_a_trial_bears_is_a_felt_limit_cycle_or_grows_when_pushed_with_exact_friction():
    rng, borne = np.random.default_rng(5), 0
    elements = {"premium15": (3300.0, ()), "omega3": (17_000.0, (replace(DAMPING, parameters={"damping": 4.4}),)),
                "touch": (9000.0, ())}  # fmt: skip
    for device, (top, some) in elements.items():
        loop = loop_of(device)
        of = ranges(loop)
        for _ in range(4):
            case = Case(float(rng.choice(HOLDS)), corner(of, int(rng.integers(2 ** len(of)))), sway=0.0)
            stiffness = top * float(rng.uniform(0.6, 3.0))
            with Trial(Store()) as trial:
                [failure] = trial.failures(loop, [Tried(stiffness, some)], [case])
            if failure is None:
                found = judge_scene(placed(loop, case, stiffness, *some), KINDS)
                borne += 1
                assert found.word in ("steady", "no-contact"), (device, stiffness, case, found)
    assert 2 < borne < 12
