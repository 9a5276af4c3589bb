"""Safe walls: each rests, or is not felt, in independent loops at other holds in every corner."""

import numpy as np
import pytest

from haploop.tools.advise.formulas import formulas
from haploop.tools.advise.search import Found, search
from haploop.tools.advise.subject import make_subject
from haploop.tools.advise.walls.cases import hold_N, make_loop
from haploop.tools.advise.walls.store import Store
from haploop.tools.advise.walls.trial import Trial
from helpers.scenes.least import KINDS
from oracles.held_wall import DEVICES, buzzes, in_corners, press, turns

pytestmark = pytest.mark.slow
HOLDS = np.linspace(0.3, 3.0, 11)


def advised(device: str) -> tuple[Found, float]:
    asked = make_subject(device, None, None, None, [], KINDS)
    loop = make_loop(asked.scene, asked.has_task)
    with Trial(Store(), workers=1) as trial:
        return search(loop, trial), hold_N(loop)


def pressed(device: str, found: Found, hold_N: float, stiffness_N_m: float, **how: float):
    """Position and counts of every hold in all 16 corners and the loop as described."""
    members, holds = in_corners(DEVICES[device], hold_N * HOLDS)
    best = found.advised
    elements = {kind: value for (kind, _), value in zip(best.family.parts, best.values, strict=True)}
    x, counts, _ = press(members, holds, stiffness_N_m, elements, **how)
    return x, counts


@pytest.mark.parametrize("device", ["premium15", "premium15_cable", "omega3"])
def test_the_advised_wall_neither_moves_nor_chatters_in_independent_loops_and_one_a_seventh_stiffer_does(device):
    found, hold_N = advised(device)
    assert found.stiffness_N_m
    for how in ({}, {"sway_Hz": 0.3}, {"sway": 0.0}, {"speed": 0.05}):
        x, counts = pressed(device, found, hold_N, found.stiffness_N_m, **how)
        assert len(x.T) == 11 * 17
        assert not buzzes(x, counts).any()
        assert (turns(counts) < 4).all()
    x, counts = pressed(device, found, hold_N, 1.14 * found.stiffness_N_m)
    assert (turns(counts) >= 4).any()


def test_the_wall_that_was_once_advised_for_the_premium_buzzes_at_every_hold_in_nearly_every_corner():
    members, holds = in_corners(DEVICES["premium15"], HOLDS)
    x, counts, _ = press(members, holds, 28_000.0, {})
    assert buzzes(x, counts).mean() > 0.95


@pytest.mark.parametrize(("share", "lasts"), [(0.9, False), (1.1, True)])
def test_swings_of_the_independent_loop_without_friction_die_below_the_limit_of_the_exact_map_and_last_above(
    share, lasts
):
    asked = make_subject("omega3", None, None, None, [], KINDS)
    limit = formulas(make_loop(asked.scene, asked.has_task))[-1].stiffness_N_m
    of, holds = in_corners(DEVICES["omega3"], np.array([1.0]))
    of.friction, of.count = 0.0 * holds, 1e-9 + 0.0 * holds
    x = press(of, holds, share * limit, {}, sway=0.0, speed=0.005)[0][:, 0]
    early, late = (np.ptp(np.diff(x[begin : begin + 300])) for begin in (500, 2500))
    assert late > early if lasts else late < 0.5 * early
