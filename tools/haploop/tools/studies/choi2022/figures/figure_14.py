"""Beyond the paper: which element steadies the stiffest wall, by the drive's mode and the loop's delay."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from haploop.tools.figure.style import INK, SMALL, dress, empty_figure
from haploop.tools.render.terminal import markdown_table
from haploop.tools.studies.choi2022.device import KINDS, Setup, elements_of
from haploop.tools.studies.choi2022.figures.claims import Finding
from haploop.tools.studies.choi2022.figures.drawing import COLOURS, SHORT, legend_of_colours
from haploop.tools.studies.choi2022.figures.work import Work
from haploop.tools.studies.choi2022.theory import Best, limits

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MODES_HZ = (60.0, 80.0, 105.0, 140.0, 185.0, 245.0, 325.0, 430.0, 570.0)
# Modes of the row that is looked at more closely.
_FINE_HZ = tuple(np.geomspace(45.0, 700.0, 20).tolist())
# Share of the rows in which a rule has to hold to be called one.
_RULE = 0.9
_DELAYS_S = (0.0, 0.0005, 0.001, 0.0015, 0.002)
_BASE = Setup(
    mode_Hz=225.0, near_share=0.3, mode_damping=0.02, push_N=3.0, entry_m_s=0.2, hand=1.0, delay_s=0.0005,
    unit="ideal", mount="motor",
)  # fmt: skip
# With a smaller lead than this no element wins: the gated map's limits are known to some 2 %.
DRAW = 1.05


# Drives differ in how the mass is distributed, and in how old the reading is.
DRIVES = {
    "rotor against the rest, ideal unit": replace(_BASE, near_share=0.055),
    "near mass 0.3, ideal unit": _BASE,
    "near mass 0.3, unit of 420 Hz and 1 ms": replace(_BASE, unit="420 Hz"),
    "halves, unit on the far one, 420 Hz and 1 ms": replace(_BASE, near_share=0.45, unit="420 Hz", mount="tip"),
}


def make_14(work: Work) -> list[Finding]:
    """Computes the limits of every cell, without a run."""
    modes, delays = (_MODES_HZ[2:7:2], _DELAYS_S[1:2]) if work.small else (_MODES_HZ, _DELAYS_S)
    names = [*DRIVES][1:2] if work.small else [*DRIVES]
    cells = product((DRIVES[name] for name in names), delays, modes)
    setups = [replace(drive, mode_Hz=mode, delay_s=delay) for drive, delay, mode in cells]
    found = work.map_parallel("which element wins", limits, setups)
    best = np.array([[cell[kind] for kind in KINDS] for cell in found])
    stiffness, sizes = np.moveaxis(best.reshape(len(names), len(delays), len(modes), len(KINDS), 2), -1, 0)
    work.figure(_draw(stiffness, modes, delays, names), "figure_14")
    grid = {"mode_Hz": modes, "delay_s": delays}
    work.data("figure_14", grid | {"stiffness_N_m": stiffness, "size_N_s_m_or_kg": sizes})
    work.scene("figure_14", setups[len(setups) // 2].scene(2000.0, elements_of(KINDS[3], 0.009)))
    band, table = _band(work)
    finding, winners = _higher(work, stiffness)
    rows = soft_and_stiff(stiffness)
    count, follow, against = len(rows), int(np.sum(rows > 0)), int(np.sum(rows < 0))
    computed = {"band": band, "rows": count, "follow": follow, "against": against, "cells": len(setups)}
    computed |= {
        "scan": f"{_FINE_HZ[0]:.0f} to {_FINE_HZ[-1]:.0f}",
        "winners": winners,
        "soft_Hz": modes[0],
        "stiff_Hz": modes[-1],
    }
    work.notes.append(work.tell("rows", table=table, **computed))
    work.conclude("rule" if follow >= _RULE * count else "no_rule", supports=False, **computed)
    return [finding]


def soft_and_stiff(stiffness: np.ndarray) -> np.ndarray:
    """Returns for each row of modes whether the softest drive favours an inertia and the stiffest favours damping.

    Args:
        stiffness: shape (..., modes, kinds).

    Returns:
        1 where it is so, -1 where it is the other way round, 0 where one of the two is not clear.
    """
    ahead = _ahead(stiffness)[..., [0, -1]].reshape(-1, 2)
    clear = np.where(ahead >= DRAW, 1, np.where(ahead <= 1.0 / DRAW, -1, 0))
    return np.where(clear[:, 0] == -clear[:, 1], clear[:, 0], 0)


def _ahead(stiffness: np.ndarray) -> np.ndarray:
    """Returns the stiffness that the better inertia bears over that which damping bears."""
    return stiffness[..., 2:].max(axis=-1) / np.maximum(stiffness[..., 1], 1.0)


def winner(stiffness: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns the index of the best along the last axis, and its stiffness over the second best's."""
    order = np.sort(stiffness, axis=-1)
    return stiffness.argmax(axis=-1), order[..., -1] / np.maximum(order[..., -2], 1.0)


