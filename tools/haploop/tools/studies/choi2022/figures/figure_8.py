"""Fig. 8: what damping dissipated, and what inertias would have dissipated on the same motion."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from haploop.controller.dissipation import registry
from haploop.protocol.amounts import amount
from haploop.protocol.ticks import Timebase
from haploop.tools.dissipate.booking import Booked, Booking
from haploop.tools.dissipate.recording.samples import Samples
from haploop.tools.figure.style import dress, empty_figure, legend
from haploop.tools.studies.choi2022.device import FRICTION_N, KINDS, Setup, elements_of
from haploop.tools.studies.choi2022.experiment import BOOKED_AT_N_M, BOOKED_DAMPING, BOOKED_KG
from haploop.tools.studies.choi2022.figures.claims import ASSUMING, Finding
from haploop.tools.studies.choi2022.figures.drawing import COLOURS, INSIDE, UPPER_LEFT
from haploop.tools.studies.choi2022.figures.work import Work
from haploop.tools.studies.choi2022.runs import Run, run, strongest_Hz
from haploop.tools.studies.choi2022.sampled import DAMPING_N_S_M, PERIOD_S, bidirectional_J, closed_form

LABELS = ("damping", "bidirectional inertia", "unidirectional inertia")
# Share of the energy moved that rounding leaves over in a sum that cancels.
_ROUNDING = 1e-9
_FREQUENCIES_HZ = np.linspace(2.3, 247.9, 492)
# Ages of an acceleration: of a difference of differences, and of an MPU-9250 at its settings of 1046 and 420 Hz.
_AGES_S = (None, 5e-4, 1.38e-3)


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


def make_8(work: Work) -> list[Finding]:
    """Runs two contacts with damping, and books all three elements on the motion of each."""
    found = contacts(work.nearest)
    _picture(work, found)
    sizes = {"damping": BOOKED_DAMPING, "mass_g": 1e3 * BOOKED_KG}
    work.caption = work.tell("caption", **sizes)
    if not work.small:
        rough = contacts(replace(work.nearest, friction_N=FRICTION_N))
        ends = [contact.booked.sampled_J[:, -1] for contact in rough]
        needed_g = 1e3 * max(BOOKED_KG * end[0] / end[1:].min() for end in ends)
        work.notes = [work.tell("tried", labels=", ".join(LABELS), ends=_by_wall(rough, ends), needed_g=needed_g)]
    first = [first_ahead_Hz(age_s) for age_s in _AGES_S]
    swings = " and ".join(f"{contact.swings_Hz:.0f}" for contact in found)
    results = _findings(work, found, first, swings)
    supports = any(one.claim.name == "more" and one.verdict == ASSUMING for one in results)
    work.conclude(supports=supports, least=min(first), most=max(first), swings=swings, **sizes)
    return results


def contacts(setup: Setup) -> list[Contact]:
    """Runs a contact with the paper's damping at both of its stiffnesses."""
    found = []
    for stiffness in BOOKED_AT_N_M:
        ran = run(setup.scene(stiffness, elements_of("damping", BOOKED_DAMPING)))
        found.append(Contact(stiffness, ran, _booked_on(ran), strongest_Hz(ran.log)))
    return found


def _booked_on(ran: Run) -> Booked:
    """Books damping and both inertias on the motion of a run, in the order of ``LABELS``."""
    scene, time = ran.scene, Timebase.from_scene(ran.scene)
    n, late = time.steps_per_tick, time.delay_steps % time.steps_per_tick
    sizes = zip(KINDS[1:], (BOOKED_DAMPING, BOOKED_KG, BOOKED_KG), strict=True)
    elements = tuple(element for kind, size in sizes for element in elements_of(kind, size))
    recorded = frozenset({"velocity", "acceleration"})
    delay_s = scene.clock.round_trip_delay
    booking = Booking(replace(scene, dissipation=elements), time.period_s, delay_s, registry(), recorded)
    ticks, x = ran.log["/controller"], ran.log["/plant"]["x"]
    count = len(ticks["x"])
    true, between = x[: count * n : n], x[late : late + count * n : n]
    t_s = (np.arange(count) * time.period_s).astype(np.float64)
    return booking.add(Samples(t_s, ticks["x"], ticks["v"], ticks["a"], true, between, True))


def _picture(work: Work, contacts: list[Contact]) -> None:
    figure = empty_figure(12.0, 3.8)
    axes = figure.subplots(1, len(contacts))
    columns: dict[str, np.ndarray] = {}
    for ax, contact, key in zip(axes, contacts, ("lower", "higher"), strict=True):
        booked = contact.booked
        for i, label in enumerate(LABELS):
            colour = COLOURS[KINDS[i + 1]]
            # The last is drawn thin: the two inertias come to nearly the same.
            ax.plot(booked.t_s, 1e3 * booked.sampled_J[i], color=colour, linewidth=(1.4, 3.0, 1.2)[i], label=label)
            ax.plot(booked.t_s, 1e3 * booked.true_J[i], color=colour, linewidth=0.9, linestyle="--")
        heading = f"{contact.stiffness_N_m / 1e3:.1f} N/mm, solid: sampled books, dashed: true ones"
        dress(ax, heading, "time (s)", "energy taken (mJ)")
        columns |= {f"{key}_t_s": booked.t_s, f"{key}_sampled_J": booked.sampled_J, f"{key}_true_J": booked.true_J}
        work.scene(f"figure_8_{key}", contact.ran.scene)
    legend(axes[0], **UPPER_LEFT, **INSIDE)
    work.data("figure_8", columns)
    work.figure(figure, "figure_8", work.texts["seen"])


def first_ahead_Hz(age_s: float | None) -> float:
    """Returns the lowest frequency below 250 Hz at which the paper's bidirectional inertia takes more than its damper.

    Both take it from a sine, by the sampled books; ``age_s`` is the age of the acceleration, as in ``bidirectional_J``.
    NaN if there is none.
    """
    damped = BOOKED_DAMPING / DAMPING_N_S_M * closed_form("damping", 2.0 * np.pi * _FREQUENCIES_HZ * PERIOD_S, 0)
    over = BOOKED_KG * bidirectional_J(_FREQUENCIES_HZ, age_s) >= damped
    return float(_FREQUENCIES_HZ[over.argmax()]) if over.any() else float("nan")


def _findings(work: Work, contacts: list[Contact], first: list[float], swings: str) -> list[Finding]:
    ends = [contact.booked.sampled_J[:, -1] for contact in contacts]
    back = [contact.back_J for contact in contacts]
    all_more = all((end[1:] > end[0]).all() and end[0] > 0.0 for end in ends)
    pure = max(float(of[2] / end[2]) for of, end in zip(back, ends, strict=True))
    late = 1.0 + contacts[0].ran.scene.clock.round_trip_delay * 1e3
    computed = {
        "labels": ", ".join(LABELS),
        "ends": _by_wall(contacts, ends),
        "first": ", ".join(f"{one:.0f}" for one in first),
        "swings": swings,
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
    return work.findings(holding, **computed)


def _by_wall(contacts: list[Contact], values: list[np.ndarray]) -> str:
    return "; ".join(
        f"{contact.stiffness_N_m / 1e3:.1f} N/mm: {', '.join(amount(float(value), 'J') for value in of)}"
        for contact, of in zip(contacts, values, strict=True)
    )
