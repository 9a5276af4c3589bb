"""Fig. 10: the stable range of each element, why those of the inertias differ, and what the unknown values change."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from haploop.tools.figure_file import empty_figure
from haploop.tools.figure_style import ELEMENTS, dress, plain_numbers
from haploop.tools.paper.claims import Claim, Finding
from haploop.tools.paper.experiment.finding import under_the_reading
from haploop.tools.paper.experiment.gate import always_open_Hz, bidirectional, unidirectional
from haploop.tools.paper.experiment.gate_figure import DELAYS_S, FREQUENCIES_HZ, damps, gate_figure
from haploop.tools.paper.experiment.influence import influence
from haploop.tools.paper.experiment.limits import swings_at_Hz
from haploop.tools.paper.experiment.ranges import FELT_M, STIFFNESSES, Range, ranges, with_friction
from haploop.tools.paper.experiment.setup import KINDS, UNITS, Setup, elements_of
from haploop.tools.paper.work import Work

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

TITLE = "Stable range of each element"
WIDE = Claim(
    "V.B.3, Fig. 10",
    "For low-stiffness VW, a wide range of virtual damping could be injected … rapidly decreased with an increase in "
    "stiffness",
)
DAMPING = Claim(
    "V.B.3, Fig. 10",
    "When the stiffness value reached 4.5 N/mm, no value of virtual damping could be injected without stability issue",
)
SIMILAR = Claim(
    "V.B.3, Fig. 10",
    "The bidirectional virtual inertia's maximum renderable stiffness was also 4.5 N/mm, similar to virtual damping",
)
LARGER = Claim(
    "V.B.3, Fig. 10", "the unidirectional virtual inertia had a significantly larger and wider stable region"
)
EXCLUSIVE = Claim(
    "V.B.3, Fig. 10",
    "the two different types of virtual inertias had exclusive regions, particularly for lower values of inertia",
)
CLAIMS = (WIDE, DAMPING, SIMILAR, LARGER, EXCLUSIVE)


def make(work: Work) -> list[Finding]:
    """Ranges, their limits with friction, the gate, and the readings."""
    setup = Setup().cheap()
    stiffnesses = STIFFNESSES[::4] if work.small else STIFFNESSES
    found = ranges(work, setup, stiffnesses)
    limits, swings_m = with_friction(work, found, stiffnesses)
    work.figure(_drawn(found, stiffnesses), "figure_10")
    bandwidth, late = UNITS[setup.unit]
    reading_s = late + (1.0 / (2.0 * np.pi * bandwidth) if bandwidth else 0.0)
    work.figure(gate_figure(reading_s, setup.delay_s), "figure_10_gate")
    columns = {"stiffness_N_m": stiffnesses}
    for kind, one in found.items():
        columns |= {f"{kind}_size_N_s_m_or_kg": one.sizes, f"{kind}_steady": one.steady}
    work.data("figure_10", columns)
    work.scene("figure_10", Setup().scene(5500.0, elements_of(KINDS[3], 0.03)))
    work.caption = (
        "A dot is a run that ends without vibration: the verdict `steady`, so that what swings across the encoder's "
        "step to either side within the last half second, without dying down, is vibration. Encoder of 28.7 um, noise "
        "and limits of motor and unit are in, friction is not."
    )
    words = ", ".join(
        f"{kind} {without / 1e3:.1f} and {having / 1e3:.1f}" for kind, (without, having) in limits.items()
    )
    work.notes.append(
        "Largest steady stiffness in N/mm without and with the published friction of 48 mN (from the first upwards, "
        f"at the best sizes): {words}. Friction adds to all of them; the order stays."
        if _order_stays(limits)
        else f"Largest steady stiffness in N/mm without and with the published friction of 48 mN: {words}."
    )
    work.notes += [_felt_words(found, swings_m), _gate_words(reading_s, setup), influence(work)]
    return _findings(found, limits, stiffnesses)


def _order_stays(limits: dict[str, tuple[float, float]]) -> bool:
    def order(which: int) -> list[str]:
        return sorted(KINDS[1:], key=lambda kind: limits[kind][which])

    return order(0) == order(1) and all(having >= without for without, having in limits.values())


def _drawn(found: dict[str, Range], stiffnesses: np.ndarray) -> Figure:
    figure = empty_figure(13.0, 4.6)
    axes = figure.subplots(1, 3, sharey=True)
    _dots(axes[0], "damping", "damping (N s/m)", stiffnesses, [(found[KINDS[1]], ELEMENTS[0], "o", "damping")], 1.0)
    two = (found[KINDS[2]], "#0072B2", "o", "bidirectional"), (found[KINDS[3]], ELEMENTS[0], ".", "unidirectional")
    _dots(axes[1], "inertia", "inertia (g)", stiffnesses, list(two), 1e3)
    both = found[KINDS[2]].steady + 2 * found[KINDS[3]].steady
    ax = axes[2]
    for code, colour, label in (
        (1, "#0072B2", "bidirectional only"),
        (2, ELEMENTS[0], "unidirectional only"),
        (3, "#999999", "both"),
    ):
        rows, columns = np.nonzero(both == code)
        ax.plot(
            1e3 * found[KINDS[2]].sizes[columns], stiffnesses[rows] / 1e3, "s", color=colour, markersize=5, label=label
        )
    dress(ax, "do the inertias' ranges exclude each other?", "inertia (g)", "")
    ax.set_xscale("log")
    plain_numbers(ax.xaxis)
    ax.legend(fontsize=8, frameon=False, loc="upper left")
    return figure


def _dots(
    ax: Axes, title: str, label: str, stiffnesses: np.ndarray, drawn: list[tuple[Range, str, str, str]], unit: float
) -> None:
    for one, colour, marker, name in drawn:
        rows, columns = np.nonzero(one.steady)
        x, y, filled = unit * one.sizes[columns], stiffnesses[rows] / 1e3, "none" if marker == "o" else colour
        ax.plot(x, y, marker, color=colour, markersize=6, label=name, markerfacecolor=filled)
    dress(ax, title, label, "wall stiffness (N/mm)")
    ax.set_xscale("log")
    plain_numbers(ax.xaxis)
    ax.set_xlim(unit * drawn[0][0].sizes[0] / 1.3, unit * drawn[0][0].sizes[-1] * 1.3)
    ax.set_ylim(stiffnesses[0] / 1e3 - 0.4, stiffnesses[-1] / 1e3 + 0.4)
    ax.legend(fontsize=8, frameon=False, loc="upper left")


def _felt_words(found: dict[str, Range], swings_m: np.ndarray) -> str:
    """How much still moves in what is called steady."""
    without = np.concatenate([one.swings_m[one.steady] for one in found.values()])
    words = [
        f"{name} in {np.sum(of > FELT_M)} of {len(of)}, with {1e6 * np.median(of):.1f} um at the median"
        for name, of in (("without friction", without), ("with friction", swings_m))
        if len(of)
    ]
    return (
        "What the encoder's step alone does: a swing within one step of 28.7 um to either side is steady by the "
        f"verdict, but a hand feels {1e6 * FELT_M:g} um at 100 Hz (Israr, Choi and Tan 2006: 8.5 um at 20 Hz, 0.06 at "
        "320 Hz). Of the runs called steady more than that is left over the last half second (drift included): "
        f"{'; '.join(words)}."
    )


def _gate_words(reading_s: float, setup: Setup) -> str:
    delay_s = setup.delay_s
    here_Hz = [swings_at_Hz(setup, stiffness) for stiffness in (2500.0, 7000.0)]
    two, one = (
        float(of(np.array(np.mean(here_Hz)), reading_s=reading_s, delay_s=delay_s).damping)
        for of in (bidirectional, unidirectional)
    )
    ideal, here = damps(0.0), damps(reading_s)
    row = int(np.argmin(abs(DELAYS_S - delay_s)))
    return (
        "Why the ranges of the two inertias need not overlap: a virtual inertia in a loop with lag damps, and it is "
        "that damping that steadies. What arrives psi = w (reading's age + delay + T/2) late damps m w sin(psi) if "
        "bidirectional; the gate of eq. 9 leaves 0.59 of the force and adds a lag of atan(2 / pi) = 32 degrees, both "
        "where nothing else lags (`experiment/gate.py` has the formula for all else). Without lag only the "
        "unidirectional inertia damps, m w / pi. With lag the bidirectional one damps, too, and more per kilogram, so "
        "that it needs less inertia; and the unidirectional one, being later, turns from damping to driving at a lower "
        "frequency, or at a higher one where the reading's age has turned the gate. Between the two turns the ranges "
        f"exclude each other. With an ideal reading and {1e3 * delay_s:g} ms of delay bidirectional inertia alone "
        f"damps at {_bands(ideal[row], 1)}, unidirectional alone at {_bands(ideal[row], 2)}; with a reading "
        f"{1e3 * reading_s:.2f} ms old (the unit's filter taken as a delay) at {_bands(here[row], 1)}, and at "
        f"{_bands(here[row], 2)}. The gate opens for longer the older the reading, until at "
        f"{always_open_Hz(reading_s=reading_s):.0f} Hz it never closes: there "
        "the two are one and the same. So they are where the velocity reads 0, within one step of the encoder, since "
        "eq. 9 has >= 0: a swing of less than a count meets a bidirectional inertia. In this reading the walls of 2.5 "
        f"to 7 N/mm swing at {here_Hz[0]:.0f} to {here_Hz[1]:.0f} Hz where nothing steadies them. There the "
        f"bidirectional inertia damps {two:.2f} m w and the unidirectional {one:.2f} m w. Ranges that exclude each "
        "other ask for swings nearer to where one of them drives: a stiffer contact or more lag than this reading has."
    )


def _bands(codes: np.ndarray, code: int) -> str:
    """The frequencies at which this damps what the code says: "96 to 144 and 310 to 360 Hz"."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], codes == code, [False]])))
    bands = [
        f"{FREQUENCIES_HZ[first]:.0f} to {FREQUENCIES_HZ[last - 1]:.0f}"
        for first, last in zip(edges[::2], edges[1::2], strict=True)
    ]
    return f"{' and '.join(bands)} Hz" if bands else "no frequency"


