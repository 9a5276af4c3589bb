"""Figs. 10 and 11: the stable range of each element and of damping with inertia, and why the inertias' differ."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from haploop.tools.figure.style import FAINT, GREY, INK, SMALL, TEXT, dress, empty_figure, legend, plain_numbers
from haploop.tools.render.terminal import markdown_table
from haploop.tools.studies.choi2022.device import KINDS, Setup, elements_of
from haploop.tools.studies.choi2022.experiment import LOW_KG, PAIR, PAIR_AT_N_M, shares_in
from haploop.tools.studies.choi2022.figures.claims import Finding
from haploop.tools.studies.choi2022.figures.drawing import COLOURS, INSIDE, SHORT, UPPER_LEFT, legend_of_colours
from haploop.tools.studies.choi2022.figures.work import Work
from haploop.tools.studies.choi2022.run_word import steady_to_run
from haploop.tools.studies.choi2022.steadiness import (
    STEP_N_M,
    STIFFNESSES,
    WIDEST_M,
    Range,
    Reached,
    beats,
    held,
    in_words,
    reached,
    sizes_of,
    tried,
)
from haploop.tools.studies.choi2022.theory import (
    DELAYS_S,
    FREQUENCIES_HZ,
    OLD_S,
    always_open_Hz,
    damps,
    felt_damping,
    swings_at_Hz,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_DAMPS = {
    "both drive": "#F0F0F0",
    "bidirectional damps, unidirectional drives": COLOURS["bidirectional-inertia"],
    "unidirectional damps, bidirectional drives": COLOURS["unidirectional-inertia"],
    "both damp": "#DDEBF5",
}


def make_10(work: Work) -> list[Finding]:
    """Draws the ranges, and the gate of eq. 9."""
    setup = work.nearest
    grids = {kind: tried(work, setup, kind, sizes_of(kind, work.small)) for kind in KINDS}
    most = {kind: reached(work, setup, kind) for kind in KINDS}
    starts = grids[KINDS[0]].swings_m.shape[-1]
    work.figure(_draw(grids, most), "figure_10", work.tell("seen", starts=starts, judged=len(most[KINDS[0]].steady)))
    work.figure(_gate(setup), "figure_10_gate", work.tell("seen_gate"))
    columns: dict[str, np.ndarray] = {"stiffness_N_m": STIFFNESSES}
    for kind, one in grids.items():
        columns |= {f"{kind}_size_N_s_m_or_kg": one.sizes[:, 0], f"{kind}_swing_m": one.swings_m}
    work.data("figure_10", columns)
    work.scene("figure_10", setup.scene(4500.0, elements_of(KINDS[3], 0.009)))
    bears = ", ".join(f"{SHORT[kind]} {one.describe()}" for kind, one in most.items())
    *others, uni = (most[kind] for kind in KINDS[1:])
    is_first = all(beats(uni, one) for one in others)
    by_run = {kind: in_words(steady_to_run(work, setup, kind)) for kind in KINDS}
    same, listed = {*by_run.values()}, ", ".join(f"{SHORT[kind]} {told}" for kind, told in by_run.items())
    computed = {
        "starts": len(uni.steady),
        "bears": bears,
        "by_run": listed if len(same) > 1 else f"{same.pop()} with each",
    }
    work.conclude("first" if is_first else "not_first", supports=is_first, **computed)
    work.notes = [_words(work, most, by_run), _why(work, setup)]
    return _findings(work, grids, most, bears)


def make_11(work: Work) -> list[Finding]:
    """Runs every pair at every stiffness, and judges the best of each element and of both."""
    setup = work.nearest
    grid = tried(work, setup, "both", sizes_of("both", work.small))
    level = np.append(0.0, STIFFNESSES)
    steady = np.moveaxis(grid.swings_m <= WIDEST_M, -1, 0)
    dampings, masses = (np.unique(column) for column in grid.sizes.T)
    bears = np.mean([level[held(one)] for one in steady], axis=0).reshape(len(dampings), -1)
    work.figure(_pairs(dampings, masses, bears), "figure_11")
    sizes = {"damping_N_s_m": grid.sizes[:, 0], "mass_kg": grid.sizes[:, 1], "stiffness_N_m": STIFFNESSES}
    work.data("figure_11", sizes | {"swing_m": grid.swings_m})
    work.scene("figure_11", setup.scene(PAIR_AT_N_M, elements_of("both", *PAIR)))
    damped, inertia, both = (reached(work, setup, kind) for kind in (KINDS[1], KINDS[3], "both"))
    # Inertias that steady a wall on their own, and what damping adds to them.
    alone = np.flatnonzero(bears[0, 1:]) + 1
    helped = int((bears[1:, alone].max(axis=0) >= bears[0, alone] + STEP_N_M).sum())
    damping, mass = both.sizes
    row, column = np.unravel_index(bears.argmax(), bears.shape)
    around = bears[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2] / 1e3
    kept = shares_in(work.out, work.small)
    is_more = beats(both, damped) and beats(both, inertia)
    computed = {
        "most": both.describe(),
        "damping": damping,
        "mass_g": 1e3 * mass,
        "damped": damped.describe(),
        "alone": inertia.describe(),
        "helped": helped,
        "bears": len(alone),
        "starts": len(both.steady),
        "twice": both.twice / 1e3,
        "least": around.min(),
        "around": (around.sum() - around.max()) / (around.size - 1),
        "often": kept["claims"]["11 more"]["often"] if kept else "an unknown share",
    }
    work.conclude("more" if is_more else "no_more", supports=False, **computed)
    is_near = 0.5 <= damping / PAIR[0] <= 2.0 and 0.5 <= mass / PAIR[1] <= 2.0
    holding = {
        "most": abs(1e3 * both.mean.value - PAIR_AT_N_M) <= STEP_N_M and is_near,
        "more": is_more,
        "step": helped == len(alone) > 0,
    }
    return work.findings(holding, **computed)


def _pairs(dampings: np.ndarray, masses: np.ndarray, bears: np.ndarray) -> Figure:
    """Draws the largest steady stiffness in N/m of pairs, shape (dampings, masses)."""
    figure = empty_figure(10.4, 6.0)
    ax = figure.subplots()
    image = ax.imshow(bears / 1e3, origin="lower", aspect="auto", cmap="cividis")
    for (row, column), value in np.ndenumerate(bears):
        tone = "white" if value < 0.6 * bears.max() else INK
        text = f"{value / 1e3:.1f}" if value else "–"
        ax.text(column, row, text, ha="center", va="center", fontsize=SMALL, color=tone)
    dress(ax, "", "unidirectional inertia (g)", "damping (N s/m)")
    ax.grid(visible=False)
    ax.set_xticks(range(len(masses)), [f"{1e3 * mass:.2g}" for mass in masses])
    ax.set_yticks(range(len(dampings)), [f"{damping:.2g}" for damping in dampings])
    figure.colorbar(image, ax=ax, label="largest steady stiffness (N/mm)")
    return figure


def _words(work: Work, most: dict[str, Reached], by_run: dict[str, str]) -> str:
    rows = [
        [
            SHORT[kind],
            ", ".join(f"{size:.3g} N s/m" if kind == KINDS[1] else f"{1e3 * size:.3g} g" for size in one.sizes),
            one.describe(),
            f"{min(one.steady) / 1e3:.1f} to {max(one.steady) / 1e3:.1f}",
            by_run[kind],
            f"{one.twice / 1e3:.1f}",
        ]
        for kind, one in most.items()
    ]
    heads = ["element", "best size", "N/mm, mean [95 %]", "least to most", "steady to `run`", "swings twice as wide"]
    return work.tell("words", table=markdown_table(heads, rows, numbers=(2, 3, 4, 5)))


def _draw(found: dict[str, Range], most: dict[str, Reached]) -> Figure:
    """Draws full marks for what is steady, faint ones for all else that was tried; on the right, which inertia is."""

    def marks(ax: Axes, sizes: np.ndarray, there: np.ndarray, colour: str, label: str = "") -> None:
        rows, columns = np.nonzero(there)
        style, size = (".", 2.5) if colour == FAINT else ("s", 4.5)
        ax.plot(sizes[columns], STIFFNESSES[rows] / 1e3, style, color=colour, markersize=size, label=label)

    figure = empty_figure(14.5, 4.6)
    axes = figure.subplots(1, 4, sharey=True)
    for ax, kind in zip(axes, KINDS[1:], strict=False):
        unit, label = (1.0, "damping (N s/m)") if kind == "damping" else (1e3, "inertia (g)")
        sizes, steady = unit * found[kind].sizes[:, 0], found[kind].steady
        marks(ax, sizes, ~steady, FAINT)
        marks(ax, sizes, steady, COLOURS[kind], "steady")
        mean, low, high = most[kind].mean
        ends = [[mean - low], [high - mean]]
        look = {
            "markersize": 13.0,
            "markerfacecolor": "white",
            "color": INK,
            "capsize": 4.0,
            "label": "largest, judged",
        }
        ax.errorbar([unit * most[kind].sizes[0]], [mean], ends, fmt="*", **look)
        dress(ax, f"{SHORT[kind]}: {most[kind].describe()} N/mm", label, "")
    axes[0].set_ylabel("wall stiffness (N/mm)", fontsize=TEXT, color=INK)
    two, one = (found[kind].steady for kind in KINDS[2:])
    sizes_g = found[KINDS[2]].sizes[:, 0] * 1e3
    marks(axes[3], sizes_g, two & one, GREY, "both")
    marks(axes[3], sizes_g, two & ~one, COLOURS[KINDS[2]], "bidirectional only")
    marks(axes[3], sizes_g, one & ~two, COLOURS[KINDS[3]], "unidirectional only")
    dress(axes[3], "which inertia is steady?", "inertia (g)", "")
    for ax in axes:
        ax.set_xscale("log")
        plain_numbers(ax.xaxis)
        legend(ax, **UPPER_LEFT, **INSIDE)
    axes[3].set_xlim(axes[2].get_xlim())
    return figure


def _why(work: Work, setup: Setup) -> str:
    soft_Hz, stiff_Hz = (swings_at_Hz(setup, stiffness) for stiffness in (2500.0, 7000.0))
    two, one = map(float, felt_damping(setup, np.array(np.mean([soft_Hz, stiff_Hz]))))
    reading = {"old_ms": 1e3 * OLD_S, "open_Hz": always_open_Hz(reading_s=OLD_S)}
    return work.tell("why", soft_Hz=soft_Hz, stiff_Hz=stiff_Hz, two=two, one=one, **reading)


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
        "all": cells.sum(axis=(1, 2)),
        "low_g": 1e3 * LOW_KG,
        "low": low,
    }
    near = {kind: abs(1e3 * most[kind].mean.value - 4500.0) <= STEP_N_M for kind in KINDS[1:3]}
    holding = {
        "wide": bool(sizes[0] > 0 and (np.diff(sizes) <= 1).all() and sizes[-1] < sizes[0]),
        "damping": near[KINDS[1]],
        "similar": near[KINDS[2]],
        "larger": bool(one.sum() > two.sum()) and beats(most[KINDS[3]], most[KINDS[2]]),
        "exclusive": bool((low[:2] > 0).all() and low[2] == 0),
    }
    return work.findings(holding, **computed)


def _gate(setup: Setup) -> Figure:
    """Draws felt damping over frequency with a setup, and which inertia damps over frequency and delay."""
    from matplotlib.colors import ListedColormap

    figure = empty_figure(14.0, 3.9)
    felt, *which = figure.subplots(1, 3)
    for kind, damping in zip(KINDS[2:], felt_damping(setup, FREQUENCIES_HZ), strict=True):
        felt.plot(FREQUENCIES_HZ, damping, color=COLOURS[kind], label=SHORT[kind])
    felt.axhline(0.0, color=GREY, linewidth=0.6)
    dress(felt, "in the nearest interpretation", "frequency (Hz)", "felt damping / (m w)")
    legend(felt, loc="lower right", bbox_to_anchor=(1.0, 0.0), ncols=1, **INSIDE)
    headings = {0.0: "an ideal accelerometer", OLD_S: f"a reading {1e3 * OLD_S:.2f} ms old"}
    reach = (FREQUENCIES_HZ[0], FREQUENCIES_HZ[-1], 0.0, 1e3 * DELAYS_S[-1])
    colours = {"cmap": ListedColormap(list(_DAMPS.values())), "vmin": -0.5, "vmax": 3.5, "interpolation": "nearest"}
    for ax, (reading_s, heading) in zip(which, headings.items(), strict=True):
        ax.imshow(damps(reading_s), origin="lower", aspect="auto", extent=reach, **colours)
        dress(ax, heading, "frequency (Hz)", "extra delay (ms)")
        ax.grid(visible=False)
    legend_of_colours(figure, _DAMPS)
    return figure
