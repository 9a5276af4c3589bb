"""Promises of each stabilizer, on motions that nothing restrains and in closed form; and where a promise ends."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from haploop.controller.controller import Controller
from haploop.controller.dissipation import Element
from haploop.controller.dissipation.force_bounding import ForceBounding
from haploop.protocol.ticks import Timebase
from helpers.runs.batches import alone
from helpers.scenes.least import KINDS, scene

T, STIFFNESS = 1e-3, 2000.0
Kinds = dict[str, type[Element]]


def controller(element: dict[str, Any], kinds: Kinds = KINDS, damping: float = 0.1, **wall: float) -> Controller:
    """One with a wall that reaches from -1 m down, and an element."""
    whole = {"position": -1.0, "stiffness": STIFFNESS, **wall}
    made = scene(dissipation=[element], wall=whole, device={"mass": 0.01, "damping": damping})
    return Controller(made, Timebase.from_scene(made), kinds)


def answered(x: np.ndarray, element: dict[str, Any], **others: Any) -> dict[str, np.ndarray]:
    """Rows of a controller that sees these positions."""
    one = controller(element, **others)
    one.answer([(place,) for place in x.tolist()])
    (block,) = one.recorder.take()
    return {name: np.frombuffer(column) for name, column in block["columns"].items()}


def wandering(seed: int, ticks: int = 1500) -> np.ndarray:
    """Positions about a place 20 mm inside, where they begin: slowly to and fro by 10 mm, and shaken."""
    shaken = np.random.default_rng(seed).uniform(-3e-5, 3e-5, ticks)
    return -1.02 + 0.01 * np.sin(0.01 * np.arange(ticks)) + np.cumsum(shaken) * (np.arange(ticks) > 0)


def missing_after(rows: dict[str, np.ndarray]) -> np.ndarray:
    """Energy taken up to every tick by wall and element, from the rows alone, J."""
    way = np.diff(rows["x"])
    return np.append(0.0, np.cumsum(-rows["total"][:-1] * way))


# The passivity controller


def test_a_passivity_controller_that_always_acts_lets_a_free_mass_go_just_as_fast_as_it_came() -> None:
    """Without delay, friction and limit its books end at 0 and m v^2 / 2 is what it was; a bare wall adds 17 %."""

    def leaves(*elements: dict[str, Any]) -> float:
        device = {"mass": 0.05, "damping": 0.0, "position": 0.002, "velocity": -0.2}
        tap = scene(
            duration=0.15, device=device, wall={"position": 0.0, "stiffness": STIFFNESS}, dissipation=[*elements]
        )
        return alone(tap)["final"]["v_m_s"]

    without_limit = {"kind": "passivity-controller", "damping": 1e9}
    assert leaves({**without_limit, "acts": "always"}) == pytest.approx(0.2, rel=1e-9)
    assert leaves({**without_limit, "acts": "in-contact"}) > 0.203
    assert leaves() > 0.234


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_where_it_acts_without_limit_a_sample_leaves_what_the_change_of_speed_and_it_make(
    seed: int,
) -> None:
    """W[k+1] = W[k] (1 - v[k+1] / v[k]) - f_e[k] (x[k+1] - x[k]), whatever the motion.

    So no more is missing than the sample adds where the speed has not fallen; else there is, as the last lines show.
    """
    rows = answered(wandering(seed), {"kind": "passivity-controller", "damping": 1e9, "acts": "always"})
    energy, way = missing_after(rows), np.diff(rows["x"], prepend=rows["x"][0])
    acts = np.flatnonzero((energy[:-1] < 0.0) & (way[:-1] != 0.0))
    assert len(acts) > 100
    added = -rows["wall"][acts] * way[acts + 1]
    expected = energy[acts] * (1.0 - way[acts + 1] / way[acts]) + added
    assert energy[acts + 1] == pytest.approx(expected, rel=1e-6, abs=1e-9 * np.abs(energy).max())
    faster = way[acts + 1] / way[acts] >= 1.0
    assert (energy[acts + 1] - added)[faster].min() >= -1e-9 * np.abs(energy).max()
    assert (energy[acts + 1] - added)[~faster].min() < -1e-4


def test_with_delay_its_own_books_show_next_to_nothing_missing_while_the_true_ones_do() -> None:
    device = {"mass": 0.05, "damping": 0.0, "position": 0.002, "velocity": -0.2}
    pressed = {"position": 0.0, "stiffness": STIFFNESS}
    element = {"kind": "passivity-controller", "damping": 1e9, "acts": "always"}

    def books(delay: float) -> tuple[float, float]:
        tap = scene(
            duration=0.15, clock={"round_trip_delay": delay}, device=device, wall=pressed, dissipation=[element]
        )
        energy = alone(tap)["energy"]
        both = energy["wall"], energy["elements"][0]
        return sum(book["sampled_J"] for book in both), sum(book["true_J"] for book in both)

    assert books(0.0) == (pytest.approx(0.0, abs=1e-12), pytest.approx(0.0, abs=1e-12))
    seen, true = books(0.001)
    assert abs(seen) < 1e-5
    assert true < -5e-4


def test_adaptive_inertia_is_a_passivity_controller_where_damping_is_enough_and_keeps_its_limits() -> None:
    x = wandering(4)
    strong = answered(x, {"kind": "adaptive-inertia", "damping": 1e9, "mass": 0.01})
    damper = answered(x, {"kind": "passivity-controller", "damping": 1e9})
    assert strong["dissipation.0"] == pytest.approx(damper["dissipation.0"], rel=1e-9, abs=1e-9)
    rows = answered(x, {"kind": "adaptive-inertia", "damping": 0.5, "mass": 0.01})
    force, (v, a) = rows["dissipation.0"], (rows["v"], rows["a"])
    inertia = force - np.clip(force, -0.5 * np.abs(v), 0.5 * np.abs(v))
    assert np.count_nonzero(inertia) > 100
    assert (np.abs(inertia) <= 0.01 * np.abs(a) * (1 + 1e-12) + 0.5 * np.abs(v)).all()
    gated = v * np.append(0.0, a[:-1]) < 0.0
    assert (np.abs(force) <= 0.5 * np.abs(v) * (1 + 1e-12))[gated].all()


# Force bounding


def bounded_energy(rows: dict[str, np.ndarray], damping: float) -> np.ndarray:
    way = np.diff(rows["x"])
    return np.cumsum(damping / T * way * way - rows["total"][:-1] * way)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_tank_of_force_bounding_is_never_below_zero_whatever_the_motion(seed: int) -> None:
    rows = answered(wandering(seed), {"kind": "force-bounding", "acts": "always"}, damping=0.1)
    energy = bounded_energy(rows, 0.1)
    assert energy.min() >= -1e-13 * energy.max()
    assert (rows["total"] != rows["wall"]).any()


class Bolder(ForceBounding):
    """A bound that is a hundredth too large."""

    def force(self, motion: Any, memory: Any) -> Any:
        change, energy = super().force(motion, memory)
        return 1.01 * (change + motion.force) - motion.force, energy


@pytest.mark.parametrize(("law", "empties"), [(ForceBounding, True), (Bolder, False)])
def test_the_worst_way_just_empties_it_and_a_bound_that_is_larger_overdraws(law: type[Element], empties: bool) -> None:
    """(b/T) dx^2 - f dx is least at dx = f T / (2 b), and then -f^2 T / (4 b)."""
    damping, one = 0.1, controller({"kind": "force-bounding", "acts": "always"}, KINDS | {"force-bounding": law})
    x, places, forces = -1.02, [-1.0], []
    for _ in range(50):
        (force,) = one.answer([(x,)])
        places.append(x)
        forces.append(force)
        x = x + (force * T / (2.0 * damping) if len(places) > 6 else -1e-3)
    energy = np.cumsum(damping / T * np.diff(places[1:]) ** 2 - np.array(forces[:-1]) * np.diff(places[1:]))
    filled = energy.max()
    assert filled > 1e-6
    if empties:
        assert energy.min() >= -1e-12 * filled
        assert abs(energy[-1]) <= 1e-12 * filled
    else:
        assert energy.min() < -0.01 * filled


# Closed limits


def spectral_radius(response: np.ndarray, mass: float) -> float:
    """Of a free mass whose held force is response[0] x[k] + response[1] x[k-1]."""
    here, before = response / mass
    half = T * T / 2
    one_tick = np.array([[1 + half * here, T, half * before], [T * here, 1, T * before], [1, 0, 0]])
    return float(np.abs(np.linalg.eigvals(one_tick)).max())


@pytest.mark.parametrize("t", [0.6, 0.75, 1.0, 1.5, 3.0])
def test_the_input_to_state_stable_force_steadies_a_spring_up_to_its_closed_limit(t: float) -> None:
    """K T^2 / m < (4 t - 2) / (t (1 + 2 t)), from what the controller answers to a push of the position."""
    mass = 0.05
    limit = (4 * t - 2) / (t * (1 + 2 * t)) * mass / T**2

    def response(stiffness: float) -> np.ndarray:
        element = {"kind": "force-rate", "time": t * T}
        rows = [answered(np.array([-2.0, -2.0, -2.0 + by, -2.0]), element, stiffness=stiffness) for by in (0.0, 0.5)]
        return ((rows[1]["total"] - rows[0]["total"]) / 0.5)[2:]

    assert spectral_radius(response(limit * (1 - 1e-8)), mass) < 1.0
    assert spectral_radius(response(limit * (1 + 1e-8)), mass) > 1.0
    assert spectral_radius(np.array([-0.01 * limit, 0.0]), mass) > 1.0


def test_the_input_to_state_stable_force_pulls_for_one_tick_where_a_wall_is_left() -> None:
    x = np.array([-1.003, -1.003, -0.999, -0.998])
    assert answered(x, {"kind": "force-rate", "time": T, "acts": "always"})["total"][2:].tolist() == [
        pytest.approx(-6.0),
        0.0,
    ]


def left_swinging(of_device: float, stiffness: float, **coupling: float) -> float:
    """Width of the swing that is left, in m, three seconds after the device came upon a wall and was pressed on."""
    made = scene(
        duration=3.0,
        device={"mass": 0.05, "damping": of_device, "position": 0.002},
        hand={"mass": 0.01, "stiffness": 10.0, "damping": 0.0, "force": {"kind": "constant", "value": -2.0}},
        wall={"position": 0.0, "stiffness": stiffness},
        dissipation=[{"kind": "virtual-coupling", "acts": "always", "stiffness": 1000.0, **coupling}],
    )
    return alone(made)["window"]["oscillation_m"]


@pytest.mark.slow
def test_a_virtual_coupling_rests_on_soft_and_rigid_walls_if_the_device_damps_more_than_half_kc_t_and_bc() -> None:
    for stiffness in (1e3, 1e6):
        assert left_swinging(0.9, stiffness, mass=0.01) < 1e-5
        assert left_swinging(0.9, stiffness, damping=0.2, mass=0.01) < 1e-5
    assert left_swinging(0.9, 1e6, damping=0.2, mass=0.01, world_ticks=20) < 1e-5
    assert left_swinging(0.45, 1e6, mass=0.01) > 1e-3
    assert left_swinging(0.45, 1e6, mass=0.01, world_ticks=20) > 1e-3


@pytest.mark.parametrize("ticks", [1, 2, 20])
def test_in_free_motion_a_tool_that_steps_slowly_drags_like_damping_of_half_kc_times_the_step_less_a_tick(
    ticks: int,
) -> None:
    x = 0.5 + 0.01 * T * np.arange(1001.0)
    coupling = {"kind": "virtual-coupling", "acts": "always", "stiffness": 800.0, "damping": 0.3, "mass": 0.004}
    force = answered(x, {**coupling, "world_ticks": ticks})["total"][800:1000]
    assert force.mean() == pytest.approx(-800.0 * (ticks - 1) * T / 2 * 0.01, rel=1e-6, abs=1e-10)


def test_a_virtual_coupling_shows_no_more_stiffness_than_its_own_and_the_walls_in_a_row() -> None:
    x = np.linspace(-0.999, -1.004, 4000)
    rows = answered(
        np.append(x, np.full(3000, x[-1])),
        {"kind": "virtual-coupling", "acts": "always", "stiffness": 1000.0, "damping": 0.5, "mass": 0.01},
    )
    both = 1.0 / (1.0 / 1000.0 + 1.0 / STIFFNESS)
    assert rows["total"][-1] == pytest.approx(both * 0.004, rel=1e-6)
    assert not math.isclose(rows["wall"][-1], rows["total"][-1], rel_tol=0.1)
