"""Fig. 4: velocity against momentum of virtual inertia in one contact, and filters over its acceleration."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from haploop.protocol.amounts import amount, fixed
from haploop.protocol.scene.effects import Accelerometer
from haploop.protocol.scene.estimators import Acceleration
from haploop.protocol.scene.hand_force import Trace
from haploop.protocol.scene.scene import ElementTable, Encoder, Scene
from haploop.tools.figure.style import INK, SMALL, empty_figure
from haploop.tools.linear.one_tick import OneTickMap
from haploop.tools.search.bisect import Tolerance, bisect
from haploop.tools.studies.choi2022.figures.claims import Finding
from haploop.tools.studies.choi2022.figures.drawing import draw_momentum
from haploop.tools.studies.choi2022.figures.figure_3 import single_contact
from haploop.tools.studies.choi2022.figures.work import Work
from haploop.tools.studies.choi2022.runs import Run, fig6, hand_of, run
from haploop.tools.studies.choi2022.sampled import MASS_KG, PERIOD_S, closed_form, mean_taken, steps_J

# Cutoffs in Hz, by their names in a list of numbers.
CUTOFFS_HZ = {"unfiltered": None, "100 Hz": 100.0, "30 Hz": 30.0, "10 Hz": 10.0}
# Extra delays and inertias with which the low-pass with the least lag is tested.
_DELAYS_S, _MASSES_G = (0.0, 0.001, 0.002), np.arange(1.0, 41.0)
# An IMU of the class of the paper's: 300 ug/Hz^0.5, 16 bit over 8 g, 420 Hz (MPU-9250's data sheet).
IMU = Accelerometer(noise_density=2.9e-3, range=78.5, resolution=2.4e-3, bandwidth=420.0, delay=0.0014)
# One count of a PHANToM Premium 1.5.
COUNT_M = 28.7e-6
# An encoder so fine that its step does not matter.
_FINE_M = 1e-7


def make_4(work: Work) -> list[Finding]:
    """Draws the motion of the schematic and a run, and tests filters over the acceleration."""
    pulse = 0.1 * np.sin(np.pi * np.arange(-1, 15) / 12.0).clip(0.0)
    pushed = run(_pushed_and_braked(_inertia(MASS_KG)))
    v = pushed.log["/controller"]["v"]
    felt_inside = replace(_inertia(MASS_KG), acts="in-contact")
    contact = run(single_contact("In and out of the wall, with inertia", dissipation=(felt_inside,)))
    figure = empty_figure(11.0, 4.6)
    left, right = figure.subplots(1, 2)
    draw_momentum(left, pulse, MASS_KG, "Prescribed: faster, then slower")
    draw_momentum(right, v, MASS_KG, "A run of the program: pushed, then braked")
    for ax, speeds in ((left, pulse), (right, v)):
        net = amount(float(steps_J(speeds, MASS_KG).sum()), "J")
        ax.text(0.03, 0.95, f"net taken {net}", transform=ax.transAxes, va="top", fontsize=SMALL, color=INK)
    work.figure(figure, "figure_4")
    work.data("figure_4", {"prescribed_v_m_s": pulse, "run_v_m_s": v})
    work.scene("figure_4_pushed", pushed.scene)
    work.scene("figure_4_contact", contact.scene)
    masses_g = {name: 1e3 * largest_mass_kg(cutoff, 0.0) for name, cutoff in CUTOFFS_HZ.items()}
    masses = [f"{mass:.0f} g {'at ' * bool(CUTOFFS_HZ[name])}{name}" for name, mass in masses_g.items()]
    work.conclude(supports=max(masses_g.values()) > masses_g["unfiltered"], masses=", ".join(masses))
    return [*_on_energy(work, pulse, v, pushed, contact), *_on_filters(work, masses_g)]


def _pushed_and_braked(element: ElementTable) -> Scene:
    """Returns a scene of device and hand in the open, pushed for 24 ms and braked for as long, without any damping."""
    scene = single_contact("Pushed, then braked", dissipation=(element,))
    force = Trace(time=(0.0, 0.012, 0.024, 0.036, 0.048), force=(0.0, 0.25, 0.0, -0.25, 0.0))
    device = replace(scene.device, position=0.0, velocity=0.0)
    return replace(scene, duration=0.06, device=device, wall=None, hand=replace(hand_of(scene), force=force))


def _inertia(mass_kg: float) -> ElementTable:
    return ElementTable(name="bidirectional-inertia", acts="always", parameters={"mass": mass_kg})


def _on_energy(work: Work, pulse: np.ndarray, v: np.ndarray, pushed: Run, contact: Run) -> list[Finding]:
    energy, free = contact.summary["energy"], pushed.summary["energy"]
    sampled_J, wall_J = energy["elements"][0]["sampled_J"], energy["wall"]["sampled_J"]
    apart = abs(float(steps_J(v, MASS_KG).sum()) / free["elements"][0]["sampled_J"] - 1.0)
    closed = float(steps_J(pulse, MASS_KG).sum())
    theta = 2.0 * np.pi * np.linspace(5.3, 497.9, 20 if work.small else 160) * PERIOD_S
    formula = closed_form("bidirectional-inertia", theta, 0)
    off = float(np.abs(mean_taken("bidirectional-inertia", theta, 0) - formula).max() / np.abs(formula).max())
    return [
        work.claims["step"].holds_if(apart < 1e-9),
        work.claims["clockwise"].holds_if(closed > 0.0, closed=amount(closed, "J")),
        work.claims["unlike"].holds_if(
            sampled_J > 0.0 > wall_J, inertia=amount(sampled_J, "J"), wall=amount(wall_J, "J")
        ),
        work.claims["passive"].holds_if(False, off < 1e-3, undelayed=1e3 / 3.0, delayed=1e3 / 7.0, off=100 * off),
    ]


def _on_filters(work: Work, masses_g: dict[str, float]) -> list[Finding]:
    passive = {name: passive_up_to_Hz(cutoff) for name, cutoff in CUTOFFS_HZ.items()}
    lags = {f"{1e3 * delay_s:g} ms": least_lag_best_g(delay_s) for delay_s in _DELAYS_S}
    stiffest = {name: 1e-3 * _stiffest_N_m(MASS_KG, cutoff, 0.002) for name, cutoff in CUTOFFS_HZ.items()}
    errors, fine = errors_m_s2(), errors_m_s2(_FINE_M)
    best, finest = (min(of[name] for name in of if name != "accelerometer") for of in (errors, fine))
    return [
        work.claims["filtered"].holds_if(
            min(passive.values()) >= 0.98 * passive["unfiltered"],
            True,
            passive=_listed(passive, "Hz"),
            least=min(passive.values()),
        ),
        work.claims["range"].holds_if(
            all(mass > masses_g["unfiltered"] for name, mass in masses_g.items() if name != "unfiltered"),
            masses=_listed(masses_g, "g"),
        ),
        work.claims["lag"].holds_if(
            False,
            any(lags.values()),
            masses=", ".join(f"{name} {of}" for name, of in lags.items() if of),
            stiffest=_listed(stiffest, "N/mm"),
        ),
        work.claims["measured"].holds_if(errors["accelerometer"] < best, errors=_listed(errors, "m/s²")),
        work.claims["choose"].holds_if(
            finest < fine["accelerometer"], difference=fixed(finest), accelerometer=fixed(fine["accelerometer"])
        ),
    ]


def passive_up_to_Hz(cutoff_Hz: float | None) -> float:
    """Returns the lowest frequency at which bidirectional inertia without delay gives more than it takes, to 1 Hz."""
    frequencies = np.arange(1.37, 500.0, 1.0)
    taken = mean_taken("bidirectional-inertia", 2.0 * np.pi * frequencies * PERIOD_S, 0, cutoff_Hz)
    return float(frequencies[np.argmax(taken < 0.0)]) if (taken < 0.0).any() else math.inf


def largest_mass_kg(cutoff_Hz: float | None, stiffness_N_m: float) -> float:
    """Returns the largest virtual mass, from 0 on, with which the paper's device and hand behind 2 ms stay stable.

    There rho(M) = 1 for the one-tick map; 0 where the loop is unstable even with the smallest mass.
    """

    def is_stable(mass_kg: float) -> bool:
        return _one_tick(mass_kg, cutoff_Hz).growth(stiffness_N_m) < 1.0

    low, high = 0.0, 1e-5
    while high < 10.0 and is_stable(high):
        low, high = high, 1.2 * high
    return bisect(is_stable, low, high, Tolerance(relative=1e-6))[0] if low else 0.0


def least_lag_best_g(delay_s: float) -> str:
    """Returns the inertias, in g, with which the one with the least lag of three low-passes bears the stiffest wall.

    For example ``"8 to 40 g"``, of 1 to 40 g that are tried; "" for none.
    """
    cutoffs = [cutoff for cutoff in CUTOFFS_HZ.values() if cutoff]
    bears = np.array([[_stiffest_N_m(1e-3 * mass, cutoff, delay_s) for cutoff in cutoffs] for mass in _MASSES_G])
    best = _MASSES_G[(bears[:, 0] > 0.0) & (bears.argmax(axis=1) == 0)]
    return f"{best[0]:g} to {best[-1]:g} g" if len(best) else ""


def _stiffest_N_m(mass_kg: float, cutoff_Hz: float | None, delay_s: float) -> float:
    """Returns the stiffness up to which, from 0 on, device and hand stay stable in contact; 0 for none."""
    ranges = _one_tick(mass_kg, cutoff_Hz, delay_s).stable_ranges()
    return ranges[0][1] if ranges and ranges[0][0] == 0.0 else 0.0


def _one_tick(mass_kg: float, cutoff_Hz: float | None, delay_s: float = 0.002) -> OneTickMap:
    base = fig6("c")
    filtered = replace(base, encoder=None, acceleration=Acceleration(cutoff=cutoff_Hz))
    clock = replace(base.clock, round_trip_delay=delay_s)
    return OneTickMap.from_scene(replace(filtered, clock=clock, dissipation=(_inertia(mass_kg),)))


def errors_m_s2(count_m: float = COUNT_M) -> dict[str, float]:
    """Returns the RMS error of the controller's acceleration in one contact, by its source.

    The contact is with the wall alone, so that the motion does not depend on the estimate.
    """

    def accelerations(estimate: Acceleration, accelerometer: Accelerometer | None = None) -> np.ndarray:
        encoder = Encoder(resolution=count_m)
        scene = single_contact("a contact", encoder=encoder, accelerometer=accelerometer, acceleration=estimate)
        return run(scene).log["/controller"]["a"]

    measured = Acceleration(source="accelerometer")
    true = accelerations(measured)
    found = {f"encoder, {name}": accelerations(Acceleration(cutoff=one)) for name, one in CUTOFFS_HZ.items()}
    found["accelerometer"] = accelerations(measured, IMU)
    return {name: float(np.sqrt(np.mean((a - true) ** 2))) for name, a in found.items()}


def _listed(values: dict[str, float], unit: str) -> str:
    return ", ".join(f"{name} {fixed(value)} {unit}" for name, value in values.items())
