"""The one-tick map of every linear loop: against runs of the program, closed forms, and other ways to compute it."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import Annotated, Any

import numpy as np
import pytest

from haploop.controller.dissipation import Element, Motion, Quantity
from haploop.protocol.scene.paths import value_at, with_value
from haploop.protocol.scene.scene import ElementTable, Scene
from haploop.tools.linear.linearity import is_linear, left_out, why_not_linear
from haploop.tools.linear.one_tick import NeverStable, OneTickMap
from haploop.tools.linear.stiffness_limit import pressed_deep, smooth, stiffness_limit
from helpers.runs.captured import run
from helpers.scenes.effect_tables import slowly
from helpers.scenes.least import KINDS, scene
from helpers.scenes.linear_scenes import linear_scene
from oracles.one_tick_map import growth_of

SEEDS = range(24)


def limit_or_soft(loop: OneTickMap) -> float:
    """The limit, or some stiffness where there is none."""
    ranges = loop.stable_ranges()
    return ranges[0][1] if ranges else 50.0


def positions(pressed: Scene) -> np.ndarray:
    """x at the ticks of a contact, after the push has set in and every memory has filled."""
    ran = run(replace(pressed, duration=400 / pressed.clock.control_rate))
    assert ran.controller["in_contact"].all()
    return ran.plant["x"][:: len(ran.plant["x"]) // (len(ran.controller["x"]))][60:360]


def unexplained(x: np.ndarray, growths: np.ndarray) -> float:
    """What of a motion is no sum of powers g^k of these numbers and a constant, over its size."""
    k = np.arange(len(x))
    powers = np.column_stack([np.ones(len(x)), *(g**k for g in growths if abs(g) > 1e-6)])
    columns = np.hstack([powers.real, powers.imag])
    columns = columns / np.maximum(np.abs(columns).max(axis=0), 1e-300)
    swings = x - x.mean()
    fitted = columns @ np.linalg.lstsq(columns, swings, rcond=1e-14)[0]
    return float(np.abs(swings - fitted).max() / np.abs(swings).max())


@pytest.mark.parametrize("seed", [*SEEDS[::4], *slowly(seed for at, seed in enumerate(SEEDS) if at % 4)])
def test_a_run_in_contact_moves_by_the_eigenvalues_of_its_map_and_by_no_others(seed: int) -> None:
    made = linear_scene(seed)
    loop = OneTickMap.from_scene(made)
    stiffness = 0.97 * limit_or_soft(loop)
    x = positions(pressed_deep(made, stiffness))
    assert unexplained(x, np.linalg.eigvals(loop.matrix(stiffness))) < 1e-7
    assert unexplained(x, np.linalg.eigvals(loop.matrix(1.02 * stiffness))) > 1e-5


PLAIN = {"device": {"mass": 0.05, "damping": 0.3}, "hand": {"stiffness": 40.0}, "clock": {"round_trip_delay": 0.0013}}
INERTIA = {"kind": "bidirectional-inertia", "mass": 0.004}
LINEAR = {
    "inertia by differences": {"dissipation": [INERTIA]},
    "inertia by an accelerometer": {"acceleration": {"source": "accelerometer"}, "dissipation": [INERTIA]},
    "inertia by a real accelerometer": {
        "acceleration": {"source": "accelerometer", "cutoff": 150.0},
        "accelerometer": {"bandwidth": 420.0, "delay": 0.0014},
        "dissipation": [INERTIA, INERTIA],
    },
    "low-passed": {
        "velocity": {"cutoff": 100.0},
        "acceleration": {"cutoff": 60.0},
        "dissipation": [INERTIA, {"kind": "damping", "damping": 0.3}],
    },
    "a window": {
        "velocity": {"estimator": "window", "ticks": 5},
        "acceleration": {"estimator": "window", "ticks": 3},
        "dissipation": [INERTIA, {"kind": "damping", "damping": 0.2}],
    },
    "a Kalman filter": {
        "velocity": {"estimator": "kalman", "jerk_density": 2e3, "measurement_noise": 3e-6},
        "acceleration": {"source": "kalman"},
        "dissipation": [INERTIA, {"kind": "damping", "damping": 0.2}],
    },
}


@pytest.mark.parametrize("tables", LINEAR.values(), ids=LINEAR)
@pytest.mark.parametrize("of_limit", [0.97, 1.0, 1.03])
def test_a_run_grows_by_the_spectral_radius(tables: dict[str, Any], of_limit: float) -> None:
    made = scene(**PLAIN, **tables)
    loop = OneTickMap.from_scene(made)
    stiffness = of_limit * loop.stiffness_limit()
    pressed = pressed_deep(made, 0.97 * loop.stiffness_limit())
    for key, value in {
        "wall.stiffness": stiffness,
        "hand.force.value": value_at(pressed, "hand.force.value") * (of_limit / 0.97),
        "duration": 0.8,
    }.items():
        pressed = with_value(pressed, key, value)
    assert growth_of(run(pressed)) == pytest.approx(loop.growth(stiffness), abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("tables", LINEAR.values(), ids=LINEAR)
def test_runs_on_either_side_confirm_the_limit(tables: dict[str, Any]) -> None:
    assert stiffness_limit(scene(**PLAIN, **tables), KINDS).confirmed


@pytest.mark.parametrize("seed", [*range(8), *slowly(range(8, 40))])
def test_the_stable_ranges_are_those_that_a_fine_grid_of_stiffnesses_shows(seed: int) -> None:
    loop = OneTickMap.from_scene(linear_scene(seed))
    ranges = loop.stable_ranges()
    for stiffness in np.geomspace(1e-2, 1e7, 150):
        inside = any(low <= stiffness <= high for low, high in ranges)
        assert (loop.growth(stiffness) < 1.0) == inside, stiffness
    for low, high in ranges:
        assert loop.growth(high) < 1.0 <= loop.growth(math.nextafter(high, math.inf))
        assert low == 0.0 or loop.growth(low) < 1.0 <= loop.growth(math.nextafter(low, 0.0))
    assert all(before[1] < after[0] for before, after in pairwise(ranges))


def test_stability_may_return_above_the_limit_and_the_limit_is_the_first() -> None:
    loop = OneTickMap.from_scene(linear_scene(12))
    (_, limit), (low, high) = loop.stable_ranges()
    assert loop.stiffness_limit() == limit < low < high
    assert loop.growth((limit + low) / 2.0) > 1.0 > loop.growth((low + high) / 2.0)


def test_a_loop_that_is_never_stable_is_told_from_one_that_is_when_stiff() -> None:
    with pytest.raises(NeverStable, match="it needs damping"):
        OneTickMap.from_scene(scene(dissipation=[{"kind": "bidirectional-inertia", "mass": 1.0}])).stiffness_limit()


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_virtual_inertia_read_without_delay_is_stable_up_to_the_mass_of_the_device(share: float) -> None:
    """u[k] = -m a[k], a[k] = u[k-1] / m_d when nothing else acts: it grows by m / m_d a tick."""
    loop = OneTickMap.from_scene(
        scene(
            device={"mass": 0.02, "damping": 1e-9},
            acceleration={"source": "accelerometer"},
            dissipation=[{"kind": "bidirectional-inertia", "mass": 0.02 * share}],
        )
    )
    growths = np.linalg.eigvals(loop.matrix(0.0))
    assert np.abs(growths + share).min() < 1e-7


@pytest.mark.parametrize("factors", [(0.5, 0.5), (0.2, 0.3, 0.5)])
def test_elements_add_up_in_the_map(factors: tuple[float, ...]) -> None:
    split = [{"kind": kind, name: 0.05 * f} for kind, name in ELEMENTS for f in factors]
    whole = [{"kind": kind, name: 0.05} for kind, name in ELEMENTS]
    one, many = (OneTickMap.from_scene(scene(dissipation=elements)) for elements in (whole, split))
    assert many.matrix(100.0) == pytest.approx(one.matrix(100.0), abs=1e-12)


ELEMENTS = [("damping", "damping"), ("bidirectional-inertia", "mass")]


@pytest.mark.parametrize("acts", ["always", "in-contact"])
@pytest.mark.parametrize("occupies", ["below", "above"])
def test_in_contact_it_is_one_which_side_the_wall_is_on_and_when_elements_act(acts: str, occupies: str) -> None:
    wall = {"position": 0.01, "stiffness": 10.0, "occupies": occupies}
    elements = [{"kind": "damping", "damping": 0.1, "acts": acts}]
    loops = [OneTickMap.from_scene(scene(dissipation=elements, **tables)) for tables in ({}, {"wall": wall})]
    assert loops[0].matrix(70.0).tolist() == loops[1].matrix(70.0).tolist()


class Lagging(Element):
    """Damping with a memory of its own."""

    kind = "lagging"
    linear = True
    memory = 0.0
    damping: Annotated[float, Quantity("N s/m", at_least=0)]

    def force(self, motion: Motion, memory: Any) -> Any:
        v = memory + 0.2 * (motion.v - memory)
        return -self.damping * v, v


class Hoarding(Element):
    """One that keeps its memory in an attribute of its own."""

    kind = "hoarding"
    linear = True
    damping: Annotated[float, Quantity("N s/m", at_least=0)]

    def __post_init__(self) -> None:
        self.v = 0.0

    def force(self, motion: Motion) -> Any:
        self.v = self.v + 0.2 * (motion.v - self.v)
        return -self.damping * self.v


class Capped(Lagging):
    """One that does not say that it is linear."""

    kind = "capped"
    linear = False


def test_an_element_of_a_plugin_that_says_it_is_linear_brings_its_memory_into_the_map() -> None:
    """A gain of 0.2 a tick is that of a velocity low-passed at -ln(0.8) / (2 pi T)."""
    lagging = replace(scene(), dissipation=(ElementTable(name="lagging", parameters={"damping": 0.2}),))
    filtered = scene(
        velocity={"cutoff": -math.log(0.8) * 1000.0 / math.tau}, dissipation=[{"kind": "damping", "damping": 0.2}]
    )
    ours, theirs = OneTickMap.from_scene(lagging, KINDS | {"lagging": Lagging}), OneTickMap.from_scene(filtered)
    assert ours.growth(80.0) == pytest.approx(theirs.growth(80.0), abs=1e-12)
    assert ours.stiffness_limit() == pytest.approx(theirs.stiffness_limit(), rel=1e-9)


@pytest.mark.parametrize(
    ("tables", "culprits"),
    [
        ({}, []),
        ({"friction": {"kinetic": 0.1}, "jitter": {"kind": "uniform", "most": 0.001}}, ["[friction]", "[jitter]"]),
        ({"velocity": {"estimator": "foaw", "ticks": 4, "bound": 1e-5}}, ['velocity.estimator = "foaw"']),
        ({"clock": {"integrator": "euler"}}, ['clock.integrator = "euler"']),
        ({"clock": {"integrator": "dop853"}}, []),
        ({"encoder": {"resolution": 1e-5}, "noise": {"deviation": 1e-6, "cutoff": 50.0}}, []),
        (
            {"dissipation": [{"kind": "unidirectional-damping", "damping": 0.1}] * 2},
            ["the element unidirectional-damping"],
        ),
    ],
)
def test_what_makes_a_loop_no_linear_map_is_named(tables: dict[str, Any], culprits: list[str]) -> None:
    made = scene(**tables)
    assert why_not_linear(made) == culprits
    assert is_linear(made) == (not culprits)


@pytest.mark.parametrize("element", [Capped, Hoarding])
def test_an_element_is_not_taken_for_linear_unless_it_says_so_and_declares_its_memory(element: type[Element]) -> None:
    table = ElementTable(name=element.kind, acts="always", parameters={"damping": 0.2})
    made = replace(scene(), dissipation=(table,))
    assert why_not_linear(made, KINDS | {element.kind: element}) == [f"the element {element.kind}"]


def test_what_the_map_leaves_out_is_named_and_gone_from_the_smooth_scene() -> None:
    made = scene(
        encoder={"resolution": 1e-5},
        velocity={"estimator": "kalman", "jerk_density": 2e3, "accelerometer": True},
        accelerometer={"noise_density": 3e-3, "bandwidth": 400.0, "range": 20.0},
        actuator={"saturation": 3.0, "bandwidth": 500.0},
        dissipation=[{"kind": "damping", "damping": 0.1}],
    )
    named = ["[encoder]", "accelerometer.noise_density", "accelerometer.range", "actuator.saturation"]
    assert left_out(made) == named
    assert left_out(smooth(made)) == []
    assert OneTickMap.from_scene(smooth(made)).matrix(50.0) == pytest.approx(
        OneTickMap.from_scene(made).matrix(50.0), abs=1e-12
    )
