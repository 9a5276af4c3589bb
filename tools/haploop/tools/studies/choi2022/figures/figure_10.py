"""Fig. 10: the stable range of each element, and why those of the two inertias differ."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from haploop.tools.figure.style import FAINT, GREY, dress, empty_figure, legend, plain_numbers
from haploop.tools.render.units import amount
from haploop.tools.studies.choi2022.claims import Finding, claims_of
from haploop.tools.studies.choi2022.drawing import COLOURS, INSIDE, SHORT, UPPER_LEFT
from haploop.tools.studies.choi2022.experiment.limits import swings_at_Hz
from haploop.tools.studies.choi2022.experiment.measure import LOW_KG
from haploop.tools.studies.choi2022.experiment.setup import KINDS, Setup, elements_of
from haploop.tools.studies.choi2022.experiment.tuning import FELT_M, STIFFNESSES, Range, ranges
from haploop.tools.studies.choi2022.experiment.verdicts import nearest, verdict_under_assumptions
from haploop.tools.studies.choi2022.gate import (
    DELAYS_S,
    FREQUENCIES_HZ,
    OLD_S,
    always_open_Hz,
    damps,
    felt_with,
    gate_figure,
)
from haploop.tools.studies.choi2022.work import Work

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

TITLE = "Stable range of each element"
CLAIMS = claims_of(10)


def make(work: Work) -> list[Finding]:
    """Draws the ranges, and the gate of eq. 9."""
    setup = nearest(work)
    stiffnesses = STIFFNESSES[::4] if work.small else STIFFNESSES
    found = ranges(work, setup, stiffnesses)
    work.figure(
        _draw(found, stiffnesses),
        "figure_10",
        "Every mark is a run: full where it ends without vibration, faint where it does not. Vibration is what swings "
        "beyond one encoder step to either side within the last half second, and does not die down. More sizes are "
        "tried here than in the search for interpretations and in Fig. 11, so that a wall may be steadied here that is "
        "not there.",
    )
    work.figure(
        gate_figure(setup),
        "figure_10_gate",
        "What a virtual inertia m comes to at one frequency, w = 2π times it: above in the nearest interpretation, "
        "with its delay, unit and low-pass of the velocity; below which inertia damps, over frequency and delay, with "
        "differences for the velocity.",
    )
    columns = {"stiffness_N_m": stiffnesses}
    for kind, one in found.items():
        columns |= {f"{kind}_size_N_s_m_or_kg": one.sizes, f"{kind}_steady": one.steady}
    work.data("figure_10", columns)
    work.scene("figure_10", setup.scene(4500.0, elements_of(KINDS[3], 0.009)))
    work.notes = [_why(setup), _felt(found)]
    work.answer = _answer(found, stiffnesses)
    return _findings(work, found, stiffnesses)


def _draw(found: dict[str, Range], stiffnesses: np.ndarray) -> Figure:
    figure = empty_figure(13.0, 4.6)
    axes = figure.subplots(1, 4, sharey=True, width_ratios=(1.0, 1.0, 1.0, 1.0))
    for ax, kind in zip(axes, KINDS[1:], strict=False):
        _cells(ax, found[kind], stiffnesses, kind)
    two, one = (found[kind].steady for kind in KINDS[2:])
    _marks(axes[3], found[KINDS[2]].sizes * 1e3, stiffnesses, two & one, GREY, "both")
    _marks(axes[3], found[KINDS[2]].sizes * 1e3, stiffnesses, two & ~one, COLOURS[KINDS[2]], "bidirectional only")
    _marks(axes[3], found[KINDS[2]].sizes * 1e3, stiffnesses, one & ~two, COLOURS[KINDS[3]], "unidirectional only")
    _dress(axes[3], "which inertia?", "inertia (g)", "")
    legend(axes[3], **UPPER_LEFT, **INSIDE)
    axes[3].set_xlim(axes[2].get_xlim())
    return figure


def _cells(ax: Axes, one: Range, stiffnesses: np.ndarray, kind: str) -> None:
    """Draws full marks for what is steady, faint ones for what was tried besides."""
    unit, label = (1.0, "damping (N s/m)") if kind == "damping" else (1e3, "inertia (g)")
    ax.plot(*_points(unit * one.sizes, stiffnesses, ~one.steady), ".", color=FAINT, markersize=2.5)
    _marks(ax, unit * one.sizes, stiffnesses, one.steady, COLOURS[kind], "")
    most = one.largest(stiffnesses)
    _dress(
        ax, f"{SHORT[kind]}: up to {most / 1e3:.1f} N/mm", label, "wall stiffness (N/mm)" if kind == KINDS[1] else ""
    )


def _marks(ax: Axes, sizes: np.ndarray, stiffnesses: np.ndarray, there: np.ndarray, colour: str, label: str) -> None:
    ax.plot(*_points(sizes, stiffnesses, there), "s", color=colour, markersize=4.5, label=label)


def _points(sizes: np.ndarray, stiffnesses: np.ndarray, there: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    rows, columns = np.nonzero(there)
    return sizes[columns], stiffnesses[rows] / 1e3


def _dress(ax: Axes, title: str, x_label: str, y_label: str) -> None:
    dress(ax, title, x_label, y_label)
    ax.set_xscale("log")
    plain_numbers(ax.xaxis)


def _felt(found: dict[str, Range]) -> str:
    """Returns a note on how much still moves in what is called steady."""
    left = np.concatenate([one.swings_m[one.steady] for one in found.values()])
    if not len(left):
        return ""
    return (
        "#### What is still felt\n\nA swing within one encoder step of 28.7 µm to either side counts as steady, but a "
        f"hand feels {1e6 * FELT_M:g} µm at 100 Hz (Israr, Choi and Tan 2006: 8.5 µm at 20 Hz, 0.06 µm at 320 Hz). Of "
        f"the {len(left)} steady runs {np.sum(left > FELT_M)} still move by more over the last half second, drift "
        f"included; half of them by more than {amount(float(np.median(left)), 'm', 2)}."
    )


def _why(setup: Setup) -> str:
    delay_s = setup.delay_s
    here_Hz = [swings_at_Hz(setup, stiffness) for stiffness in (2500.0, 7000.0)]
    two, one = (float(of.damping) for of in felt_with(setup, np.array(np.mean(here_Hz))))
    row = int(np.argmin(abs(DELAYS_S - delay_s)))
    ideal, old = damps(0.0)[row], damps(OLD_S)[row]
    return (
        "#### Why the ranges of the two inertias can exclude each other\n\n"
        "A virtual inertia that acts late damps, and that damping steadies. Late by ψ = w (age of the reading + delay "
        "+ T/2), the bidirectional one damps m w sin ψ: nothing without lag, most at a quarter of a swing; from half a "
        "swing on it drives. The gate of eq. 9 lets 0.59 of the force through and adds a lag of atan(2/π) = 32 degrees "
        "(where nothing else lags; `choi2022/gate.py` has the formula for all else). So without lag only the "
        "unidirectional one damps, m w/π; with lag both do, the bidirectional more per kilogram; and they turn from "
        "damping to driving at different frequencies. Between the two turns one damps and the other drives: there the "
        "ranges exclude each other.\n\n"
        f"With {1e3 * delay_s:g} ms of delay and an ideal reading bidirectional inertia alone damps at "
        f"{_bands(ideal, 1)}, unidirectional alone at {_bands(ideal, 2)}; with a reading {1e3 * OLD_S:.2f} ms old, as "
        f"of an MPU-9250 at 420 Hz, at {_bands(old, 1)}, and at {_bands(old, 2)}. The gate stays open longer the older "
        f"the reading: with this one it never closes at {always_open_Hz(reading_s=OLD_S):.0f} Hz, where the two are "
        "the same. They are the same, too, where the velocity reads 0, since eq. 9 has ≥ 0: a swing within one encoder "
        "step meets a bidirectional inertia.\n\n"
        f"In the nearest interpretation walls of 2.5 to 7 N/mm swing at {here_Hz[0]:.0f} to {here_Hz[1]:.0f} Hz where "
        f"nothing steadies them. There the bidirectional inertia damps {two:.2f} m w and the unidirectional {one:.2f} "
        "m w. Ranges that exclude each other ask for swings near a turn: a stiffer contact, or more lag."
    )


def _bands(codes: np.ndarray, code: int) -> str:
    """Returns the frequencies with a code of ``damps``: "96 to 144 and 310 to 360 Hz"."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], codes == code, [False]])))
    bands = [
        f"{FREQUENCIES_HZ[first]:.0f} to {FREQUENCIES_HZ[last - 1]:.0f}"
        for first, last in zip(edges[::2], edges[1::2], strict=True)
    ]
    return f"{' and '.join(bands)} Hz" if bands else "no frequency"


