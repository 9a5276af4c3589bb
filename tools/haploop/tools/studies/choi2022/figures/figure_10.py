"""Fig. 10: the stable range of each element, and why those of the two inertias differ."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from haploop.tools.figure.style import ELEMENTS, FAINT, GREY, dress, empty_figure, legend, plain_numbers
from haploop.tools.render.terminal import markdown_table
from haploop.tools.render.units import amount
from haploop.tools.studies.choi2022.claims import Finding, claims_of
from haploop.tools.studies.choi2022.device import KINDS, Setup, elements_of
from haploop.tools.studies.choi2022.drawing import COLOURS, INSIDE, SHORT, UPPER_LEFT, legend_of_colours
from haploop.tools.studies.choi2022.experiment import findings, nearest
from haploop.tools.studies.choi2022.experiment_measure import LOW_KG
from haploop.tools.studies.choi2022.steadiness import STEP_N_M, STIFFNESSES
from haploop.tools.studies.choi2022.theory import (
    DELAYS_S,
    FREQUENCIES_HZ,
    OLD_S,
    always_open_Hz,
    damps,
    felt_with,
    swings_at_Hz,
)
from haploop.tools.studies.choi2022.tuning import Range, Reached, beats, reached, sizes_of, tried
from haploop.tools.studies.choi2022.work import Work

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CLAIMS = claims_of(10)
# Felt by a hand at 100 Hz, between 8.5 um at 20 Hz and 0.06 um at 320 Hz in logarithms (Israr, Choi and Tan 2006).
FELT_M = 0.5e-6
_DAMPS = {
    "both drive": "#F0F0F0",
    "bidirectional damps, unidirectional drives": COLOURS["bidirectional-inertia"],
    "unidirectional damps, bidirectional drives": COLOURS["unidirectional-inertia"],
    "both damp": "#DDEBF5",
}


def make(work: Work) -> list[Finding]:
    """Draws the ranges, and the gate of eq. 9."""
    setup = nearest(work)
    grids = {kind: tried(work, setup, kind, sizes_of(kind, work.small)) for kind in KINDS}
    most = {kind: reached(work, setup, kind, grid) for kind, grid in grids.items()}
    work.figure(_draw(grids, most), "figure_10", work.tell("seen", starts=grids[KINDS[0]].swings_m.shape[-1]))
    work.figure(_gate(setup), "figure_10_gate", work.tell("seen_gate"))
    columns: dict[str, np.ndarray] = {"stiffness_N_m": STIFFNESSES}
    for kind, one in grids.items():
        columns |= {f"{kind}_size_N_s_m_or_kg": one.sizes[:, 0], f"{kind}_swing_m": one.swings_m}
    work.data("figure_10", columns)
    work.scene("figure_10", setup.scene(4500.0, elements_of(KINDS[3], 0.009)))
    bears = ", ".join(f"{SHORT[kind]} {one.describe()}" for kind, one in most.items())
    least, uni = (max((most[kind] for kind in of), key=lambda one: one.mean.value) for of in (KINDS[1:3], KINDS[3:]))
    computed = {"starts": len(uni.steady), "bears": bears, "uni": uni.describe(), "others": least.describe()}
    is_first = all(beats(uni, most[kind]) for kind in KINDS[1:3])
    work.conclude("first" if is_first else "not_first", supports=is_first, **computed)
    work.notes = [_words(work, most, bears), _why(work, setup), _felt(work, grids)]
    return _findings(work, grids, most, bears)


def _words(work: Work, most: dict[str, Reached], bears: str) -> str:
    rows = [
        [
            SHORT[kind],
            ", ".join(f"{size:.3g} N s/m" if kind == KINDS[1] else f"{1e3 * size:.3g} g" for size in one.sizes),
            one.describe(),
            f"{min(one.steady) / 1e3:.1f} to {max(one.steady) / 1e3:.1f}",
            f"{one.unfelt} of {len(one.steady)}",
            f"{one.twice / 1e3:.1f}",
        ]
        for kind, one in most.items()
    ]
    heads = ["element", "best size", "N/mm, mean [95 %]", "least to most", "nothing felt there", "swings twice as wide"]
    return work.tell("words", table=markdown_table(heads, rows, numbers=(2, 3, 4, 5)), bears=bears)


def _draw(found: dict[str, Range], most: dict[str, Reached]) -> Figure:
    """Draws full marks for what is steady, faint ones for what was tried besides; right, which inertia is."""

    def marks(ax: Axes, sizes: np.ndarray, there: np.ndarray, colour: str, label: str = "") -> None:
        rows, columns = np.nonzero(there)
        style, size = (".", 2.5) if colour == FAINT else ("s", 4.5)
        ax.plot(sizes[columns], STIFFNESSES[rows] / 1e3, style, color=colour, markersize=size, label=label)

    figure = empty_figure(13.0, 4.6)
    axes = figure.subplots(1, 4, sharey=True)
    for ax, kind in zip(axes, KINDS[1:], strict=False):
        unit, label = (1.0, "damping (N s/m)") if kind == "damping" else (1e3, "inertia (g)")
        sizes, steady = found[kind].sizes[:, 0], found[kind].steady
        marks(ax, unit * sizes, ~steady, FAINT)
        marks(ax, unit * sizes, steady, COLOURS[kind])
        dress(
            ax,
            f"{SHORT[kind]}: up to {most[kind].describe()} N/mm",
            label,
            "wall stiffness (N/mm)" * (kind == KINDS[1]),
        )
    two, one = (found[kind].steady for kind in KINDS[2:])
    sizes_g = found[KINDS[2]].sizes[:, 0] * 1e3
    marks(axes[3], sizes_g, two & one, GREY, "both")
    marks(axes[3], sizes_g, two & ~one, COLOURS[KINDS[2]], "bidirectional only")
    marks(axes[3], sizes_g, one & ~two, COLOURS[KINDS[3]], "unidirectional only")
    dress(axes[3], "which inertia?", "inertia (g)", "")
    for ax in axes:
        ax.set_xscale("log")
        plain_numbers(ax.xaxis)
    legend(axes[3], **UPPER_LEFT, **INSIDE)
    axes[3].set_xlim(axes[2].get_xlim())
    return figure


def _felt(work: Work, found: dict[str, Range]) -> str:
    left = np.concatenate([one.swings_m[one.steady].ravel() for one in found.values()])
    if not len(left):
        return ""
    median, moving = amount(float(np.median(left)), "m", 2), np.sum(left > FELT_M)
    return work.tell("felt", felt_um=1e6 * FELT_M, steady=len(left), moving=moving, median=median)


def _why(work: Work, setup: Setup) -> str:
    soft_Hz, stiff_Hz = (swings_at_Hz(setup, stiffness) for stiffness in (2500.0, 7000.0))
    two, one = (float(of.damping) for of in felt_with(setup, np.array(np.mean([soft_Hz, stiff_Hz]))))
    row = int(np.argmin(abs(DELAYS_S - setup.delay_s)))
    codes = {"ideal": damps(0.0)[row], "old": damps(OLD_S)[row]}
    return work.tell(
        "why",
        delay_ms=1e3 * setup.delay_s,
        **{f"{name}_two": _bands(of, 1) for name, of in codes.items()},
        **{f"{name}_one": _bands(of, 2) for name, of in codes.items()},
        old_ms=1e3 * OLD_S,
        open_Hz=always_open_Hz(reading_s=OLD_S),
        soft_Hz=soft_Hz,
        stiff_Hz=stiff_Hz,
        two=two,
        one=one,
    )


def _bands(codes: np.ndarray, code: int) -> str:
    """Returns the frequencies with a code of ``damps``: "96 to 144 and 310 to 360 Hz"."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], codes == code, [False]])))
    bands = [
        f"{FREQUENCIES_HZ[first]:.0f} to {FREQUENCIES_HZ[last - 1]:.0f}"
        for first, last in zip(edges[::2], edges[1::2], strict=True)
    ]
    return f"{' and '.join(bands)} Hz" if bands else "no frequency"


