"""Bodies in a row move as their closed forms and an independent integration say, alone and in the loop."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from haploop.protocol.scene.paths import with_value
from helpers.runs.captured import Captured, bodies, run
from helpers.scenes.effect_tables import slowly
from helpers.scenes.least import scene
from helpers.slowly import first_and_slowly
from oracles.chain_map import ChainLoop
from oracles.effects_run import EffectsTruth, follow, simulate
from oracles.one_tick_map import growth_of

MEASURED_TICKS = 400
CABLE = {"motor_mass": 0.02, "stiffness": 5e4}
GRIP = {"stiffness": 600.0, "damping": 2.0}


# Closed forms


@pytest.mark.parametrize(("tip_kg", "stiffness"), [(0.05, 5e4), (1e-3, 2e5), (2.0, 30.0)])
def test_two_masses_on_a_cable_swing_at_their_mode_while_their_centre_goes_with_the_force(tip_kg, stiffness):
    """s = (F/k) m_1/(m_1+m_2) (1 - cos wt), w^2 = k (1/m_1 + 1/m_2); centre F t^2 / 2 (m_1+m_2)."""
    force, motor_kg = 0.01, 0.02
    both = motor_kg + tip_kg
    ran = run(
        scene(
            duration=0.25,
            diverged_beyond=100.0,
            device={"mass": tip_kg, "damping": 0.0},
            hand={"force": {"kind": "constant", "value": force}},
            transmission={"motor_mass": motor_kg, "stiffness": stiffness},
        )
    )
    t = np.arange(2_501) / 10_000
    w = math.sqrt(stiffness * (1 / motor_kg + 1 / tip_kg))
    stretch = force / stiffness * motor_kg / both * (1 - np.cos(w * t))
    motor = force * t**2 / (2 * both) - tip_kg / both * stretch
    assert ran.plant["cable.stretch"] == pytest.approx(stretch, rel=0, abs=1e-9 * stretch.max())
    assert ran.plant["x"] == pytest.approx(motor, rel=1e-9, abs=1e-9 * stretch.max())
    assert ran.relative_residual < 1e-12


@pytest.mark.parametrize("duration_s", first_and_slowly(2.0, 20.0))
def test_an_undamped_chain_of_three_keeps_its_energy_to_1e_13_however_many_steps_it_takes(duration_s: float):
    ran = run(
        scene(
            duration=duration_s,
            device={"mass": 0.05, "damping": 0.0, "velocity": 0.05},
            hand={"mass": 0.2, "stiffness": 100.0, "grip": {"stiffness": 600.0}},
            transmission=CABLE,
        )
    )
    start = 0.27 * 0.05**2 / 2
    assert ran.energy["stored_J"] == pytest.approx(start, rel=1e-13)
    assert ran.relative_residual < 1e-13


@pytest.mark.parametrize("bandwidth", [80.0, *slowly([None])])
def test_a_pressed_chain_comes_to_rest_where_all_forces_are_in_balance(bandwidth):
    push, wall, hand = -0.7, 300.0, 80.0
    ran = run(
        scene(
            duration=6.0,
            clock={"round_trip_delay": 0.0003},
            device={"mass": 0.05, "damping": 1.0},
            hand={
                "mass": 0.1,
                "damping": 2.0,
                "stiffness": hand,
                "rest": 0.001,
                "grip": GRIP,
                "force": {"kind": "constant", "value": push},
            },
            transmission=CABLE | {"damping": 1.0, "motor_damping": 0.5},
            wall={"position": 0.0, "stiffness": wall},
            **({"actuator": {"bandwidth": bandwidth}} if bandwidth else {}),
        )
    )
    compliance = 1 / wall + 1 / CABLE["stiffness"] + 1 / GRIP["stiffness"]  # of all that stands under the hand
    end = (push + hand * 0.001) / (hand + 1 / compliance)  # the hand's position
    pressed = end / compliance
    expected = {"body 0": pressed / wall}
    expected["cable"] = expected["body 0"] + pressed / CABLE["stiffness"]
    expected["grip"] = end
    for name, x in bodies(ran).items():
        assert x[-1] == pytest.approx(expected[name], rel=1e-11)
    assert ran.summary["verdict"] == "no-swing-seen"
    springs = pressed**2 * (1 / CABLE["stiffness"] + 1 / GRIP["stiffness"]) + hand * (end - 0.001) ** 2
    assert ran.energy["stored_J"] == pytest.approx(springs / 2, rel=1e-9)


@pytest.mark.parametrize("what", ["cable", "grip", "actuator"])
def test_what_is_ten_times_stiffer_or_faster_is_ten_times_nearer_to_a_rigid_or_prompt_one(what):
    def end(size: float) -> float:
        push = {"kind": "minimum-jerk", "value": 0.5, "rise_time": 0.1}
        tables: dict[str, Any] = {
            "device": {"mass": 0.05, "damping": 0.5, "velocity": 0.05},
            "hand": {"mass": 0.02, "stiffness": 50.0, "force": push},
            "wall": {"position": 1e-3, "stiffness": 100.0, "occupies": "above"},
        }
        if what == "cable":
            tables["device"]["mass"] = 0.03 if size else 0.05
            tables |= {"transmission": {"motor_mass": 0.02, "stiffness": size, "damping": 20.0}} if size else {}
        elif what == "grip":
            tables["hand"] |= {"grip": {"stiffness": size, "damping": 20.0}} if size else {}
        elif size:
            tables["actuator"] = {"bandwidth": size}
        return float(run(scene(duration=0.2, **tables)).plant["x"][-1])

    errors = [abs(end(size) - end(0.0)) for size in (1e4, 1e5, 1e6)]
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=0.15)
    assert errors[1] / errors[2] == pytest.approx(10.0, rel=0.15)


# The loop: growth by the one-tick map


def held_deep(
    tables: dict[str, Any], delay: int, of_critical: float, virtual: float
) -> tuple[Captured, ChainLoop, float]:
    """A chain held around x = 0 of its first body, 0.1 m deep in a wall; the run, its map and the stiffness."""
    tables = {
        "clock": {"round_trip_delay": delay * 1e-4},
        "device": {"mass": 0.03, "damping": 0.1},
        "dissipation": [{"kind": "damping", "damping": virtual}] if virtual else [],
    } | tables
    loop = ChainLoop.of(scene(**tables))
    stiffness = of_critical * loop.critical_stiffness()
    load = -stiffness * 0.1
    links = tables.get("transmission"), tables["hand"].get("grip")
    compliance = sum(1 / link["stiffness"] for link in links if link)
    hand = tables["hand"] | {"rest": load * compliance}
    hand["force"] = {"kind": "step", "value": load, "at": delay * 1e-4}
    duration = (settled_at(loop, stiffness) + MEASURED_TICKS + 2) / 1000
    pressed = scene(**tables | {"hand": hand, "wall": {"position": 0.1, "stiffness": stiffness}, "duration": duration})
    return run(pressed), loop, stiffness


HAND = {"mass": 0.1, "damping": 2.0, "stiffness": 80.0}
DRIVE = {"transmission": CABLE | {"damping": 2.0, "motor_damping": 0.05}}
# Slack at the start, it must take the load before the wall has thrown the device out.
FIRM_GRIP = {"stiffness": 2e4, "damping": 5.0}
CHAINS: dict[str, dict[str, Any]] = {
    "transmission": {"hand": {"mass": 0.01, "damping": 0.3, "stiffness": 10.0}, **DRIVE},
    "grip": {"hand": HAND | {"grip": FIRM_GRIP}},
    "actuator": {"hand": {"stiffness": 10.0}, "actuator": {"bandwidth": 150.0}},
    "all": {"hand": HAND | {"grip": FIRM_GRIP}, "actuator": {"bandwidth": 150.0}, **DRIVE},
}


@pytest.mark.parametrize("chain", CHAINS)
@pytest.mark.parametrize("delay", [13, *slowly([0, 3, 10, 20, 50])])
@pytest.mark.parametrize(("of_critical", "virtual"), [(0.97, 0.0), (1.02, 0.05)])
def test_a_chain_deep_in_contact_grows_every_tick_by_the_spectral_radius_of_its_one_tick_map(
    chain, delay, of_critical, virtual
):
    ran, loop, stiffness = held_deep(CHAINS[chain], delay, of_critical, virtual)
    growth = growth_of(ran, settled_at(loop, stiffness), MEASURED_TICKS)
    assert growth == pytest.approx(loop.growth(stiffness), abs=1e-6)
    assert (growth > 1.0) == (of_critical > 1.0)
    assert ran.relative_residual < 1e-12


def settled_at(loop: ChainLoop, stiffness: float) -> int:
    """The tick by which every mode but the first pair has fallen to 1e-8 of it."""
    first, _, next_mode = loop.magnitudes(stiffness)[:3]
    return max(100, math.ceil(math.log(1e-8) / math.log(next_mode / first)))


# Any motion: against the reference


def assert_same_motion(ran: Captured, truth: EffectsTruth) -> None:
    for column, x in zip(truth.x.T, bodies(ran).values(), strict=True):
        assert x == pytest.approx(column, rel=0, abs=1e-9 * np.abs(column).max())
    v = truth.v[:, 0]
    assert ran.plant["v"] == pytest.approx(v, rel=0, abs=1e-8 * np.abs(v).max())


PRESSED: dict[str, Any] = {
    "duration": 0.1,
    "clock": {"round_trip_delay": 0.0013},
    "device": {"mass": 0.05, "damping": 0.1, "velocity": -0.1},
    "wall": {"position": -1e-3, "stiffness": 400.0},
    "dissipation": [{"kind": "damping", "damping": 0.3, "acts": "always"}],
}
PUSHED_HAND = HAND | {"rest": 1e-3, "force": {"kind": "sine", "amplitude": 1.0, "frequency": 9.0}}
FRICTION = {"friction": {"kinetic": 0.3, "breakaway": 0.4}}
LOOPS: dict[str, dict[str, Any]] = {
    "transmission": {**DRIVE, "hand": PUSHED_HAND},
    "grip": {"hand": PUSHED_HAND | {"grip": GRIP}},
    "actuator": {"hand": PUSHED_HAND, "actuator": {"bandwidth": 100.0}},
    "friction": {"hand": PUSHED_HAND, **FRICTION},
    "friction, transmission": {"hand": PUSHED_HAND, **DRIVE, **FRICTION},
    "friction, actuator": {"hand": PUSHED_HAND, "actuator": {"bandwidth": 100.0}, **FRICTION},
    "all": {"hand": PUSHED_HAND | {"grip": GRIP}, "actuator": {"bandwidth": 100.0}, **DRIVE, **FRICTION},
}


QUICK = ("all",)


@pytest.mark.slow
@pytest.mark.parametrize("loop", [*QUICK, *slowly(name for name in LOOPS if name not in QUICK)])
def test_every_body_moves_as_in_an_independent_program_of_the_whole_loop(loop):
    pressed = scene(**PRESSED | LOOPS[loop])
    assert_same_motion(run(pressed), simulate(pressed))


@pytest.mark.parametrize("mount", ["tip", "motor"])
@pytest.mark.parametrize(
    "table", [{"bandwidth": 400.0, "delay": 0.001}, *slowly([{}, {"bandwidth": 260.0}, {"delay": 0.0007}])]
)
def test_an_accelerometer_feels_what_the_independent_program_says(mount, table):
    sensed = PRESSED | LOOPS["friction, transmission"] | {"acceleration": {"source": "accelerometer"}}
    pressed = scene(**sensed | {"accelerometer": {"mount": mount, **table}, "duration": 0.03})
    ran, truth = run(pressed), simulate(pressed)
    assert truth.controller is not None
    felt = np.array([row[2] for row in truth.controller.rows])
    assert np.abs(felt).max() > 1.0
    assert ran.controller["a"] == pytest.approx(felt, rel=0, abs=1e-9 * np.abs(felt).max())


SLIDES = {"device": {"mass": 0.05, "damping": 0.0, "velocity": 0.5}, "friction": {"kinetic": 0.05 * 0.5 / 0.01995}}
SLIPS = {
    "device": {"mass": 0.05, "damping": 0.0},
    "hand": {"force": {"kind": "ramp", "value": 1.0, "rise_time": 1.0}},
    "friction": {"kinetic": 0.01, "breakaway": 0.01995},
}


@pytest.mark.parametrize("tables", [SLIDES, SLIPS], ids=["stops", "slips"])
def test_an_accelerometer_feels_a_stop_and_a_slip_within_the_very_step_before_the_tick(tables):
    """At 19.95 ms, in the last step before tick 20: at rest it feels no friction, in motion what moves it."""
    sensed = scene(**tables | {"duration": 0.021, "acceleration": {"source": "accelerometer"}})
    ran, truth = run(sensed), simulate(sensed)
    assert truth.controller is not None
    assert (ran.plant["v"][200] == 0.0) == (tables is SLIDES)
    assert ran.controller["a"] == pytest.approx([row[2] for row in truth.controller.rows], rel=1e-6, abs=1e-12)


@pytest.mark.slow
def test_under_late_and_lost_commands_too_the_bodies_move_as_these_forces_move_them():
    late = {"jitter": {"kind": "gamma", "mean": 0.001, "deviation": 0.001}, "loss": {"probability": 0.3}}
    pressed = scene(**PRESSED | LOOPS["all"] | late)
    ran = run(pressed)
    assert ran.summary["lost"]["commands_lost"] > 0
    assert_same_motion(ran, follow(pressed, ran.plant["force"][:-1].tolist()))


def test_the_comparison_sees_a_cable_a_part_in_a_million_softer():
    pressed = scene(**PRESSED | LOOPS["transmission"] | {"duration": 0.03})
    softer = with_value(pressed, "transmission.stiffness", 5e4 * (1 - 1e-6))
    with pytest.raises(AssertionError):
        assert_same_motion(run(pressed), simulate(softer))