def _findings(
    found: dict[str, Range], limits: dict[str, tuple[float, float]], stiffnesses: np.ndarray
) -> list[Finding]:
    counts = {kind: one.steady.sum(axis=1) for kind, one in found.items()}
    widths = ", ".join(f"{k / 1e3:g}: {n}" for k, n in zip(stiffnesses, counts[KINDS[1]], strict=True) if n)
    most = {kind: having for kind, (_, having) in limits.items()}
    said = ", ".join(f"{kind} {without / 1e3:.1f} ({having / 1e3:.1f})" for kind, (without, having) in limits.items())
    numbers = f"largest steady stiffness in N/mm without (with) friction: {said}"
    damping = counts[KINDS[1]]
    shrinks = bool(damping[0] > 0 and (np.diff(damping) <= 1).all() and damping[-1] < damping[0])
    two, one = found[KINDS[2]].steady, found[KINDS[3]].steady
    low = found[KINDS[2]].sizes <= 0.01
    cells = np.array([two & ~one, one & ~two, two & one])
    exclusive = (
        "steady with bidirectional only / unidirectional only / both: {} / {} / {} cells".format(
            *cells.sum(axis=(1, 2))
        )
        + ", up to 10 g {} / {} / {}".format(*cells[:, :, low].sum(axis=(1, 2)))
        + "; where and why they can exclude each other is below"
    )
    alone, shared = cells[:2, :, low].sum(axis=(1, 2)), cells[2][:, low].sum()
    is_exclusive = bool((alone > 0).all() and shared == 0)
    wider = counts[KINDS[3]].sum() > counts[KINDS[2]].sum() and most[KINDS[3]] > most[KINDS[2]]
    cells_said = f"{numbers}; steady cells {counts[KINDS[3]].sum()} against {counts[KINDS[2]].sum()}"
    return [
        under_the_reading(WIDE, shrinks, f"steady sizes of {len(found[KINDS[1]].sizes)} by N/mm: {widths or 'none'}"),
        under_the_reading(DAMPING, abs(most[KINDS[1]] - 4500.0) <= 500.0, numbers),
        under_the_reading(SIMILAR, abs(most[KINDS[2]] - 4500.0) <= 500.0, numbers),
        under_the_reading(LARGER, wider, cells_said),
        under_the_reading(EXCLUSIVE, is_exclusive, exclusive),
    ]
