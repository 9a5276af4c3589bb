"""Effects at the limits: never a silent NaN, the books close, nothing free gains energy, and instability is named."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest

from haploop.controller.dissipation import Element, Motion
from haploop.protocol.scene.paths import without
from haploop.protocol.scene.scene import Hand, Scene
from helpers.runs.captured import Captured, run
from helpers.scenes.effect_tables import EFFECTS, slowly, subsets, tap
from helpers.scenes.least import KINDS, scene

FREE_EFFECTS = ("friction", "transmission", "grip", "accelerometer")


def assert_sound(ran: Captured) -> None:
    """Every number is one, and the books close."""
    for name, column in {**ran.plant, **ran.controller}.items():
        assert np.isfinite(column).all(), name
    assert ran.relative_residual < 1e-12 or ran.energy["moved_J"] == 0.0


def stored_at_steps(ran: Captured, resolved: Scene) -> np.ndarray:
    """Energy of motion and of all springs at every step, from the states alone."""
    device, hand, drive = resolved.device, resolved.hand or Hand(), resolved.transmission
    plant = ran.plant
    x, v = [plant["x"]], [plant["v"]]
    masses = [drive.motor_mass, device.mass] if drive else [device.mass]
    stored = np.zeros(len(plant["x"]))
    links = {"cable": drive, "grip": hand.grip}
    for name, link in links.items():
        if link:
            stored += link.stiffness * plant[f"{name}.stretch"] ** 2
            x.append(x[-1] + plant[f"{name}.stretch"])
            v.append(v[-1] + plant[f"{name}.rate"])
    if hand.grip:
        masses.append(hand.mass)
    else:
        masses[-1] += hand.mass
    stored += sum(mass * speed**2 for mass, speed in zip(masses, v, strict=True))
    return (stored + hand.stiffness * (x[-1] - hand.rest) ** 2) / 2


# A free plant


def free(effects: tuple[str, ...], **more: Any) -> Scene:
    """Nothing but friction and dampers acts: no wall, no element, no push."""
    return without(tap(effects, **more), "wall", "dissipation", "hand.force")


@pytest.mark.parametrize(
    "effects",
    [*subsets(1, 1, FREE_EFFECTS), *subsets(4, 4, FREE_EFFECTS), *slowly(subsets(2, 3, FREE_EFFECTS))],
    ids="+".join,
)
def test_a_free_plant_never_gains_energy_in_any_step(effects):
    loose = free(effects)
    ran = run(loose)
    stored = stored_at_steps(ran, loose)
    assert stored[-1] == pytest.approx(ran.energy["stored_J"], rel=1e-9)
    assert np.diff(stored).max() <= 1e-14 * stored[0]
    assert stored[-1] < 0.9 * stored[0]
    assert_sound(ran)


STIFF_CABLE = {"motor_mass": 1e-3, "stiffness": 1e7}
EXTREME: dict[str, dict[str, Any]] = {
    "a cable of 1e7 N/m on a motor of 1 g": {"transmission": STIFF_CABLE},
    "the same with friction": {"transmission": STIFF_CABLE, "friction": {"kinetic": 0.05, "breakaway": 0.07}},
    "the same enormously damped": {"transmission": STIFF_CABLE | {"damping": 1e4, "motor_damping": 10.0}},
    "a motor of a millionth of the tip": {"transmission": {"motor_mass": 5e-8, "stiffness": 1e4}},
    "a tip of a microgram": {"device": {"mass": 1e-9, "damping": 1e-6}, "transmission": STIFF_CABLE},
    "a hand of a tonne": {"hand": {"mass": 1e3, "grip": {"stiffness": 1e6, "damping": 100.0}}},
    "a hand of a tonne on a feather": {
        "device": {"mass": 1e-6, "damping": 0.0},
        "hand": {"mass": 1e3, "stiffness": 10.0, "grip": {"stiffness": 1e3}},
    },
    "critically damped": {"transmission": {"motor_mass": 0.05, "stiffness": 1e4, "damping": math.sqrt(1e4 * 0.05 * 2)}},
    "nearly so": {"transmission": {"motor_mass": 0.05, "stiffness": 1e4, "damping": 31.6227766}},
    "no stiffness and no damping at all": {"device": {"mass": 0.05, "damping": 0.0}},
    "enormous damping everywhere": {
        "device": {"mass": 0.05, "damping": 1e4},
        "transmission": {"motor_mass": 0.02, "stiffness": 1e5, "damping": 1e3, "motor_damping": 1e4},
    },
    "friction of a nanonewton": {"friction": {"kinetic": 1e-9}},
    "friction of a meganewton": {"friction": {"kinetic": 1e6}, "transmission": {"motor_mass": 0.02, "stiffness": 1e4}},
    "none at all": {"friction": {"kinetic": 0.0}},
    "breakaway without kinetic": {"friction": {"kinetic": 0.0, "breakaway": 0.1}, "hand": {"stiffness": 500.0}},
    "a Stribeck curve steeper than a step": {
        "friction": {"kinetic": 0.02, "breakaway": 0.2, "stribeck_velocity": 1e-6},
        "hand": {"stiffness": 500.0},
    },
}
RATES = [(1, 1), (10, 10), (1_000, 1_000), (10_000, 1_000), (10_000_000, 1_000_000)]


def extreme(case: str, rates: tuple[int, int] = (10_000, 1_000), **more: Any) -> Scene:
    """Set in motion at 0.1 m/s and left alone."""
    plant_rate, control_rate = rates
    tables = {"device": {"mass": 0.05, "damping": 0.02}} | EXTREME[case]
    tables["device"] = tables["device"] | {"velocity": 0.1}
    clock = {"plant_rate": plant_rate, "control_rate": control_rate}
    ticks = 200 if control_rate >= 1_000 else 20
    return scene(**tables | {"clock": clock, "duration": ticks / control_rate, "diverged_beyond": 1e3} | more)


@pytest.mark.parametrize("rates", [RATES[0], *slowly(RATES[1:])], ids=str)
@pytest.mark.parametrize("case", [*[*EXTREME][::4], *slowly(case for at, case in enumerate(EXTREME) if at % 4)])
def test_a_free_plant_of_any_scale_and_step_never_gains_energy_and_its_books_close(case, rates):
    if rates[0] < 1_000 and case == "the same with friction":
        rates = (200, 200)  # every radian of the cable's swing is looked at; at 1 Hz there are 1e5 of them in a step
    resolved = extreme(case, rates)
    ran = run(resolved)
    stored = stored_at_steps(ran, resolved)
    assert np.diff(stored).max() <= 1e-12 * stored[0]
    assert_sound(ran)
    assert ran.summary["verdict"] == "no-contact"


# The loop with effects


ALL = tuple(EFFECTS)
LOOPS: dict[str, dict[str, Any]] = {
    "a wall of 50 N/mm": {"wall": {"stiffness": 5e4}},
    "a wall of 50 N/mm on a stiff cable": {
        "wall": {"stiffness": 5e4},
        "transmission": {"motor_mass": 1e-3, "stiffness": 1e7},
    },
    "a delay longer than any contact": {"clock": {"round_trip_delay": 0.08}},
    "a delay longer than the run": {"clock": {"round_trip_delay": 0.5}},
    "jitter that reorders nearly everything": {"jitter": {"kind": "gamma", "mean": 0.02, "deviation": 0.03}},
    "nine of ten commands lost": {"loss": {"probability": 0.9}},
    "all commands lost": {"loss": {"probability": 1.0}},
    "noise larger than the penetration": {"noise": {"deviation": 3e-3, "cutoff": 400.0}},
    "an accelerometer of noise": {"accelerometer": {"noise_density": 100.0}},
    "an accelerometer that clips all the time": {"accelerometer": {"range": 0.01, "resolution": 0.01}},
    "an actuator of a millinewton": {"actuator": {"saturation": 1e-3}},
    "an actuator of coarse steps": {"actuator": {"resolution": 0.5, "saturation": 2.0}},
    "an actuator of a tenth of a hertz": {"actuator": {"bandwidth": 0.1}},
    "an actuator of a terahertz": {"actuator": {"bandwidth": 1e12}},
    "a sensor of a terahertz": {"accelerometer": {"bandwidth": 1e12}},
    "one step a tick": {"clock": {"plant_rate": 10_000, "control_rate": 10_000}},
}


@pytest.mark.parametrize("effects", [ALL, *slowly([(), ("friction",), ("transmission", "grip")])], ids="+".join)
@pytest.mark.parametrize("case", [*[*LOOPS][::2], *slowly([*LOOPS][1::2])])
def test_a_hard_loop_gives_numbers_and_books_that_close(case, effects):
    assert_sound(run(tap(effects, **LOOPS[case])))


@pytest.mark.parametrize("depth", [0.0, 1e-3, *slowly([-1e-3, 1e-15])])
@pytest.mark.parametrize("speed", [0.0, 1e-9, *slowly([1e-15, 1e-3])])
@pytest.mark.parametrize("effects", [ALL, *slowly([("friction", "transmission")])], ids="+".join)
def test_a_start_outside_on_or_inside_the_wall_however_slow_is_sound(depth, speed, effects):
    start = {"position": -0.002 - depth, "velocity": -speed}
    assert_sound(run(tap(effects, device=start, duration=0.1)))


@cache
def undisturbed(effects: tuple[str, ...]) -> Captured:
    return run(tap(effects))


@pytest.mark.parametrize("phase", [0, 4, 8, *slowly([1, 2, 3, 5, 6, 7, 9, 10, 11])])
@pytest.mark.parametrize("effects", [("friction", "transmission", "grip"), ALL], ids="+".join)
def test_a_swap_in_any_phase_of_a_contact_changes_nothing_before_and_its_books_close(phase, effects):
    """From before the tap through entering, deepest and leaving to the hold."""
    before = undisturbed(effects)
    contact = np.flatnonzero(before.controller["in_contact"])
    first, last = int(contact[0]), int(contact[-1])
    at = max(0, first - 2) + phase * max(1, (last - first) // 11)
    event = {"at": at / 1000, "element": 0, "swap": {"kind": "damping", "damping": 2.0}}
    after = run(tap(effects, event=[event]))
    assert_sound(after)
    steps = at * 10 + 13
    for name in ("x", "v"):
        assert np.array_equal(before.plant[name][: steps + 1], after.plant[name][: steps + 1])
    if phase < 9:  # later it is at rest, where a damper does nothing
        assert not np.array_equal(before.plant["x"], after.plant["x"])
    spans = {(e["kind"], e["from_tick"], e["to_tick"]) for e in after.energy["elements"]}
    assert ("damping", at, 300) in spans
    assert at == 0 or ("damping", 0, at) in spans


class FlippingMotion(Element):
    """A force that changes its sign every tick, so that acceleration does."""

    kind = "flipping"

    def __post_init__(self) -> None:
        self.sign = 1.0

    def force(self, motion: Motion) -> float:
        self.sign = -self.sign
        return 50.0 * self.sign


@pytest.mark.parametrize("effects", [(), ("friction",), ("transmission", "bandwidth"), ALL], ids="+".join)
def test_acceleration_that_changes_its_sign_with_every_sample_is_sound(effects, monkeypatch):
    monkeypatch.setitem(KINDS, "flipping", FlippingMotion)
    flipping = [
        {"kind": "flipping", "acts": "always"},
        {"kind": "unidirectional-inertia", "mass": 0.004, "acts": "always"},
    ]
    ran = run(tap(effects, dissipation=flipping))
    changes = np.sign(ran.controller["a"][2:]) != np.sign(ran.controller["a"][1:-1])
    assert changes.mean() > (0.3 if "bandwidth" in effects else 0.9)
    assert_sound(ran)


@pytest.mark.slow
@pytest.mark.parametrize("damping", [20.0, 500.0])
@pytest.mark.parametrize("effects", [("transmission",), ("grip",), ("transmission", "grip")], ids="+".join)
def test_motion_that_decays_below_the_least_normal_number_stays_sound(damping, effects):
    """Nothing pulls: every stretch and speed dies away, past 1e-308."""
    device = {"damping": damping, "position": 0.0}
    hand = {"damping": 50.0, "stiffness": 0.0, "rest": 0.0, "mass": 1e-3}
    ran = run(free(effects, device=device, hand=hand, duration=3.0))
    assert_sound(ran)
    assert np.abs(ran.plant["v"][-1]) < 1e-12


# Physical instability is named, and is no numerical failure


@pytest.mark.parametrize("effects", subsets(0, 1), ids="+".join)
def test_an_unstable_loop_is_reported_as_such_and_its_books_close_all_the_same(effects):
    """A wall so stiff that it throws the device across the room: the energy is all accounted for."""
    violent = [{"kind": "damping", "damping": 200.0, "acts": "always"}]
    ran = run(tap(effects, wall={"stiffness": 5e4}, dissipation=violent, duration=1.0, diverged_beyond=0.3))
    assert (ran.summary["verdict"], ran.summary["ended"]) == ("diverged", "diverged")
    assert "beyond the limit of 0.3 m" in ran.summary["verdict_rule"]
    assert ran.energy["residual_J"] < 1e-12 * ran.energy["moved_J"]
    absorbed = ran.energy["wall"]["true_J"] + ran.energy["elements"][0]["true_J"] + ran.energy.get("actuator_J", 0.0)
    assert absorbed < 0.0, "the loop put in what the device flies off with"


@pytest.mark.parametrize(
    "effects", [(), ("bandwidth",), *slowly((name,) for name in ("friction", "transmission", "grip"))], ids="+".join
)
def test_a_buzzing_wall_swings_and_a_soft_one_does_not_with_any_effect(effects):
    plain: dict[str, Any] = {"dissipation": [], "duration": 1.5, "device": {"damping": 0.3}}
    buzzing = run(tap(effects, wall={"stiffness": 4000.0}, **plain))
    calm = run(tap(effects, wall={"stiffness": 50.0}, **plain))
    assert (buzzing.summary["verdict"], calm.summary["verdict"]) == ("swinging", "no-swing-seen")
    assert_sound(buzzing)
    assert_sound(calm)
