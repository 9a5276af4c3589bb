"""Fig. 4: velocity against momentum of virtual inertia in one contact."""

from __future__ import annotations

from typing import Any

import numpy as np

from haploop.tools.figure.style import INK, SMALL, empty_figure
from haploop.tools.render.units import amount, fixed
from haploop.tools.studies.choi2022.claims import Claim, Finding
from haploop.tools.studies.choi2022.motion.acceleration import (
    CUTOFFS_HZ,
    errors_m_s2,
    largest_mass_kg,
    largest_stiffness_N_m,
    named,
    passive_up_to_Hz,
    said,
)
from haploop.tools.studies.choi2022.motion.momentum import draw_loop, steps_J
from haploop.tools.studies.choi2022.motion.prescribed import MASS_KG, PERIOD_S, closed_form, mean_taken
from haploop.tools.studies.choi2022.simulation.scenes import pushed_and_braked, run, single_contact
from haploop.tools.studies.choi2022.work import Work

TITLE = "Velocity against momentum of virtual inertia in a single contact"
STEP = Claim("III, eq. 7 and 8", "The above equation can be simplified as … E_step(k) = m v(k)(v(k−1) − v(k−2))")
CLOCKWISE = Claim(
    "III, Fig. 4", "a graph shift caused by the delay on the horizontal axis results in a clockwise hysteresis"
)
UNLIKE = Claim("III, Fig. 4", "the virtual inertia dissipates energy, unlike the virtual spring")
PASSIVE = Claim("III, Fig. 4", "virtual inertia can be considered a passive element")
FILTERED = Claim(
    "III",
    "rendering the virtual inertia using low-pass filtered acceleration has no effect on the passivity of the system",
)
RANGE = Claim("III", "[a low-pass filter] even expands the stable range of virtual inertia")
MEASURED = Claim(
    "III",
    "the measured acceleration value from an accelerometer … is more accurate than filtered values from the encoder",
)
LAG = Claim("III", "it would be desirable to use a low-pass filter with a minimum phase lag")
CHOOSE = Claim(
    "III",
    "Based on the encoder resolution of the haptic system, we may select a proper one between the filtered "
    "acceleration from the encoder or the measured acceleration from the accelerometer",
)
CLAIMS = (STEP, CLOCKWISE, UNLIKE, PASSIVE, FILTERED, RANGE, LAG, MEASURED, CHOOSE)

# An encoder so fine that its step does not matter.
_FINE_M = 1e-7


def make(work: Work) -> list[Finding]:
    """The schematic's motion, and a contact of the program's."""
    pulse = 0.1 * np.sin(np.pi * np.arange(-1, 15) / 12.0).clip(0.0)
    inertia = [{"kind": "bidirectional-inertia", "acts": "always", "mass": MASS_KG}]
    pushed = pushed_and_braked(dissipation=inertia)
    v = np.asarray(run(pushed)[1]["/controller"]["v"])
    contact = single_contact("In and out of the wall, with inertia", dissipation=[inertia[0] | {"acts": "in-contact"}])
    figure = empty_figure(11.0, 4.6)
    left, right = figure.subplots(1, 2)
    draw_loop(left, pulse, MASS_KG, "Prescribed: faster, then slower")
    draw_loop(right, v, MASS_KG, "A run of the program: pushed, then braked")
    for ax, speeds in ((left, pulse), (right, v)):
        net = amount(float(steps_J(speeds, MASS_KG).sum()), "J")
        ax.text(0.03, 0.95, f"net taken {net}", transform=ax.transAxes, va="top", fontsize=SMALL, color=INK)
    work.figure(figure, "figure_4")
    work.data("figure_4", {"prescribed_v_m_s": pulse, "run_v_m_s": v})
    work.scene("figure_4_pushed", pushed)
    work.scene("figure_4_contact", contact)
    work.caption = (
        "10 g of virtual inertia. What is taken while the speed grows is green, what is given back while it falls "
        "red, and grey where both lie; the path runs clockwise, and what lies within it is kept. Left the motion of "
        "the schematic, right the paper's device and hand, pushed by hand and braked again."
    )
    masses = [
        f"{1e3 * largest_mass_kg(cutoff, 0.0):.0f} g {'at ' * bool(cutoff)}{named(cutoff)}" for cutoff in CUTOFFS_HZ
    ]
    work.answer = (
        "**A low-pass over the acceleration helps.** Largest stable bidirectional inertia of the paper's device and "
        f"hand, 2 ms late and without a wall: {', '.join(masses)}"
    )
    return _findings(pulse, v, pushed, contact, work)


