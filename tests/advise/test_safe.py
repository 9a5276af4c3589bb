"""Safe walls: each rests, or is unfelt, in independent loops at other holds in every corner; none is much stiffer."""

import re
from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from haploop.tools.advise.known import formulas
from haploop.tools.advise.walls.cases import hold_N
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


# A row of the page: device, wall in N/mm, and the size and kind of the element, if one is advised.
ROW = r"`{0}` \| (?:at most )?([\d.]+) N/mm \| (?:nothing|([\d.]+) (N s/m|g) of (damping|\w+ inertia)) \|"


def advised(device: str) -> tuple[float, np.ndarray]:
    """The wall that the page tells for a device, N/m, and the sizes of its elements."""
    [(wall, size, unit, kind)] = re.findall(ROW.format(device), ADVICE.read_text(encoding="utf-8"))
    value = float(size or 0) * (1e-3 if unit == "g" else 1.0)
    return 1e3 * float(wall), value * np.array([kind.replace(" ", "-") == of for of in KIND])


@pytest.mark.long
@pytest.mark.parametrize("device", ["omega3", "premium15", "premium15_cable"])
def test_the_advised_wall_is_unfelt_in_every_corner_of_independent_loops_and_none_is_a_tenth_stiffer(device):
    """Against walls of a grid with any element there, alone and two together."""
    held, (stiffness_N_m, sizes) = hold_N(loop_of(device)), advised(device)
    assert sizes.any() == (device != "premium15")
    assert safe(device, held, np.array([stiffness_N_m]), sizes[None], most=32).all()
    assert not a_tenth_stiffer(device, held, stiffness_N_m, sizes)


@pytest.mark.parametrize("device", ["falcon", "touch"])
def test_no_element_makes_a_wall_safe_that_is_a_tenth_stiffer_than_the_one_advised_without_any(device):
    assert not a_tenth_stiffer(device, hold_N(loop_of(device)), *advised(device))


def a_tenth_stiffer(device: str, hold_N: float, stiffness_N_m: float, sizes: Sequence[float] | np.ndarray) -> list[Any]:
    """The sizes of elements, one of a grid, two of them, or about these, with which a wall a tenth stiffer is safe."""
    around = [np.asarray(sizes) * factor for factor in (0.7, 0.84, 1.0, 1.19, 1.41)] if np.any(sizes) else []
    of = DEVICES[device]
    moved = of.mass + of.motor_mass
    largest = np.array([moved / 5e-4, moved, moved])  # beyond, the element alone makes the device unstable
    shares = 2.0 ** -np.arange(1.0, 10.0)
    choices = [np.zeros(3), *(share * largest * only for share, only in product(shares, np.eye(3)))]
    choices += [largest * (b, 0.0, m) for b, m in product(shares[2::2], shares[3::2])]
    sizes = np.array([*choices, *around])
    return [*sizes[safe(device, hold_N, np.full(len(sizes), 1.1 * stiffness_N_m), sizes, most=64)]]


def test_the_wall_that_was_once_advised_for_the_premium_buzzes_at_every_hold_in_nearly_every_corner():
    members, holds = in_corners(DEVICES["premium15"], HOLDS)
    assert buzzes(members, *press(members, holds, 28_000.0, {})).mean() > 0.95


@pytest.mark.parametrize(("share", "lasts"), [(0.9, False), (1.1, True)])
def test_swings_of_the_independent_loop_without_friction_die_below_the_limit_of_the_exact_map_and_last_above(
    share, lasts
):
    limit = formulas(loop_of("omega3"))[-1].stiffness_N_m
    of, holds = in_corners(DEVICES["omega3"], np.array([1.0]))
    of = of._replace(friction=0.0 * holds, count=1e-9 + 0.0 * holds)
    x = press(of, holds, share * limit, {}, sway=0.0, speed=0.005)[0][:, 0]
    early, late = (np.ptp(np.diff(x[begin : begin + 300])) for begin in (500, 2500))
    assert late > early if lasts else late < 0.5 * early
