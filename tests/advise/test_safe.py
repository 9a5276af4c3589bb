"""Safe walls: each rests, or is unfelt, in independent loops at other holds in every corner; none is much stiffer."""

import re
from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from haploop.launch.scene.bundled import bundled
from haploop.tools.advise.known import formulas
from haploop.tools.advise.search import Found, search
from haploop.tools.advise.subject import assumptions
from haploop.tools.advise.walls.cases import hold_N
from haploop.tools.advise.walls.store import Store
from haploop.tools.advise.walls.trial import Trial
from helpers.scenes.presets import loop_of
from oracles.held_wall import ASSUMED, DEVICES, LASTS_S, buzzes, columns, in_corners, press

pytestmark = pytest.mark.slow
ADVICE = Path(__file__).parents[2] / "docs/advise.md"
HOLDS = np.linspace(0.3, 3.0, 11)
# Sway of the hand, its frequency in Hz, and the speed of the tap in m/s: how every wall is met.
WAYS = np.array([(0.3, 0.5, 0.2), (0.3, 0.3, 0.2), (0.0, 0.5, 0.2), (0.3, 0.5, 0.05)])
KIND = ("damping", "bidirectional-inertia", "unidirectional-inertia")


def safe(device: str, hold_N: float, stiffness: np.ndarray, elements: np.ndarray, most: int) -> np.ndarray:
    """Whether walls, each with the sizes of its elements, are unfelt at 11 holds in corners, however they are met.

    Few cases are met first, six of them in one way and for a short while: most that are too stiff fail there.
    """
    of, holds = in_corners(DEVICES[device], hold_N * HOLDS, ASSUMED.get(device, ()), most)
    good, order = np.ones(len(stiffness), bool), np.random.default_rng(3).permutation(len(holds))
    rounds = [(order[:6], WAYS[:1], 1.6), *((share, WAYS, LASTS_S) for share in np.split(order, [6, 12, 36, 120]))]
    for share, ways, lasts_s in rounds:
        walls = np.flatnonzero(good)
        if not len(walls):
            break
        wall, member, way = (each.ravel() for each in np.meshgrid(walls, share, range(len(ways)), indexing="ij"))
        some, sizes = columns(of, member), dict(zip(KIND, elements[wall].T, strict=True))
        sway, sway_Hz, speed = ways[way].T
        seen = press(
            some, holds[member], stiffness[wall], {**sizes}, sway=sway, sway_Hz=sway_Hz, speed=speed, lasts_s=lasts_s
        )
        good[walls] = ~buzzes(some, *seen).reshape(len(walls), -1).any(axis=1)
    return good


def sizes_of(found: Found) -> np.ndarray:
    values = {kind: value for (kind, _), value in zip(found.advised.family.parts, found.advised.values, strict=True)}
    return np.array([[values.get(kind, 0.0) for kind in KIND]])


@pytest.mark.long
@pytest.mark.parametrize("device", ["omega3", "premium15"])
def test_the_advised_wall_is_unfelt_in_every_corner_of_independent_loops_and_none_is_a_tenth_stiffer(device):
    """Against walls of a grid with any element there, alone and two together."""
    loop = loop_of(device)
    with Trial(Store(), workers=1) as trial:
        found, held = search(loop, [of.key for of in assumptions(bundled("devices")[device])], trial), hold_N(loop)
    assert found.stiffness_N_m >= found.alone_N_m > 0.0
    assert safe(device, held, np.array([found.stiffness_N_m]), sizes_of(found), most=32).all()
    assert not a_tenth_stiffer(device, held, found.stiffness_N_m, sizes_of(found)[0])


@pytest.mark.long
def test_so_is_the_wall_that_the_page_tells_for_a_device_with_a_cable():
    [(told, grams)] = re.findall(
        r"`premium15_cable` \| ([\d.]+) N/mm \| ([\d.]+) g of unidirectional inertia",
        ADVICE.read_text(encoding="utf-8"),
    )
    held, sizes = hold_N(loop_of("premium15_cable")), np.array([0.0, 0.0, 1e-3 * float(grams)])
    assert safe("premium15_cable", held, np.array([1e3 * float(told)]), sizes[None], most=32).all()
    assert not a_tenth_stiffer("premium15_cable", held, 1e3 * float(told), sizes)


@pytest.mark.parametrize("device", ["falcon", "touch"])
def test_no_element_makes_a_wall_safe_that_is_a_tenth_stiffer_than_the_one_advised_without_any(device):
    [told] = re.findall(rf"`{device}` \| at most ([\d.]+) N/mm \| nothing", ADVICE.read_text(encoding="utf-8"))
    assert not a_tenth_stiffer(device, hold_N(loop_of(device)), 1e3 * float(told))


def a_tenth_stiffer(
    device: str, hold_N: float, stiffness_N_m: float, sizes: Sequence[float] | np.ndarray = ()
) -> list[Any]:
    """Walls a tenth stiffer, and more, that are safe with an element of a grid, two of them, or about these sizes."""
    around = [np.asarray(sizes) * factor for factor in (0.7, 0.84, 1.0, 1.19, 1.41)] if len(sizes) else []
    of = DEVICES[device]
    moved = of.mass + of.motor_mass
    largest = np.array([moved / 5e-4, moved, moved])  # beyond, the element alone makes the device unstable
    shares = 2.0 ** -np.arange(1.0, 10.0)
    choices = [np.zeros(3), *(share * largest * only for share, only in product(shares, np.eye(3)))]
    choices += [largest * (b, 0.0, m) for b, m in product(shares[2::2], shares[3::2])]
    walls = [*product(stiffness_N_m * 1.1 * 1.06 ** np.arange(2.0), [*choices, *around])]
    met = np.array([k for k, _ in walls]), np.array([each for _, each in walls]).reshape(-1, len(KIND))
    return [wall for wall, good in zip(walls, safe(device, hold_N, *met, most=64), strict=True) if good]


def test_the_wall_that_was_once_advised_for_the_premium_buzzes_at_every_hold_in_nearly_every_corner():
    members, holds = in_corners(DEVICES["premium15"], HOLDS)
    assert buzzes(members, *press(members, holds, 28_000.0, {})).mean() > 0.95


@pytest.mark.parametrize(("share", "lasts"), [(0.9, False), (1.1, True)])
def test_swings_of_the_independent_loop_without_friction_die_below_the_limit_of_the_exact_map_and_last_above(
    share, lasts
):
    limit = formulas(loop_of("omega3"))[-1].stiffness_N_m
    of, holds = in_corners(DEVICES["omega3"], np.array([1.0]))
    of.friction, of.count = 0.0 * holds, 1e-9 + 0.0 * holds
    x = press(of, holds, share * limit, {}, sway=0.0, speed=0.005)[0][:, 0]
    early, late = (np.ptp(np.diff(x[begin : begin + 300])) for begin in (500, 2500))
    assert late > early if lasts else late < 0.5 * early
