"""A million steps lose nothing: each step is exact, and what its addition rounds away is carried to the next."""

from __future__ import annotations

import math

import numpy as np
import pytest

from haploop.logger.books.one_mass import OneMassBooks
from haploop.logger.books.work import Displacement, by_interval, sum_steps
from haploop.plant.motion.one_mass import Mechanics
from haploop.plant.motion.transition import make_foh_transition
from haploop.protocol.ticks import Timebase
from helpers.runs.captured import run
from helpers.scenes.least import scene

# So light that v loses a few ten thousand units of its last place a step, and always the same broken number of them.
LIGHT = {"device": {"mass": 0.05, "damping": 1.7e-9, "velocity": 1.0}, "duration": 100.0, "diverged_beyond": 1e3}
SWINGING = {
    "device": {"mass": 0.02, "damping": 0.0, "position": 0.01, "velocity": 0.1},
    "hand": {"stiffness": 10.0},
    "duration": 100.0,
}


def plainly_added(resolved) -> tuple[np.ndarray, np.ndarray]:
    """The motion without forces by the same flow, x + dx and v + dv rounded at every step."""
    m, time = Mechanics.from_scene(resolved), Timebase.from_scene(resolved)
    flow = make_foh_transition(m.mass_kg, m.damping, m.stiffness, time.step_s)
    x, v = m.start
    states = [(x, v)]
    for _ in range(time.ticks * time.steps_per_tick):
        x, v = x + (flow.x_x * x + flow.x_v * v), v + (flow.v_x * x + flow.v_v * v)
        states.append((x, v))
    return tuple(np.array(states).T)


def relative_residual(resolved, x: np.ndarray, v: np.ndarray) -> float:
    """What the plant's books leave unexplained of a motion without commands, over the energy moved."""
    time = Timebase.from_scene(resolved)
    books = OneMassBooks(resolved, time)
    columns = {"x": x, "v": v, "force": np.zeros(len(x))}
    moved = Displacement(dx := by_interval(np.diff(x), time.steps_per_tick), sum_steps(dx))
    changes = np.stack(list(books.increments(0, columns, moved, [])))
    moved = books.stored_J(columns) + np.abs(changes).sum() / 2
    signs = np.array([1.0 if name == "hand_work" else -1.0 for name in books.names])
    return abs(math.fsum((changes * signs[:, None]).ravel())) / moved


def energies(resolved, x: np.ndarray, v: np.ndarray) -> np.ndarray:
    m = Mechanics.from_scene(resolved)
    return m.kinetic_J(v) + m.spring_J(x)


@pytest.mark.slow
def test_an_undamped_swing_keeps_its_energy_to_1e_14_over_a_million_steps():
    """355 swings of 10 N/m and 20 g. Plain addition drifts a hundred times as far."""
    resolved = scene(**SWINGING)
    ran = run(resolved)
    energy = energies(resolved, ran.plant["x"], ran.plant["v"])
    assert len(energy) == 1_000_001
    assert np.abs(energy / energy[0] - 1).max() < 1e-14
    drifting = energies(resolved, *plainly_added(resolved))
    assert np.abs(drifting / drifting[0] - 1).max() > 1e-13


@pytest.mark.slow
def test_carrying_the_rounding_along_keeps_the_books_of_a_light_damper_that_plain_addition_loses():
    """Measured: residual over energy moved 1e-16 as it is, which is the rounding of the end state, and 9e-11 with plain
    addition."""
    resolved = scene(**LIGHT)
    ran = run(resolved)
    assert ran.relative_residual < 1e-15
    assert relative_residual(resolved, ran.plant["x"], ran.plant["v"]) < 1e-15
    assert relative_residual(resolved, *plainly_added(resolved)) > 1e-12


@pytest.mark.slow
def test_a_damper_too_light_to_move_the_last_bit_of_v_still_heats_and_slows():
    """v loses less than half a unit of its last place a step: added plainly it would coast for ever."""
    resolved = scene(**LIGHT | {"device": {"mass": 1.0, "damping": 4e-13, "velocity": 1.0}})
    _, v = plainly_added(resolved)
    assert v[-1] == 1.0
    ran = run(resolved)
    assert 1.0 - ran.summary["final"]["v_m_s"] == pytest.approx(-math.expm1(-4e-13 * 100.0), abs=1.2e-16)
    assert ran.energy["device_heat_J"] == pytest.approx(0.5 * -math.expm1(-2 * 4e-13 * 100.0), rel=1e-9)


def test_a_long_run_at_rest_under_load_moves_no_energy():
    """It trembles by the last bits of the load, and the books of that add up to nothing."""
    ran = run(
        scene(
            duration=20.0,
            device={"mass": 0.01, "damping": 0.1, "position": 0.003},
            hand={"stiffness": 100.0, "rest": -0.002, "force": {"kind": "constant", "value": 0.5}},
        )
    )
    assert np.ptp(ran.plant["x"]) < 1e-16
    assert ran.energy["moved_J"] == pytest.approx(100.0 * 0.005**2 / 2, rel=1e-12)
    assert ran.energy["residual_J"] < 1e-20


@pytest.mark.slow
@pytest.mark.parametrize(("damping", "duration"), [(1e-6, 1000.0), (0.11, 100.0)])
def test_the_books_of_a_coasting_device_close_to_1e_15_over_ten_million_steps_or_long_after_it_stands(
    damping, duration
):
    device = {"mass": 0.02, "damping": damping, "velocity": 0.1}
    assert run(scene(duration=duration, diverged_beyond=1e3, device=device)).relative_residual < 1e-15