def _largest(found: dict[str, Range], stiffnesses: np.ndarray) -> dict[str, float]:
    return {kind: one.largest(stiffnesses) for kind, one in found.items()}


def _answer(found: dict[str, Range], stiffnesses: np.ndarray) -> str:
    most = _largest(found, stiffnesses)
    others = ", ".join(f"{SHORT[kind]} {most[kind] / 1e3:.1f}" for kind in KINDS[1:])
    sizes = len(found[KINDS[1]].sizes)
    return (
        "**Inertia needs the right size.** In the interpretation nearest to the paper the stiffest steady wall is, in "
        f"N/mm and with the best of {sizes} sizes of each: nothing {most['nothing'] / 1e3:.1f}, {others}. Which "
        "inertia is better hangs on the lag: late inertia damps, and the gate of eq. 9 is a lag of its own"
    )


def _findings(work: Work, found: dict[str, Range], stiffnesses: np.ndarray) -> list[Finding]:
    most, counts = _largest(found, stiffnesses), {kind: one.steady.sum(axis=1) for kind, one in found.items()}
    damping = counts[KINDS[1]]
    widths = ", ".join(f"{n} at {k / 1e3:g}" for k, n in zip(stiffnesses, damping, strict=True) if n)
    numbers = "largest steady stiffness in N/mm: " + ", ".join(f"{SHORT[k]} {of / 1e3:.1f}" for k, of in most.items())
    shrinks = bool(damping[0] > 0 and (np.diff(damping) <= 1).all() and damping[-1] < damping[0])
    two, one = found[KINDS[2]].steady, found[KINDS[3]].steady
    low = found[KINDS[2]].sizes <= LOW_KG
    cells = np.array([two & ~one, one & ~two, two & one])
    alone, shared = cells[:2, :, low].sum(axis=(1, 2)), cells[2][:, low].sum()
    exclusive = (
        "steady with bidirectional inertia only, unidirectional only, both: {}, {}, {} runs".format(
            *cells.sum(axis=(1, 2))
        )
        + f", up to {1e3 * LOW_KG:g} g {alone[0]}, {alone[1]}, {shared}; why they can, below the figure"
    )
    is_exclusive = bool((alone > 0).all() and shared == 0)
    wider = counts[KINDS[3]].sum() > counts[KINDS[2]].sum() and most[KINDS[3]] > most[KINDS[2]]
    numbers_of_runs = f"{numbers}; steady runs {counts[KINDS[3]].sum()} against {counts[KINDS[2]].sum()}"
    sizes = len(found[KINDS[1]].sizes)
    return [
        verdict_under_assumptions(
            work, CLAIMS["wide"], shrinks, f"steady sizes of {sizes}, by N/mm: {widths or 'none'}", "10 narrows"
        ),
        verdict_under_assumptions(
            work, CLAIMS["damping"], abs(most[KINDS[1]] - 4500.0) <= 500.0, numbers, "10 damping 4.5"
        ),
        verdict_under_assumptions(
            work, CLAIMS["similar"], abs(most[KINDS[2]] - 4500.0) <= 500.0, numbers, "10 bidirectional 4.5"
        ),
        verdict_under_assumptions(work, CLAIMS["larger"], wider, numbers_of_runs, "10 larger"),
        verdict_under_assumptions(work, CLAIMS["exclusive"], is_exclusive, exclusive, "10 exclusive"),
    ]
