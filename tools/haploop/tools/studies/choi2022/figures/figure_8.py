"""Fig. 8: what damping dissipated, and what inertias would have dissipated on the same motion."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from haploop.protocol.ticks import Timebase
from haploop.tools.dissipate.booking import Booked, Booking
from haploop.tools.dissipate.samples import Samples
from haploop.tools.figure.style import GREY, dress, empty_figure, legend
from haploop.tools.render.units import amount
from haploop.tools.studies.choi2022.claims import ASSUMING, Finding, claims_of
from haploop.tools.studies.choi2022.device import FRICTION_N, KINDS, Setup, elements_of
from haploop.tools.studies.choi2022.drawing import COLOURS, INSIDE, UPPER_LEFT
from haploop.tools.studies.choi2022.experiment import describe, findings, nearest, nearest_with
from haploop.tools.studies.choi2022.experiment_measure import BOOKED_AT_N_M, BOOKED_DAMPING, BOOKED_KG
from haploop.tools.studies.choi2022.sampled import bidirectional_J, damper_J, unidirectional_J
from haploop.tools.studies.choi2022.work import Run, Work, run, strongest_Hz

CLAIMS = claims_of(8)
LABELS = ("damping", "bidirectional inertia", "unidirectional inertia")
# Relative to the energy moved, what rounding leaves of a sum that cancels.
_ROUNDING = 1e-9
_FREQUENCIES_HZ = np.linspace(2.3, 247.9, 492)
# Ages of the acceleration: of a difference of differences, and of an MPU-9250 at its settings of 1046 and 420 Hz.
_AGES_S: dict[str, float | None] = {"differenced": None, "unit of 0.50 ms": 5e-4, "unit of 1.38 ms": 1.38e-3}


@dataclass(frozen=True)
class Contact:
    """A run with the paper's damping, all three elements booked on it in the order of ``LABELS``, and how it swings."""

    stiffness_N_m: float
    ran: Run
    booked: Booked
    swings_Hz: float

    @property
    def back_J(self) -> np.ndarray:
        """Energy that each element gave back, in the samples in which its sampled book fell."""
        return -np.minimum(np.diff(self.booked.sampled_J, axis=-1), 0.0).sum(axis=-1)


def make(work: Work) -> list[Finding]:
    """Runs two contacts with damping, and books all three elements on the motion of each."""
    found = contacts(nearest(work), work)
    _picture(work, found, "figure_8", work.tell("seen_nearest"))
    _sines(work)
    if setup := nearest_with(work, "8 more"):
        _picture(work, contacts(setup, work), "figure_8_holds", work.tell("seen_holds", setup=describe(setup)))
    sizes = {"damping": BOOKED_DAMPING, "mass_g": 1e3 * BOOKED_KG}
    work.caption = work.tell("caption", **sizes)
    if not work.small:
        rough = contacts(replace(nearest(work), friction_N=FRICTION_N), work)
        ends = [contact.booked.sampled_J[:, -1] for contact in rough]
        needed_g = 1e3 * max(BOOKED_KG * end[0] / end[1:].min() for end in ends)
        work.notes = [work.tell("tried", labels=", ".join(LABELS), ends=_by_wall(rough, ends), needed_g=needed_g)]
    first = first_ahead_Hz(bidirectional_J(_FREQUENCIES_HZ, None))
    results = _findings(found, work)
    supports = any(one.claim.name == "more" and one.verdict == ASSUMING for one in results)
    work.conclude(supports=supports, first=first, swings=found[0].swings_Hz, **sizes)
    return results


def contacts(setup: Setup, work: Work) -> list[Contact]:
    """Runs a contact with the paper's damping at both of its stiffnesses."""
    found = []
    for stiffness in BOOKED_AT_N_M:
        ran = run(setup.scene(stiffness, elements_of("damping", BOOKED_DAMPING)))
        found.append(Contact(stiffness, ran, _booked_on(ran, work), strongest_Hz(ran.log)))
    return found


def _booked_on(ran: Run, work: Work) -> Booked:
    """Books damping and both inertias on the motion of a run, in the order of ``LABELS``."""
    scene, time = ran.scene, Timebase.from_scene(ran.scene)
    n, late = time.steps_per_tick, time.delay_steps % time.steps_per_tick
    sizes = zip(KINDS[1:], (BOOKED_DAMPING, BOOKED_KG, BOOKED_KG), strict=True)
    elements = tuple(element for kind, size in sizes for element in elements_of(kind, size))
    recorded = frozenset({"velocity", "acceleration"})
    delay_s = scene.clock.round_trip_delay
    booking = Booking(replace(scene, dissipation=elements), time.period_s, delay_s, work.kinds, recorded)
    ticks, x = ran.log["/controller"], ran.log["/plant"]["x"]
    count = len(ticks["x"])
    true, between = x[: count * n : n], x[late : late + count * n : n]
    t_s = (np.arange(count) * time.period_s).astype(np.float64)
    return booking.add(Samples(t_s, ticks["x"], ticks["v"], ticks["a"], true, between, True))