def _draw(stiffness: np.ndarray, modes: Sequence[float], delays: Sequence[float], names: list[str]) -> Figure:
    columns = min(len(names), 2)
    figure = empty_figure(7.6 * columns, 0.6 + 3.6 * -(-len(names) // columns))
    axes = np.atleast_1d(figure.subplots(-(-len(names) // columns), columns)).ravel()
    for ax, name, of in zip(axes, names, stiffness, strict=False):
        _panel(ax, name, of, modes, delays)
    legend_of_colours(figure, {SHORT[kind]: COLOURS[kind] for kind in KINDS} | {"by less than 5 %": "#FFFFFF"})
    return figure


def _panel(ax: Axes, name: str, stiffness: np.ndarray, modes: Sequence[float], delays: Sequence[float]) -> None:
    from matplotlib.colors import to_rgb

    best, by = winner(stiffness)
    strength = np.clip(np.log(by) / np.log(3.0), 0.3, 1.0)[..., None] * (by >= DRAW)[..., None]
    colours = np.array([to_rgb(COLOURS[kind]) for kind in KINDS])[best]
    ax.imshow(1.0 - strength * (1.0 - colours), origin="lower", aspect="auto", interpolation="nearest")
    for (row, column), times in np.ndenumerate(by):
        most = stiffness[row, column].max()
        text = f"{most / 1e3:.1f}" + (f"\n×{min(times, 99):.1f}" if times >= DRAW else "")
        tone = "white" if strength[row, column, 0] > 0.75 else INK
        ax.text(column, row, text, ha="center", va="center", fontsize=SMALL - 0.5, color=tone)
    dress(ax, name, "mode of the drive (Hz)", "extra delay (ms)")
    ax.grid(visible=False)
    ax.set_xticks(range(len(modes)), [f"{mode:g}" for mode in modes])
    ax.set_yticks(range(len(delays)), [f"{1e3 * delay:g}" for delay in delays])


def _higher(work: Work, stiffness: np.ndarray) -> tuple[Finding, str]:
    """Returns the finding, and in how many cells of the map each element wins."""
    cells = stiffness.reshape(-1, len(KINDS))
    best, by = winner(cells)
    clear = by >= DRAW
    shares = ", ".join(f"{SHORT[kind]} {np.sum(clear & (best == i))}" for i, kind in enumerate(KINDS))
    winners = f"{shares}, nobody {np.sum(~clear)}"
    uni, others = cells[:, 3], cells[:, 1:3].max(axis=1)
    above = uni >= DRAW * others
    finding = work.claims["higher"].holds_if(
        False,
        bool(above.any()),
        cells=len(cells),
        winners=winners,
        damping=np.sum(uni >= DRAW * cells[:, 1]),
        bidirectional=np.sum(uni >= DRAW * cells[:, 2]),
        both=np.sum(above),
        most=(uni / np.maximum(others, 1.0)).max(),
    )
    return finding, winners


def _band(work: Work) -> tuple[str, str]:
    """Returns where on one row an inertia bears more than damping, in words, and that row as a table."""
    modes = np.array(_FINE_HZ[::6] if work.small else _FINE_HZ)
    found = work.map_parallel("one row, finely", limits, [replace(_BASE, mode_Hz=float(mode)) for mode in modes])
    heads = ["mode (Hz)", *(SHORT[kind] for kind in KINDS)]
    rows = [[f"{mode:.0f}", *(_describe(one[kind]) for kind in KINDS)] for mode, one in zip(modes, found, strict=True)]
    ahead = _ahead(np.array([[one[kind].stiffness for kind in KINDS] for one in found]))
    most = int(ahead.argmax())
    band = ", ".join(f"{low:.0f} to {high:.0f} Hz" for low, high in bands_Hz(modes, ahead))
    words = f"{band or 'no frequency'} (at most ×{ahead[most]:.1f}, at {modes[most]:.0f} Hz)"
    return words, markdown_table(heads, rows, numbers=range(len(heads)))


def bands_Hz(modes_Hz: np.ndarray, ahead: np.ndarray) -> list[tuple[float, float]]:
    """Returns the bands of modes in which a ratio is above 1, their ends where its logarithm passes through 0."""
    logs, places = np.log(np.maximum(ahead, 1e-6)), np.log(modes_Hz)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], logs > 0.0, [False]])))
    bands = []
    for first, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        low = places[0] if first == 0 else np.interp(0.0, logs[[first - 1, first]], places[[first - 1, first]])
        high = places[-1] if end == len(logs) else np.interp(0.0, logs[[end, end - 1]], places[[end, end - 1]])
        bands.append((float(np.exp(low)), float(np.exp(high))))
    return bands


def _describe(best: Best) -> str:
    size = f" ({1e3 * best.size:.1f} g)" if 0 < best.size < 0.09 else f" ({best.size:.2g})" if best.size else ""
    return f"{best.stiffness / 1e3:.1f}{size}"
