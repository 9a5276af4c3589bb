"""Safe walls: each rests, or is unfelt, in independent loops at other holds in every corner; none is much stiffer."""

from functools import cache
from itertools import product

import numpy as np
import pytest

from haploop.tools.advise.known import formulas
from haploop.tools.advise.search import Found, search
from haploop.tools.advise.subject import make_subject
from haploop.tools.advise.walls.cases import hold_N, make_loop
from haploop.tools.advise.walls.trial import Store, Trial
from helpers.scenes.least import KINDS
from oracles.held_wall import ASSUMED, DEVICES, buzzes, columns, in_corners, press

pytestmark = pytest.mark.slow
HOLDS = np.linspace(0.3, 3.0, 11)
# Sway of the hand, its frequency in Hz, and the speed of the tap in m/s: how every wall is met.
WAYS = np.array([(0.3, 0.5, 0.2), (0.3, 0.3, 0.2), (0.0, 0.5, 0.2), (0.3, 0.5, 0.05)])
KIND = ("damping", "bidirectional-inertia", "unidirectional-inertia")
devices = pytest.mark.parametrize("device", ["premium15", "premium15_cable", "omega3"])


@cache
def advised(device: str) -> tuple[Found, float]:
    asked = make_subject(device, None, None, None, [], KINDS)
    loop = make_loop(asked.scene, asked.has_task)
    with Trial(Store(), workers=1) as trial:
        return search(loop, [of.key for of in asked.assumed], trial), hold_N(loop)


def safe(device: str, hold_N: float, stiffness: np.ndarray, elements: np.ndarray, most: int) -> np.ndarray:
    """Whether walls, each with the sizes of its elements, are unfelt at 11 holds in corners, however they are met."""
    of, holds = in_corners(DEVICES[device], hold_N * HOLDS, ASSUMED.get(device, ()), most)
    good = np.ones(len(stiffness), bool)
    for share in np.array_split(np.random.default_rng(3).permutation(len(holds)), [6, 48]):
        walls = np.flatnonzero(good)
        if not len(walls):
            break
        wall, member, way = (each.ravel() for each in np.meshgrid(walls, share, range(len(WAYS)), indexing="ij"))
        some, sizes = columns(of, member), dict(zip(KIND, elements[wall].T, strict=True))
        sway, sway_Hz, speed = WAYS[way].T
        seen = press(some, holds[member], stiffness[wall], {**sizes}, sway=sway, sway_Hz=sway_Hz, speed=speed)
        good[walls] = ~buzzes(some, *seen).reshape(len(walls), -1).any(axis=1)
    return good


def sizes_of(found: Found) -> np.ndarray:
    values = {kind: value for (kind, _), value in zip(found.advised.family.parts, found.advised.values, strict=True)}
    return np.array([[values.get(kind, 0.0) for kind in KIND]])


@devices
def test_the_advised_wall_is_motionless_or_below_what_is_felt_in_independent_loops_in_every_corner(device):
    found, hold_N = advised(device)
    assert found.stiffness_N_m
    assert safe(device, hold_N, np.array([found.stiffness_N_m]), sizes_of(found), most=64).all()


@devices
def test_no_wall_with_any_element_of_a_grid_is_safe_that_is_more_than_a_tenth_stiffer_than_the_advised_one(device):
    found, hold_N = advised(device)
    of = DEVICES[device]
    moved = of.mass + of.motor_mass
    largest = np.array([moved / 5e-4, moved, moved])  # beyond, the element alone makes the device unstable
    shares = 2.0 ** -np.arange(1.0, 10.0)
    choices = [np.zeros(3), *(share * largest * only for share, only in product(shares, np.eye(3)))]
    choices += [largest * (b, 0.0, m) for b, m in product(shares[2::2], shares[3::2])]
    advised_sizes = sizes_of(found)[0]
    choices += [advised_sizes * factor for factor in (0.7, 0.84, 1.0, 1.19, 1.41)]
    stiffness = found.stiffness_N_m * 1.1 * 1.03 ** np.arange(5.0)
    walls = list(product(stiffness, choices))
    for corners in (16, 64):  # few first; what passes there is met as the advised wall is
        left = np.array([k for k, _ in walls]), np.array([each for _, each in walls]).reshape(-1, len(KIND))
        walls = [wall for wall, good in zip(walls, safe(device, hold_N, *left, most=corners), strict=True) if good]
    assert not walls


def test_the_wall_that_was_once_advised_for_the_premium_buzzes_at_every_hold_in_nearly_every_corner():
    members, holds = in_corners(DEVICES["premium15"], HOLDS)
    assert buzzes(members, *press(members, holds, 28_000.0, {})).mean() > 0.95


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
