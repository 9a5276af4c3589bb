"""A virtual coupling whose world steps slowly needs the damping of one that does not: of the worst motion, too."""

from __future__ import annotations

import numpy as np
import pytest

from haploop.controller.dissipation import Motion
from haploop.controller.dissipation.virtual_coupling import VirtualCoupling

T, STIFFNESS, DAMPING = 1e-3, 1000.0, 0.3
BOUND = STIFFNESS * T / 2 + DAMPING


def forces(ways: np.ndarray, ticks: int, *, mass: float = 0.01, wall: float = 0.0) -> np.ndarray:
    """Forces of a coupling before each of these ways, shape (ticks, motions), of motions that begin at rest at 0.

    The wall lies below 0; without stiffness it is the free world.
    """
    coupling = VirtualCoupling(stiffness=STIFFNESS, damping=DAMPING, mass=mass, world_ticks=ticks)
    x, way, memory, found = 0.0 * ways[0], 0.0 * ways[0], coupling.memory, []
    memory = type(memory)(*(0.0 * x + part for part in memory))
    for step in ways:
        motion = Motion(T, -1.0)
        motion.x = x
        asked = {"force": 0.0 * x, "way": way, "wall_position": 0.0, "wall_stiffness": wall}
        force, memory = coupling.force(motion.telling(asked, asked), memory)
        found.append(force)
        x, way = x + step, step
    return np.array(found)


@pytest.mark.parametrize("ticks", [1, 2, 3, 8])
def test_half_kc_t_and_bc_is_what_the_worst_motion_asks_of_the_device_however_slow_the_world(ticks: int) -> None:
    """The energy taken is a quadratic form of the ways; its least eigenvalue is the damping that is missing."""
    form = -forces(np.eye(60), ticks)
    needed = -float(np.linalg.eigvalsh((form + form.T) / 2)[0]) * T
    assert 0.95 * BOUND < needed < BOUND * (1.0 + 1e-12)


@pytest.mark.parametrize(("wall", "ticks"), [(200.0, 5), (1e5, 5), (1e9, 20)])
def test_no_motion_onto_a_wall_takes_out_more_than_such_a_device_takes_itself(wall: float, ticks: int) -> None:
    """From rest at the surface, where nothing is stored; with half of that damping some do."""
    random = np.random.default_rng(5)
    ways = random.normal(size=(80, 4000)) * 1e-5 - random.uniform(-1.0, 1.0, size=4000) * 2e-6
    ways[:, ::2] *= (-1.0) ** np.arange(80)[:, None]
    taken = (-forces(ways, ticks, wall=wall) * ways).sum(axis=0)
    itself = (ways * ways).sum(axis=0) / T
    assert 0.5 * BOUND < (-taken / itself).max() < BOUND
