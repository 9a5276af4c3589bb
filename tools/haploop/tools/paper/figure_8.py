"""Fig. 8: what damping dissipated, and what inertias would have dissipated on the same motion."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from haploop.protocol.ticks import Timebase
from haploop.tools.amounts import amount
from haploop.tools.dissipate.booking import Booked, Booking
from haploop.tools.dissipate.samples import Samples
from haploop.tools.figure_file import empty_figure
from haploop.tools.figure_style import ELEMENTS, dress, legend
from haploop.tools.paper.claims import Claim, Finding
from haploop.tools.paper.experiment.finding import under_the_reading
from haploop.tools.paper.experiment.setup import Setup, elements_of
from haploop.tools.paper.scenes import run
from haploop.tools.paper.work import Work

if TYPE_CHECKING:
    from matplotlib.axes import Axes

TITLE = "What damping dissipated in a contact, and what inertias would have on the same motion"
MORE = Claim(
    "V.B.2, Fig. 8",
    "the energy behavior associated with both virtual inertias still dissipated more energy than the damping element",
)
OSCILLATES = Claim(
    "V.B.2, Fig. 8",
    "The vertical energy oscillations due to bidirectional virtual inertia confirmed the storage and release of energy",
)
ALSO_GENERATES = Claim(
    "V.B.2, Fig. 8",
    "virtual damping not only dissipated energy but also generated it, particularly at high-frequency oscillations",
)
PURE = Claim(
    "V.B.2, Fig. 8",
    "unidirectional virtual inertia could effectively dissipate larger amounts of energy because it was a pure energy "
    "dissipation element",
)
CLAIMS = (MORE, OSCILLATES, ALSO_GENERATES, PURE)

# Choi et al. 2022, section V.B.2.
DAMPING_N_S_M, MASS_KG = 2.7, 0.0018
STIFFNESSES_N_M = {"lower stiffness": 4500.0, "higher stiffness": 5000.0}
LABELS = ("damping", "bidirectional inertia", "unidirectional inertia")
# Relative to the energy moved, what rounding leaves of a sum that cancels.
_ROUNDING = 1e-9


def make(work: Work) -> list[Finding]:
    """Two contacts with damping; all three elements booked on the motion of each."""
    setup, found, columns = Setup().cheap(work.small), {}, {}
    for name, stiffness in STIFFNESSES_N_M.items():
        scene = setup.scene(stiffness, elements_of("damping", DAMPING_N_S_M))
        summary, log = run(scene)
        booked = booked_on(scene, log, work)
        found[name] = summary, booked
        key = name.split()[0]
        columns |= {f"{key}_t_s": booked.t_s, f"{key}_sampled_J": booked.sampled_J, f"{key}_true_J": booked.true_J}
        work.scene(f"figure_8_{key}", scene)
    figure = empty_figure(12.0, 6.6)
    axes = figure.subplots(2, 2, sharex=True)
    for column, (name, (summary, booked)) in enumerate(found.items()):
        heading = f"{name}: {STIFFNESSES_N_M[name] / 1e3:g} N/mm ({summary['verdict']})"
        _draw(axes[0, column], heading, "sampled books (J)", booked.t_s, booked.sampled_J)
        _draw(axes[1, column], "the same, exact", "true books (J)", booked.t_s, booked.true_J)
        axes[1, column].set_xlabel("time (s)")
    legend(axes[0, 0], loc="upper left", bbox_to_anchor=(0.0, 1.0), ncols=1, framealpha=0.8, edgecolor="none")
    work.figure(figure, "figure_8")
    work.data("figure_8", columns)
    work.caption = (
        "Above what the controller can know (eq. 4), as in the paper; below what the forces really took out of the "
        "device, since they act later. Damping of 2.7 N s/m was at work; inertias of 1.8 g are booked on its motion, "
        "as `haploop dissipate DIR --damping 2.7 --mass 0.0018` does after `haploop run` of the scene beside it."
    )
    return _findings({name: booked for name, (_, booked) in found.items()})


def booked_on(scene: dict[str, Any], log: Any, work: Work) -> Booked:
    """Damping and both inertias on the motion of a run, in the order of ``LABELS``."""
    time = Timebase.of(scene["clock"], scene["duration"])
    n, late = time.steps_per_tick, time.delay_steps % time.steps_per_tick
    elements = [
        *elements_of("damping", DAMPING_N_S_M),
        *elements_of("bidirectional-inertia", MASS_KG),
        *elements_of("unidirectional-inertia", MASS_KG),
    ]
    recorded = frozenset({"velocity", "acceleration"})
    delay_s = scene["clock"]["round_trip_delay"]
    booking = Booking({**scene, "dissipation": elements}, time.period_s, delay_s, work.kinds, recorded)
    ticks, x = log["/controller"], np.asarray(log["/plant"]["x"])
    count = len(ticks["x"])
    true, between = x[: count * n : n], x[late : late + count * n : n]
    t_s = (np.arange(count) * time.period_s).astype(np.float64)
    return booking.add(Samples(t_s, ticks["x"], ticks["v"], ticks["a"], true, between, True))


def given_back(books_J: np.ndarray) -> np.ndarray:
    """For each row of books over time: what went back in the samples in which they fell, J."""
    return -np.minimum(np.diff(books_J, axis=-1), 0.0).sum(axis=-1)


def _draw(ax: Axes, heading: str, y_label: str, t_s: np.ndarray, books_J: np.ndarray) -> None:
    for label, colour, book in zip(LABELS, ELEMENTS, books_J, strict=False):
        ax.plot(t_s, book, color=colour, linewidth=1.2, label=label)
    dress(ax, heading, "", y_label)


def _findings(found: dict[str, Booked]) -> list[Finding]:
    sampled = {name: booked.sampled_J for name, booked in found.items()}
    ends = {name: books[:, -1] for name, books in sampled.items()}
    true_ends = {name: booked.true_J[:, -1] for name, booked in found.items()}
    back = {name: given_back(books) for name, books in sampled.items()}
    words = "; ".join(f"{name}: {_three(end)} (exact {_three(true_ends[name])})" for name, end in ends.items())
    returned = "; ".join(f"{name}: {_three(of)}" for name, of in back.items())
    all_more = all((end[1:] > end[0]).all() for end in ends.values())
    needed = max(MASS_KG * end[0] / end[1:].min() for end in ends.values())
    even_Hz = DAMPING_N_S_M / (2.0 * MASS_KG)
    numbers = (
        f"sampled books at the end, {', '.join(LABELS)}: {words}. A swing at w loses b w^2 A^2 / 2 a second to a "
        f"damper and m w^3 A^2 / (2 pi) to a unidirectional inertia: as much at {even_Hz:.0f} Hz only, beyond half the "
        f"sampling rate. It takes {1e3 * needed:.0f} g of inertia to be ahead of the damping on these motions"
    )
    given = f"given back on the way, {', '.join(LABELS)}: {returned}"
    pure = [float(of[2] / ends[name][2]) for name, of in back.items()]
    return [
        under_the_reading(MORE, all_more, numbers),
        under_the_reading(OSCILLATES, all(of[1] > of[2] > 0.0 for of in back.values()), given),
        under_the_reading(
            ALSO_GENERATES,
            all(of[0] > _ROUNDING for of in back.values()),
            f"{given}. Sampled, a damper generates above a quarter of the rate, 250 Hz; with 1.6 ms more above 96 Hz",
        ),
        under_the_reading(
            PURE,
            all_more and max(pure) < 0.01,
            f"it takes less than the damping does (above), and gives back {100 * max(pure):.0f} % of what it keeps: "
            "the gate of eq. 9 closes a sample late",
        ),
    ]


def _three(values: np.ndarray) -> str:
    return ", ".join(amount(float(value), "J") for value in values)
