"""What is advised holds: the limit is that of the exact map, and the margin is where it is said to be."""

from collections.abc import Sequence
from dataclasses import replace

import pytest

from haploop.launch.runs.in_process import run_in_process
from haploop.protocol.scene.scene import ElementTable, Scene
from haploop.tools.advise.advice import Advice, advice
from haploop.tools.advise.judge import Judge
from haploop.tools.advise.subject import Subject
from haploop.tools.advise.tasks import with_wall
from haploop.tools.advise.variations import Change, corners, scale_quantities
from haploop.tools.linear.one_tick import NeverStable, OneTickMap
from helpers.scenes.least import KINDS, scene

# No encoder and no friction: every family but those with unidirectional inertia is linear.
LOOP = scene(
    device={"mass": 0.05, "damping": 1.0},
    hand={"stiffness": 20.0, "damping": 0.5},
    clock={"round_trip_delay": 0.002},
    wall={"position": 0.0, "stiffness": 100.0},
)


@pytest.fixture(scope="module")
def found() -> Advice:
    with Judge(KINDS, workers=1) as judge:
        return advice(Subject("loop", LOOP, has_task=False, notes=()), KINDS, judge)


def exact_N_m(read: Scene, elements: Sequence[ElementTable]) -> float:
    try:
        return OneTickMap.from_scene(replace(read, dissipation=tuple(elements)), KINDS).stiffness_limit()
    except NeverStable:
        return 0.0


@pytest.mark.slow
@pytest.mark.parametrize("index", [0, 1], ids=["nothing", "damping"])
def test_the_largest_steady_wall_of_a_linear_loop_is_where_the_exact_map_has_rho_1(found: Advice, index: int):
    gains = found.gains[index]
    exact = exact_N_m(LOOP, gains.family.elements(gains.values))
    assert gains.limit.stiffness_N_m <= exact * (1.0 + 1e-6)
    assert gains.limit.not_steady_N_m >= exact * (1.0 - found.tolerance)


@pytest.mark.slow
def test_where_the_exact_map_allows_more_than_is_steady_the_tap_goes_on_bouncing(found: Advice):
    [inertia] = [gains for gains in found.gains if gains.family.name == "bidirectional inertia"]
    elements = inertia.family.elements(inertia.values)
    beyond = inertia.limit.not_steady_N_m
    assert inertia.limit.stiffness_N_m < beyond < 0.9 * exact_N_m(LOOP, elements)
    windows = [run_in_process(task, KINDS)["window"] for task in found.tasks.make_runs(beyond, elements)]
    endless = [window for window in windows if window["growth_1_s"] > -0.02]
    assert endless
    assert all(window["outside_fraction"] > 0.1 for window in endless)


@pytest.mark.slow
def test_no_other_damping_allows_a_much_stiffer_wall_by_the_exact_map(found: Advice):
    def allows(damping: float) -> float:
        return exact_N_m(LOOP, [ElementTable(name="damping", parameters={"damping": damping})])

    [(best,)] = [gains.values for gains in found.gains if gains.family.name == "damping"]
    most = max(allows(best * 1.05**i) for i in range(-40, 41))
    assert allows(best) > 0.95 * most
    assert allows(2.0 * best) < 0.8 * most, "the best is no flat top, on which any choice would pass"


@pytest.mark.slow
def test_the_advised_wall_is_steady_in_every_corner_and_not_beyond_the_nearest_instability(found: Advice):
    safe, [tap, press] = found.safe, found.tasks.scenes
    assert safe.nearest
    assert safe.stiffness_N_m <= safe.gains.tried[safe.gains.safe_values].stiffness_N_m, "nor above its own limit"
    elements = safe.gains.family.elements(safe.gains.safe_values)
    assert safe.corners == 1 + 2 ** len(found.uncertain)

    def verdicts(change) -> set[str]:
        placed = [replace(with_wall(task, safe.stiffness_N_m, elements), duration=4.0) for task in (tap, press)]
        return {run_in_process(change(task), KINDS)["verdict"] for task in placed}

    for corner in corners(LOOP):
        assert verdicts(lambda task, corner=corner: scale_quantities(task, corner)) == {"steady"}
    assert verdicts(safe.nearest.apply) != {"steady"}
    # Half as far, in the same direction, it still holds.
    nearer = Change(safe.nearest.quantity, safe.nearest.factor**0.5, safe.nearest.added_s / 2.0)
    assert verdicts(nearer.apply) == {"steady"}


@pytest.mark.slow
def test_the_worst_single_change_takes_what_the_exact_map_says(found: Advice):
    damping = found.gains[1]
    assert damping.worst
    elements = damping.family.elements(damping.values)
    by_map = {change: exact_N_m(change.apply(LOOP), elements) for change in damping.alone}
    assert by_map[damping.worst] == pytest.approx(min(by_map.values()), rel=0.03)
    assert damping.alone[damping.worst].stiffness_N_m == pytest.approx(by_map[damping.worst], rel=0.03)
    for change, limit in damping.alone.items():
        assert limit.stiffness_N_m * 0.99 <= by_map[change], "the others are at least bracketed"