def _findings(work: Work, found: dict[str, Range], most: dict[str, Reached], bears: str) -> list[Finding]:
    damping, two, one = (found[kind].steady for kind in KINDS[1:])
    sizes = damping.sum(axis=1)
    widths = ", ".join(f"{n} at {k / 1e3:g}" for k, n in zip(STIFFNESSES, sizes, strict=True) if n)
    cells = np.array([two & ~one, one & ~two, two & one])
    low = cells[:, :, found[KINDS[2]].sizes[:, 0] <= LOW_KG].sum(axis=(1, 2))
    computed = {
        "sizes": damping.shape[1],
        "widths": widths or "none",
        "largest": bears,
        "one": one.sum(),
        "two": two.sum(),
        "all": "{}, {}, {} walls".format(*cells.sum(axis=(1, 2))),
        "low_g": 1e3 * LOW_KG,
        "low": "{}, {}, {}".format(*low),
    }
    near = {kind: abs(1e3 * most[kind].mean.value - 4500.0) <= STEP_N_M for kind in KINDS[1:3]}
    holding = {
        "wide": bool(sizes[0] > 0 and (np.diff(sizes) <= 1).all() and sizes[-1] < sizes[0]),
        "damping": near[KINDS[1]],
        "similar": near[KINDS[2]],
        "larger": bool(one.sum() > two.sum()) and beats(most[KINDS[3]], most[KINDS[2]]),
        "exclusive": bool((low[:2] > 0).all() and low[2] == 0),
    }
    return findings(work, CLAIMS, holding, **computed)


