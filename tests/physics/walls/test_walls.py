"""Walls that are no springs: taps beside programs of each law, closed forms of speed, energy and stability."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy

from haploop.launch.scene.file import load
from haploop.logger.books.ideal_wall import dissipated
from haploop.protocol.scene.scene import Wall as WallTable
from haploop.protocol.walls.hunt_crossley import HuntCrossley, power
from haploop.protocol.walls.kelvin_voigt import KelvinVoigt
from haploop.protocol.walls.registry import all_walls, make_wall
from haploop.protocol.walls.wall import Wall
from haploop.tools.linear.bounds import bounds_of
from haploop.tools.linear.one_tick import NotLinear, OneTickMap
from haploop.tools.linear.terms import modes
from helpers.runs.batches import alone, pressed, together
from helpers.scenes.least import mistakes, scene
from oracles.wall_laws import Law, crossley, damped, leaving_speed, ridged, tap

T, MASS, SPEED, HEIGHT, STIFFNESS, TICKS = 1e-3, 0.05, 0.2, 0.0101, 2000.0, 120
OWN: dict[str, dict[str, Any]] = {
    "kelvin-voigt": {"damping": 3.0},
    "hunt-crossley": {"damping_factor": 1.5, "exponent": 1.75, "depth": 2e-3},
    "texture": {"ridge_force": 0.4, "ridge_spacing": 2.5e-4},
}
LAWS: dict[str, Law] = {
    "kelvin-voigt": damped(STIFFNESS, 3.0),
    "hunt-crossley": crossley(STIFFNESS, 1.5, 1.75, 2e-3),
    "texture": ridged(STIFFNESS, 0.4, 2.5e-4),
}


def wall(kind: str, **own: Any) -> dict[str, Any]:
    return {"kind": kind, "position": 0.0, "stiffness": STIFFNESS, **OWN[kind], **own}


def tapped(table: dict[str, Any], *, period: float = T, late: int = 0, above: bool = False) -> dict[str, Any]:
    """The summary of a tap of a free mass, from below onto a wall above where that is asked for."""
    side = -1.0 if above else 1.0
    device = {"mass": MASS, "damping": 0.0, "position": side * HEIGHT, "velocity": -side * SPEED}
    rate = round(1 / period)
    clock = {"plant_rate": max(10_000, rate), "control_rate": rate, "round_trip_delay": late * period}
    facing = table | {"occupies": "above" if above else "below"}
    return alone(scene(duration=TICKS * T, clock=clock, device=device, wall=facing))


@pytest.mark.parametrize("late", [0, 1])
@pytest.mark.parametrize("kind", OWN)
def test_a_tap_ends_at_the_speed_and_with_the_energy_of_another_program_of_its_law(kind: str, late: int) -> None:
    summary = tapped(wall(kind), late=late)
    by_hand = tap(LAWS[kind], mass=MASS, height=HEIGHT, speed=SPEED, period=T, ticks=TICKS, late=late)
    energy = summary["energy"]
    assert max(by_hand.depth) > 5e-4
    assert summary["final"]["v_m_s"] == pytest.approx(by_hand.speed, rel=1e-9)
    assert energy["wall"]["sampled_J"] == pytest.approx(by_hand.taken_J(), rel=1e-9)
    assert energy["wall"]["true_J"] == pytest.approx(MASS / 2 * (SPEED**2 - by_hand.speed**2), rel=1e-9)
    assert energy["residual_J"] < 1e-12 * energy["moved_J"]
    assert tapped(wall(kind), late=late, above=True)["final"]["v_m_s"] == -summary["final"]["v_m_s"]


@pytest.mark.parametrize(("exponent", "factor"), [(1.0, 0.5), (1.5, 2.0), (2.25, 6.0)])
def test_in_continuous_time_a_mass_leaves_hunt_and_crossley_at_one_speed_whatever_mass_stiffness_and_exponent(
    exponent: float, factor: float
) -> None:
    """By Runge-Kutta of order 8 on the law itself."""
    law = HuntCrossley(0.0, STIFFNESS * exponent, 1.0, factor, exponent)
    mass = 0.02 * exponent

    def rates(_t: float, state: np.ndarray) -> list[float]:
        return [state[1], -float(law.push(max(float(state[0]), 0.0), float(state[1]))) / mass]

    def is_left(t: float, state: np.ndarray) -> float:
        return state[0] if t > 1e-5 else 1.0

    setattr(is_left, "terminal", True)  # noqa: B010  scipy reads it there
    found = scipy.integrate.solve_ivp(rates, (0.0, 1.0), [0.0, SPEED], "DOP853", events=is_left, rtol=1e-12, atol=1e-15)
    assert -found.y[1, -1] == pytest.approx(leaving_speed(SPEED, factor), rel=1e-8)


def test_sampled_it_leaves_faster_by_what_shrinks_with_the_period_and_the_books_say_by_what() -> None:
    """True = held (none is left) + taken by the law + leak, and the leak vanishes with T."""
    slow = leaving_speed(SPEED, 1.5)
    leaks, faster = [], []
    for period in (1e-3, 1e-4, 1e-5):
        summary = tapped(wall("hunt-crossley"), period=period)
        of_wall, speed = summary["energy"]["wall"], summary["final"]["v_m_s"]
        leaks.append(-of_wall["leak"]["total_J"])
        assert abs(of_wall["ideal_J"]) < 1e-15
        assert of_wall["true_J"] == pytest.approx(of_wall["dissipated_J"] - leaks[-1], rel=1e-12)
        assert of_wall["leak"]["quantisation_J"] + of_wall["leak"]["sampling_and_hold_J"] == pytest.approx(-leaks[-1])
        faster.append(speed - slow)
    assert leaks[0] > 5.0 * leaks[1] > 25.0 * leaks[2] > 0.0
    assert faster[0] > 5.0 * faster[1] > 25.0 * faster[2] > 0.0
    assert speed == pytest.approx(slow, rel=2e-3)
    assert of_wall["dissipated_J"] == pytest.approx(MASS / 2 * (SPEED**2 - slow**2), rel=3e-3)


@pytest.mark.parametrize("kind", all_walls())
def test_what_a_wall_stores_is_the_integral_of_what_it_pushes_at_rest(kind: str) -> None:
    law = make_wall(scene(wall={"kind": kind, "position": 0.0, "stiffness": 300.0, **OWN.get(kind, {})}).wall)
    for depth in (1e-4, 7e-4, 3.3e-3):
        whole = scipy.integrate.quad(lambda p: float(law.held(p)), 0.0, depth, limit=400, epsabs=1e-15)[0]
        assert law.stored(depth) == pytest.approx(whole, rel=1e-8)
        assert law.stored_between(1e-4, depth) == pytest.approx(law.stored(depth) - law.stored(1e-4), abs=1e-18)
        assert law.held(depth) == pytest.approx(law.push(depth, 0.0), rel=1e-14)


@pytest.mark.parametrize("kind", ["kelvin-voigt", "hunt-crossley"])
def test_a_wall_with_damping_never_pulls_however_fast_it_is_left(kind: str) -> None:
    law = make_wall(scene(wall=wall(kind)).wall)
    speeds = np.array([-1e6, -10.0, -1.0, -0.5, 0.0, 0.5])
    pushes = law.push(np.full_like(speeds, 1e-3), speeds)
    assert (pushes >= 0.0).all()
    assert pushes[0] == 0.0
    assert pushes[-1] > law.held(1e-3)


def test_powers_have_the_bits_of_roots_and_products_and_are_those_of_the_library_but_for_the_last() -> None:
    base = np.geomspace(1e-6, 50.0, 200)
    for exponent in np.arange(4, 16) / 4.0:
        found = power(base, exponent)
        np.testing.assert_allclose(found, base**exponent, rtol=2e-15)
        assert found.tolist() == [power(one, float(exponent)) for one in base.tolist()]


SINE: list[tuple[Wall, Callable[[float, float], float]]] = [
    (KelvinVoigt(0.0, 0.0, 1.0, 2.0), lambda _p, v: 2.0 * max(v, 0.0)),
    (HuntCrossley(0.0, 500.0, 1.0, 3.0, 1.0), lambda p, v: 500.0 * p * 3.0 * v),
    (HuntCrossley(0.0, 500.0, 1.0, 3.0, 2.0, 1e-3), lambda p, v: 500.0e3 * p * p * 3.0 * v),
]


@pytest.mark.parametrize(("law", "damper"), SINE)
def test_what_a_law_takes_of_a_motion_is_the_integral_along_it_from_surface_to_surface(
    law: Wall, damper: Callable[[float, float], float]
) -> None:
    """In and out along a sine, whose zeros are no plant steps."""
    depth_m, turn, step_s = 1.3e-3, 2 * np.pi * 11.0, 1e-4
    t = np.arange(600) * step_s + 0.371e-4
    x, v = depth_m * np.sin(turn * t), depth_m * turn * np.cos(turn * t)

    def power_W(s: float) -> float:
        p, rate = depth_m * np.sin(turn * s), depth_m * turn * np.cos(turn * s)
        return damper(p, rate) * rate if p > 0.0 else 0.0

    quarters = np.arange(1, 5) * np.pi / turn / 2.0
    edges = [t[0], *quarters[quarters < t[-1]], t[-1]]
    whole = sum(scipy.integrate.quad(power_W, *ends)[0] for ends in pairwise(edges))
    assert dissipated(law, x, v, step_s).sum() == pytest.approx(whole, rel=1e-7)


def test_a_change_in_contact_is_no_leak_but_what_it_puts_into_the_potential() -> None:
    """K p^(n+1) / (n + 1), from n = 1.75 to n = 3, and the block of the log begins anew."""
    push = {"kind": "ramp", "value": -1.0, "rise_time": 0.01}
    hand = {"mass": 0.01, "damping": 10.0, "stiffness": 1.0, "force": push}
    change = {"at": 0.3, "set": {"wall.exponent": 3.0, "wall.damping_factor": 0.0}}
    made = scene(duration=0.5, hand=hand, wall=wall("hunt-crossley"), event=[change])
    summary, before = alone(made), alone(scene(duration=0.3, hand=hand, wall=wall("hunt-crossley")))
    depth = -before["final"]["x_m"]
    share = depth / 2e-3
    held = [STIFFNESS * 2e-3 * share**n * depth / (n + 1) for n in (1.75, 3.0)]
    of_wall = summary["energy"]["wall"]
    assert of_wall["changes_J"] == pytest.approx(held[1] - held[0], rel=1e-9)
    assert summary["energy"]["residual_J"] < 1e-12 * summary["energy"]["moved_J"]
    assert together([made, made]) == [summary, summary]


@pytest.mark.parametrize("kind", OWN)
def test_members_of_a_batch_have_the_bits_of_each_alone_and_may_differ_in_all_numbers(kind: str) -> None:
    tables = [{**wall(kind), "stiffness": 150.0 + 40.0 * i, "position": -0.002} for i in range(3)]
    for table in tables[1:]:
        table |= {name: value * 1.25 for name, value in OWN[kind].items() if name != "exponent"}
    if kind == "hunt-crossley":
        tables[2]["exponent"] = 2.5
    scenes = [pressed(wall=table) for table in tables]
    assert together(scenes) == [alone(one) for one in scenes]


@pytest.mark.parametrize("beta", [1e-4, 0.02, 0.3, 0.414, 0.9])
def test_a_sampled_damped_spring_on_a_free_mass_is_stable_in_its_exact_range(beta: float) -> None:
    """K T^2 / (4 m) < beta (1 - beta) / (1 + beta), beta = B T / (2 m), by Jury's criterion on
    z (z - 1)^2 + (z + 1) (k z + beta (z - 1)); for little damping K < 2 B / T."""
    made = scene(
        device={"mass": MASS, "damping": 0.0},
        wall={"kind": "kelvin-voigt", "position": 0.0, "stiffness": 1.0, "damping": 2 * MASS * beta / T},
    )
    limit = OneTickMap.from_scene(made).stiffness_limit()
    assert limit == pytest.approx(4 * MASS / T**2 * beta * (1 - beta) / (1 + beta), rel=1e-8)


def test_its_passivity_is_that_of_colgate_and_schenkel_and_a_bound_of_springs_alone_does_not_apply() -> None:
    """b > K T / 2 + B."""
    device = {"mass": MASS, "damping": 5.0}
    made = scene(device=device, wall={"kind": "kelvin-voigt", "position": 0.0, "stiffness": 1.0, "damping": 3.0})
    known = {bound.name: bound for bound in bounds_of(made)}
    assert known["Colgate & Schenkel 1997"].stiffness_N_m == pytest.approx(2 * (5.0 - 3.0) / T, rel=1e-8)
    assert not known["Exact, no delay"].applies


def test_what_swings_on_a_damped_spring_is_damped_by_it_too_and_nothing_is_told_of_a_wall_of_no_one_stiffness() -> None:
    """f = sqrt(K / m) / 2 pi; damping ratio (b + B) / (2 sqrt(K m))."""
    device = {"mass": MASS, "damping": 5.0}
    (mode,) = modes(scene(device=device, wall=wall("kelvin-voigt")))
    assert mode.frequency_Hz == pytest.approx((STIFFNESS / MASS) ** 0.5 / (2 * np.pi), rel=1e-12)
    assert mode.damping_ratio == pytest.approx(8.0 / (2 * (STIFFNESS * MASS) ** 0.5), rel=1e-12)
    assert modes(scene(device=device, wall=wall("texture"))) == []


@pytest.mark.parametrize("kind", ["hunt-crossley", "texture"])
def test_a_wall_whose_stiffness_changes_with_the_depth_has_no_limit_and_says_so(kind: str) -> None:
    with pytest.raises(NotLinear, match=f"also has a wall of the kind {kind}"):
        OneTickMap.from_scene(scene(wall=wall(kind)))


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ({"kind": "kelvin-voigt"}, "wall.damping is missing. A wall of the kind kelvin-voigt needs a number in N s/m"),
        ({"damping": 1.0}, "wall.damping is 1.0. It is used only with a wall of the kind kelvin-voigt."),
        (
            {"kind": "texture", **OWN["kelvin-voigt"]},
            "wall.damping is 3.0. It is used only with a wall of the kind kelvin-voigt",
        ),
        (OWN["hunt-crossley"] | {"kind": "hunt-crossley", "exponent": 1.3}, "It must be a multiple of 0.25."),
        ({"kind": "hunt"}, 'wall.kind is "hunt"; did you mean hunt-crossley? Allowed: spring, kelvin-voigt'),
    ],
)
def test_a_wall_with_the_wrong_keys_is_refused_with_a_sentence(table: dict[str, Any], said: str) -> None:
    assert any(said in line for line in mistakes(wall={"position": 0.0, "stiffness": 1.0, **table}))


def test_another_kind_laid_over_a_wall_keeps_where_and_how_stiff_it_is_and_drops_the_rest(tmp_path: Path) -> None:
    (tmp_path / "below.toml").write_text(
        'duration = 1.0\n[device]\nmass = 0.1\ndamping = 1.0\n[wall]\nkind = "kelvin-voigt"\ndamping = 2.0\n'
        "position = -0.01\nstiffness = 70.0\n"
    )
    found = load(tmp_path / "below.toml", ["wall.kind=texture", "wall.ridge_force=1.0", "wall.ridge_spacing=1e-3"])
    assert found.wall == WallTable.from_dict(
        {"kind": "texture", "position": -0.01, "stiffness": 70.0, "ridge_force": 1.0, "ridge_spacing": 1e-3}
    )


def test_what_takes_the_wall_for_a_spring_refuses_any_other() -> None:
    coupling = {"kind": "virtual-coupling", "stiffness": 100.0, "mass": 0.01}
    expected = 'It must be "spring" with the element virtual-coupling, which is given only a stiffness.'
    assert any(expected in line for line in mistakes(wall=wall("texture"), dissipation=[coupling]))
    swap = {"at": 0.1, "swap": coupling}
    assert any(expected in line for line in mistakes(wall=wall("texture"), event=[swap]))