def _findings(
    pulse: np.ndarray, v: np.ndarray, pushed: dict[str, Any], contact: dict[str, Any], work: Work
) -> list[Finding]:
    summary = run(contact)[0]
    [element] = summary["energy"]["elements"]
    sampled_J, wall_J = element["sampled_J"], summary["energy"]["wall"]["sampled_J"]
    free = run(pushed)[0]["energy"]["elements"][0]["sampled_J"]
    by_steps, closed = float(steps_J(v, MASS_KG).sum()), float(steps_J(pulse, MASS_KG).sum())
    apart = abs(by_steps / free - 1.0)
    frequencies = np.linspace(5.3, 497.9, 160 if not work.small else 20)
    theta = 2.0 * np.pi * frequencies * PERIOD_S
    measured = mean_taken("bidirectional-inertia", theta, 0)
    formula = closed_form("bidirectional-inertia", theta, 0)
    off = float(np.abs(measured - formula).max() / np.abs(formula).max())
    changes = {late: 1e3 / (2 * late + 3) for late in (0, 2)}
    passive = {named(cutoff): passive_up_to_Hz(cutoff) for cutoff in CUTOFFS_HZ}
    unchanged = min(passive.values()) >= 0.98 * passive["unfiltered"]
    free = {named(cutoff): 1e3 * largest_mass_kg(cutoff, 0.0) for cutoff in CUTOFFS_HZ}
    wider = all(free[named(cutoff)] > free["unfiltered"] for cutoff in CUTOFFS_HZ[1:])
    errors = errors_m_s2()
    best = min(value for name, value in errors.items() if name != "accelerometer")
    fine = errors_m_s2(_FINE_M)
    finest = min(value for name, value in fine.items() if name != "accelerometer")
    stiffest = {named(cutoff): 1e-3 * largest_stiffness_N_m(cutoff, MASS_KG) for cutoff in CUTOFFS_HZ}
    on_filters = f"without delay bidirectional inertia takes energy from sines up to: {said(passive, 'Hz')}"
    return [
        STEP.judged(
            apart < 1e-9,
            "along the run at the right the program's sampled book and eq. 8 are the same, but for rounding",
        ),
        CLOCKWISE.judged(closed > 0.0, f"the loop of the prescribed motion encloses {amount(closed, 'J')}, clockwise"),
        UNLIKE.judged(
            sampled_J > 0.0 > wall_J,
            f"in one contact the inertia took {amount(sampled_J, 'J')} net, the wall {amount(wall_J, 'J')} (sampled "
            "books)",
        ),
        PASSIVE.assuming(
            "the motion is slower than a third of the sample rate, a seventh with 2 ms of delay",
            "under a sine it takes (2m/T²) sin²(θ/2)(cos (d+1)θ − cos (d+2)θ) A² a sample, d samples late: up to "
            f"{changes[0]:.0f} Hz at 1 kHz without delay, {changes[2]:.0f} Hz with 2 ms, and gives above; the "
            f"program's controller differs by {100 * off:.2g} % of the largest",
        )
        if off < 1e-3
        else PASSIVE.fails(f"the closed form and the program differ by {100 * off:.2g} %"),
        FILTERED.holds(on_filters)
        if unchanged
        else FILTERED.assuming(f"the motion is slower than {min(passive.values()):.0f} Hz", on_filters),
        RANGE.judged(
            wider, f"largest bidirectional mass of device and hand without a wall, 2 ms late: {said(free, 'g')}"
        ),
        LAG.judged(
            stiffest["unfiltered"] >= max(stiffest.values()),
            f"largest stable stiffness with 10 g of bidirectional inertia, 2 ms late: {said(stiffest, 'N/mm')}. Some "
            "lag turns the inertia into damping",
        ),
        MEASURED.judged(
            errors["accelerometer"] < best,
            f"RMS error in a contact, 28.7 µm encoder, IMU of 300 µg/√Hz: {said(errors, 'm/s²')}",
        ),
        CHOOSE.judged(
            finest < fine["accelerometer"],
            f"in such a contact the accelerometer is better whatever the encoder: with steps of 0.1 µm the best "
            f"difference is {fixed(finest)} m/s² off, the accelerometer {fixed(fine['accelerometer'])} m/s²; a "
            "difference of differences is a period old",
        ),
    ]
