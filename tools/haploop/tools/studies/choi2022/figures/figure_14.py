"""Beyond the paper: which element steadies the stiffest wall, by the drive's mode and the loop's delay."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from haploop.tools.figure.style import INK, SMALL, dress, empty_figure
from haploop.tools.render.terminal import markdown_table
from haploop.tools.studies.choi2022.claims import Finding, claims_of
from haploop.tools.studies.choi2022.device import KINDS, Setup, elements_of
from haploop.tools.studies.choi2022.drawing import COLOURS, SHORT, legend_of_colours
from haploop.tools.studies.choi2022.theory import Best, limits
from haploop.tools.studies.choi2022.work import Work

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CLAIMS = claims_of(14)

_MODES_HZ = (60.0, 90.0, 125.0, 170.0, 225.0, 300.0, 400.0, 600.0)
_DELAYS_S = (0.0, 0.0005, 0.001, 0.0015, 0.002)
_BASE = Setup(
    mode_Hz=225.0, near_share=0.3, mode_damping=0.02, push_N=3.0, entry_m_s=0.2, hand=1.0, delay_s=0.0005,
    unit="ideal", mount="motor",
)  # fmt: skip
# By less than this nobody wins: the gated map's limits are known to some 2 %.
DRAW = 1.05


# Drives differ in where the masses sit, and in how old the reading is.
DRIVES = {
    "rotor against the rest, ideal unit": replace(_BASE, near_share=0.055),
    "near mass 0.3, ideal unit": _BASE,
    "near mass 0.3, unit of 420 Hz and 1 ms": replace(_BASE, unit="420 Hz"),
    "halves, unit on the far one, 420 Hz and 1 ms": replace(_BASE, near_share=0.45, unit="420 Hz", mount="tip"),
}


def make(work: Work) -> list[Finding]:
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
    soft, note = _drives(work)
    finding, winners = _higher(stiffness)
    work.notes.append(note)
    work.answer = work.tell("answer", cells=len(setups), winners=winners, **soft)
    return [finding]


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
        ax.text(column, row, text, ha="center", va="center", fontsize=SMALL - 1.5, color=INK)
    dress(ax, name, "mode of the drive (Hz)", "extra delay (ms)")
    ax.grid(visible=False)
    ax.set_xticks(range(len(modes)), [f"{mode:g}" for mode in modes])
    ax.set_yticks(range(len(delays)), [f"{1e3 * delay:g}" for delay in delays])


def _higher(stiffness: np.ndarray) -> tuple[Finding, str]:
    """Returns the finding, and in how many cells of the map each element wins."""
    cells = stiffness.reshape(-1, len(KINDS))
    best, by = winner(cells)
    clear = by >= DRAW
    shares = ", ".join(f"{SHORT[kind]} {np.sum(clear & (best == i))}" for i, kind in enumerate(KINDS))
    winners = f"{shares}, nobody {np.sum(~clear)}"
    uni, others = cells[:, 3], cells[:, 1:3].max(axis=1)
    above = uni >= DRAW * others
    finding = CLAIMS["higher"].holds_if(
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


def _drives(work: Work) -> tuple[dict[str, float | str], str]:
    """Returns how the softness of a drive decides: what the texts name, and a note with a table."""
    modes = (125.0, 450.0) if work.small else (100.0, 125.0, 170.0, 225.0, 300.0, 450.0, 600.0)
    found = work.map_parallel("soft and stiff drives", limits, [replace(_BASE, mode_Hz=mode) for mode in modes])
    heads = ["mode (Hz)", *(SHORT[kind] for kind in KINDS)]
    rows = [[f"{mode:g}", *(_describe(one[kind]) for kind in KINDS)] for mode, one in zip(modes, found, strict=True)]
    ahead = [max(one[kind].stiffness for kind in KINDS[2:]) / max(one[KINDS[1]].stiffness, 1.0) for one in found]
    first = next((mode for mode, times in zip(modes, ahead, strict=True) if times < 1.0), None)
    turns = f"up to {modes[modes.index(first) - 1]:g} Hz; from {first:g} Hz on damping does" if first else "throughout"
    soft = {"soft": ahead[0], "soft_Hz": modes[0], "stiff": ahead[-1], "stiff_Hz": modes[-1], "turns": turns}
    return soft, work.tell("drives", table=markdown_table(heads, rows, numbers=range(len(heads))), **soft)


def _describe(best: Best) -> str:
    size = f" ({1e3 * best.size:.1f} g)" if 0 < best.size < 0.09 else f" ({best.size:.2g})" if best.size else ""
    return f"{best.stiffness / 1e3:.1f}{size}"
