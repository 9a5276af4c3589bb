"""Boundaries: found to their tolerance, in as few rounds as halving takes, and said to be missing where they are."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from haploop.launch.runs.in_batch import batch_results
from haploop.protocol.scene.scene import Scene
from haploop.tools.linear.one_tick import OneTickMap
from haploop.tools.search.bisect import Tolerance
from haploop.tools.sweep.boundary import Boundary, Candidate, find_boundaries, verdict_is
from helpers.scenes.least import KINDS, scene

POINTS = [0.0, 25.0, 50.0, 75.0, 100.0]


def found(
    rules: Sequence[Callable[[float], bool | None]],
    points: Sequence[float] = POINTS,
    tolerance: Tolerance = Tolerance(absolute=0.5),  # noqa: B008 (frozen)
    rounds: list[int] | None = None,
) -> list[Boundary]:
    """Boundaries of rows that hold by rules."""

    def run(candidates: Sequence[Candidate]) -> Iterator[tuple[int, dict[str, Any]]]:
        if rounds is not None:
            rounds.append(len(candidates))
        for place, (row, value) in reversed([*enumerate(candidates)]):
            yield place, {"holds": rules[row](value), "why": "out of order"}

    return find_boundaries(len(rules), points, tolerance, run, lambda result: result["holds"])


@given(st.floats(1e-3, 99.999), st.booleans())
def test_a_bracket_is_as_narrow_as_asked_for_and_encloses_the_change(change: float, downwards: bool) -> None:
    near_side = (lambda x: x > change) if downwards else (lambda x: x < change)
    (one,) = found([near_side], POINTS[::-1] if downwards else POINTS)
    assert near_side(one.near)
    assert not near_side(one.far)
    assert one.low <= change <= one.high
    assert 0 < one.high - one.low <= 0.5
    assert (one.changes, one.why) == (1, "")


@given(st.floats(1e-6, 1e6), st.floats(1e-6, 1e-2))
def test_a_relative_tolerance_holds_over_twelve_decades(change: float, relative: float) -> None:
    rounds: list[int] = []
    (one,) = found([lambda x: x < change], [1e-7, 1e7], Tolerance(relative=relative), rounds)
    assert one.low <= change <= one.high <= one.low / (1 - relative) * (1 + 1e-12)
    # Halved in ratio: from 14 decades down to one part in a million takes 25 rounds, in difference some 60.
    assert len(rounds) <= 1 + math.ceil(math.log2(math.log(1e14) / relative)) + 1


def test_all_rows_go_together_one_candidate_of_each_a_round() -> None:
    rounds: list[int] = []
    found([partial(lambda change, x: x < change, change) for change in (10.0, 40.0, 60.0, 99.0)], rounds=rounds)
    assert rounds == [4 * len(POINTS)] + [4] * 6


def test_the_first_of_several_changes_counts_and_all_are_told() -> None:
    (one,) = found([lambda x: x < 30 or 60 < x < 80])
    assert one.low <= 30 <= one.high
    assert one.changes == 3


def test_where_nothing_changes_it_is_said_on_which_side_the_row_is() -> None:
    held, never, later = found([lambda x: True, lambda x: False, lambda x: x > 60])
    assert held.why == "steady at all 5 points, 0 to 100"
    assert never.why == "not steady at 0, where the search begins, nor at any of the other 4 points"
    assert later.why == "not steady at 0, where the search begins, but at 2 of the other 4 points"
    assert [math.isnan(one.near) and math.isnan(one.far) for one in (held, never, later)] == [True] * 3
    assert (held.changes, never.changes, later.changes) == (0, 0, 1)


def test_a_run_that_fails_before_the_change_leaves_the_row_unknown_and_disturbs_no_other() -> None:
    coarse, fine, beyond, good = found(
        [
            lambda x: None if x == 25 else x < 60,
            lambda x: None if x == 62.5 else x < 60,
            lambda x: None if x == 100 else x < 60,
            lambda x: x < 60,
        ]
    )
    assert coarse.why == "the run at 25 failed: out of order"
    assert fine.why == "the run at 62.5 failed: out of order"
    assert (fine.near, fine.far) == (50.0, 75.0)
    assert (beyond.near, beyond.far) == (good.near, good.far)
    assert (beyond.why, good.why) == ("", "")


def test_a_tolerance_that_floats_cannot_meet_ends_at_neighbouring_floats() -> None:
    (one,) = found([lambda x: x < 60], tolerance=Tolerance())
    assert one.high == math.nextafter(one.low, math.inf)


@pytest.mark.parametrize("points", [[1.0], [1.0, 1.0], [1.0, 3.0, 2.0], [math.nan, 1.0]])
def test_points_that_go_no_way_are_refused(points: list[float]) -> None:
    with pytest.raises(ValueError, match="at least two points"):
        found([lambda x: True], points)


@pytest.mark.parametrize("ahead", [1.0, -1.0])
def test_what_is_undecided_is_not_taken_for_steady_and_told_from_where_to_where(ahead: float) -> None:
    def verdict(x: float) -> str:
        return "steady" if ahead * (x - 50) < -10 else "undecided" if ahead * (x - 50) < 10 else "growing"

    def run(candidates: Sequence[Candidate]) -> Iterator[tuple[int, dict[str, Any]]]:
        yield from ((place, {"verdict": verdict(x)}) for place, (_, x) in enumerate(candidates))

    points = [point for point in POINTS[:: int(ahead)] if point != 50.0]
    (one,) = find_boundaries(1, points, Tolerance(absolute=0.5), run, verdict_is())
    assert [one.near, one.far] == pytest.approx([50 - 10 * ahead, 50 + 10 * ahead], abs=0.5)
    assert one.why.startswith("undecided from ")


def pressed(damping: float, delay: float, stiffness: float, duration: float) -> Scene:
    """A linear loop."""
    return scene(
        duration=duration,
        clock={"round_trip_delay": delay},
        device={"mass": 0.05, "damping": damping},
        hand={"mass": 0.01, "stiffness": 50.0, "damping": 0.5, "force": {"kind": "constant", "value": -1.0}},
        wall={"position": -0.002, "stiffness": stiffness},
        diverged_beyond=0.1,
        run={"verdict": "pushed"},
    )


LOOPS = [(0.2, 0.0), (1.0, 0.002), (2.0, 0.0005)]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("duration", "loops"),
    [(0.5, LOOPS[1:2]), (2.0, LOOPS)],
)
def test_bisected_from_plain_runs_the_boundary_of_a_linear_loop_is_where_the_spectral_radius_is_one(
    duration: float, loops: list[tuple[float, float]]
) -> None:
    """Within a hundredth, however short the runs; what lies between its ends may be undecided."""
    limits = [OneTickMap.from_scene(pressed(*loop, 1.0, duration)).stiffness_limit() for loop in loops]
    assert len(loops) == 1 or max(limits) / min(limits) > 3

    def run(candidates: Sequence[Candidate]) -> Iterator[tuple[int, dict[str, Any]]]:
        scenes = [pressed(*loops[row], stiffness, duration) for row, stiffness in candidates]
        return batch_results(scenes, KINDS, energy=False, fewest=2)

    points = [20.0 * 2**k for k in range(12 if len(loops) > 1 else 8)]
    boundaries = find_boundaries(len(loops), points, Tolerance(relative=0.004), run, verdict_is())
    for limit, one in zip(limits, boundaries, strict=True):
        assert one.low <= 1.01 * limit
        assert one.high >= 0.99 * limit
        assert one.high - one.low <= 0.03 * limit