def _gate(setup: Setup) -> Figure:
    """Draws felt damping and mass over frequency with a setup, and who damps over frequency and delay."""
    figure = empty_figure(13.0, 7.0)
    axes = figure.subplots(2, 2)
    two, one = felt_with(setup, FREQUENCIES_HZ)
    damping, mass = axes[0]
    for ax, name, label in ((damping, "damping", "felt damping / (m w)"), (mass, "mass", "felt mass / m")):
        ax.plot(FREQUENCIES_HZ, getattr(two, name), color=COLOURS["bidirectional-inertia"], label="bidirectional")
        ax.plot(FREQUENCIES_HZ, getattr(one, name), color=COLOURS["unidirectional-inertia"], label="unidirectional")
        ax.axhline(0.0, color=GREY, linewidth=0.6)
        dress(ax, f"felt {name}", "frequency (Hz)", label)
    mass.plot(FREQUENCIES_HZ, one.duty, ":", color=ELEMENTS[3], linewidth=0.9, label="gate open, share")
    legend(damping)
    legend(mass)
    _who(axes[1, 0], 0.0, "who damps: an ideal accelerometer")
    _who(axes[1, 1], OLD_S, f"who damps: a reading {1e3 * OLD_S:.2f} ms old")
    legend_of_colours(figure, _DAMPS)
    return figure


def _who(ax: Axes, reading_s: float, heading: str) -> None:
    from matplotlib.colors import ListedColormap

    reach = (FREQUENCIES_HZ[0], FREQUENCIES_HZ[-1], 0.0, 1e3 * DELAYS_S[-1])
    colours = {"cmap": ListedColormap(list(_DAMPS.values())), "vmin": -0.5, "vmax": 3.5, "interpolation": "nearest"}
    ax.imshow(damps(reading_s), origin="lower", aspect="auto", extent=reach, **colours)
    dress(ax, heading, "frequency (Hz)", "extra delay (ms)")
    ax.grid(visible=False)
