"""The largest steady stiffness: its definition, the size that comes to it, and when one element bears more."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from haploop.tools.studies.choi2022.device import KINDS, Setup, elements_of
from haploop.tools.studies.choi2022.steadiness import (
    STIFFNESSES,
    WIDEST_M,
    Presses,
    Range,
    Reached,
    beats,
    finer,
    is_judged_steady,
    largest,
    pressed,
    run_all,
    started,
    swing_m,
)

SETUP = Setup(
    mode_Hz=225.0, near_share=0.45, mode_damping=0.013, push_N=3.0, entry_m_s=0.2, hand=1.0, delay_s=0.0016,
    unit="420 Hz", mount="tip",
)  # fmt: skip


def reached(*steady: float) -> Reached:
    return Reached("damping", (1.0,), steady, 0.0)


def test_the_largest_stiffness_has_no_gap_below_it() -> None:
    stiffnesses = np.array([2500.0, 3000.0, 3500.0, 4000.0])
    rows = np.array([[True, True, False, True], [False] * 4, [True] * 4])
    assert [largest(row[:, None], stiffnesses) for row in rows] == [3000.0, 0.0, 4000.0]


def test_walls_that_are_steady_with_different_sizes_are_no_range_of_one_element() -> None:
    """One size holds the soft walls and another the stiff ones: a wall with holes below it is no largest."""
    stiffnesses = np.array([2500.0, 3000.0, 3500.0, 4000.0])
    steady = np.array([[True, True, False, False], [False, False, True, True]]).T
    assert largest(steady, stiffnesses) == 3000.0


def test_starts_differ_within_the_way_of_one_tick_and_the_first_is_the_scenes_own() -> None:
    scene = SETUP.scene(3000.0)
    assert started(scene, 0) == scene
    offsets = [started(scene, start).device.position - scene.device.position for start in range(1, 9)]
    assert all(0.0 < offset < 0.2e-3 for offset in offsets)
    assert len({round(offset, 9) for offset in offsets}) == 8


def test_the_best_size_holds_the_most_and_of_several_swings_least() -> None:
    swings = np.full((len(STIFFNESSES), 3, 2), 10.0 * WIDEST_M)
    swings[:2, 0], swings[:4, 1], swings[:4, 2] = 0.0, 0.9 * WIDEST_M, 0.1 * WIDEST_M
    found = Range(np.array([[0.0], [1.0], [2.0]]), swings)
    assert found.best() == 2
    assert found.held().tolist() == [2.0, 4.0, 4.0]
    # Between its neighbours, and beyond the end nothing is tried.
    assert finer(found).min() > 1.0
    assert finer(found).max() < 2.0


def test_one_element_bears_more_only_by_a_step_and_with_intervals_apart() -> None:
    assert beats(reached(5000.0, 5000.0, 5500.0, 5000.0), reached(4000.0, 4500.0, 4000.0, 4000.0))
    assert not beats(reached(4500.0, 4500.0, 5000.0, 4500.0), reached(4500.0, 4500.0, 4500.0, 4500.0))
    assert not beats(reached(3000.0, 7000.0), reached(4000.0, 4500.0))
    assert reached(4500.0, 4500.0).describe() == "4.5"
    assert reached(4000.0, 5000.0).describe() == "4.50 [-1.85, 10.85]"


def judged(word: str, why: str = "", width_m: float = 0.5 * WIDEST_M, rate_1_s: float = 0.0) -> bool:
    found = {"why": why, "width_m": width_m, "rate_1_s": rate_1_s, "error_1_s": 0.01}
    return is_judged_steady({"verdict": word, "stability": found})


def test_a_judged_wall_is_steady_by_how_wide_what_remains_is_and_never_where_it_grows_or_is_left() -> None:
    """A device that goes away from the wall is undecided with a width of 0: that is no steady contact."""
    assert judged("steady")
    assert judged("limit-cycle")
    assert not judged("limit-cycle", width_m=1.1 * WIDEST_M)
    assert not any(judged(word) for word in ("growing", "diverged", "no-contact"))
    assert not judged("undecided", "leaves the wall", width_m=0.0)
    assert not is_judged_steady({"ended": "error", "why": "it failed"})


def test_a_swing_of_which_the_judge_cannot_tell_how_it_goes_on_is_steady_only_if_it_is_not_seen_to_grow() -> None:
    assert judged("undecided", "too slow", rate_1_s=0.02)
    assert not judged("undecided", "too slow", rate_1_s=0.04)
    assert not judged("undecided", "too slow", width_m=1.1 * WIDEST_M)


@pytest.mark.slow
def test_the_judge_and_a_long_press_agree_but_near_the_line_between_them() -> None:
    """Damping on a wall that it holds and one that it does not, far from where one begins and the other ends."""
    [best] = Presses(SETUP, KINDS[1], STIFFNESSES.tolist(), [(2.0,)], (3,)).judged()
    soft, hard = (max(best - 500.0, 500.0), best + 1500.0)
    one, two = run_all([pressed(started(SETUP.scene(k, elements_of(KINDS[1], 2.0)), 3)) for k in (soft, hard)])
    assert swing_m(one) <= WIDEST_M < swing_m(two)


@pytest.mark.slow
def test_an_element_of_no_size_is_no_element() -> None:
    quiet = replace(SETUP, unit="ideal")
    none, empty = run_all([pressed(quiet.scene(3000.0, of)) for of in ((), elements_of(KINDS[1], 0.0))])
    assert swing_m(none) == pytest.approx(swing_m(empty), rel=1e-9)