def _picture(work: Work, contacts: list[Contact], name: str, seen: str) -> None:
    figure = empty_figure(12.0, 3.8)
    axes = figure.subplots(1, len(contacts))
    columns: dict[str, np.ndarray] = {}
    for ax, contact, key in zip(axes, contacts, ("lower", "higher"), strict=True):
        booked = contact.booked
        for i, label in enumerate(LABELS):
            colour = COLOURS[KINDS[i + 1]]
            ax.plot(booked.t_s, 1e3 * booked.sampled_J[i], color=colour, linewidth=1.3, label=label)
            ax.plot(booked.t_s, 1e3 * booked.true_J[i], color=colour, linewidth=0.9, linestyle="--")
        dress(ax, f"{contact.stiffness_N_m / 1e3:.1f} N/mm", "time (s)", "energy taken (mJ)")
        columns |= {f"{key}_t_s": booked.t_s, f"{key}_sampled_J": booked.sampled_J, f"{key}_true_J": booked.true_J}
        work.scene(f"{name}_{key}", contact.ran.scene)
    legend(axes[0], **UPPER_LEFT, **INSIDE)
    work.data(name, columns)
    work.figure(figure, name, f"{seen} {work.tell('seen_books')}")


def _sines(work: Work) -> None:
    """Draws what each inertia takes over what the damper takes, by frequency and by the age of the acceleration."""
    figure = empty_figure(12.0, 3.6)
    axes = figure.subplots(1, 2, sharey=True)
    for ax, kind, taken in zip(axes, KINDS[2:], (bidirectional_J, unidirectional_J), strict=True):
        for (name, age_s), style in zip(_AGES_S.items(), ("-", "--", ":"), strict=True):
            ax.plot(_FREQUENCIES_HZ, ahead(taken(_FREQUENCIES_HZ, age_s)), style, color=COLOURS[kind], label=name)
        ax.axhline(1.0, color=GREY, linewidth=0.8)
        dress(ax, f"{kind.replace('-', ' ')} of 1.8 g over damping of 2.7 N s/m", "frequency of a swing (Hz)", "")
        ax.set_ylim(0.0, 3.0)
        legend(ax, **UPPER_LEFT)
    axes[0].set_ylabel("energy taken, inertia / damping (sampled)")
    work.figure(figure, "figure_8_sines", work.tell("seen_sines"))


def ahead(inertia_J: np.ndarray) -> np.ndarray:
    """Returns what the paper's inertia takes over what its damper does, from what 1 kg takes at 2.3 to 247.9 Hz."""
    return BOOKED_KG * inertia_J / (BOOKED_DAMPING * damper_J(_FREQUENCIES_HZ))


def first_ahead_Hz(inertia_J: np.ndarray) -> float:
    """Returns the lowest frequency below 250 Hz from which the inertia is ahead; NaN if none."""
    over = ahead(inertia_J) >= 1.0
    return float(_FREQUENCIES_HZ[over.argmax()]) if over.any() else float("nan")


def _findings(contacts: list[Contact], work: Work) -> list[Finding]:
    ends = [contact.booked.sampled_J[:, -1] for contact in contacts]
    back = [contact.back_J for contact in contacts]
    all_more = all((end[1:] > end[0]).all() and end[0] > 0.0 for end in ends)
    pure = max(float(of[2] / end[2]) for of, end in zip(back, ends, strict=True))
    late = 1.0 + contacts[0].ran.scene.clock.round_trip_delay * 1e3
    computed = {
        "labels": ", ".join(LABELS),
        "ends": _by_wall(contacts, ends),
        "first": first_ahead_Hz(bidirectional_J(_FREQUENCIES_HZ, None)),
        "swings": " and ".join(f"{contact.swings_Hz:.0f} Hz" for contact in contacts),
        "back": _by_wall(contacts, back),
        "limit": 250.0 / late,
        "share": 100 * pure,
    }
    holding = {
        "more": all_more,
        "oscillates": all(of[1] > of[2] > 0.0 for of in back),
        "also_generates": all(of[0] > _ROUNDING for of in back),
        "pure": all_more and pure < 0.01,
    }
    return findings(work, CLAIMS, holding, **computed)


def _by_wall(contacts: list[Contact], values: list[np.ndarray]) -> str:
    return "; ".join(
        f"{contact.stiffness_N_m / 1e3:.1f} N/mm: {', '.join(amount(float(value), 'J') for value in of)}"
        for contact, of in zip(contacts, values, strict=True)
    )
