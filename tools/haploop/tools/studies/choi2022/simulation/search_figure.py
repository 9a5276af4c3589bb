"""The picture of a search: how often each claim holds, by what was chosen."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from haploop.tools.figure.style import INK, SMALL, TEXT, empty_figure
from haploop.tools.studies.choi2022.simulation.shares import Option, percent

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def share_map(found: Sequence[Option], claims: Sequence[str], readings: int) -> Figure:
    """A row an option, a column a claim, the share of readings as colour and number."""
    table = np.array([[option.share(claim) for claim in claims] for option in found])
    figure = empty_figure(11.5, 2.0 + 0.2 * len(found))
    ax = figure.subplots()
    ax.pcolormesh(table, cmap="YlGnBu", vmin=0.0, vmax=1.0, edgecolors="white", linewidth=0.5)
    for row, column in np.ndindex(*table.shape):
        value = table[row, column]
        words = percent(float(value)).removesuffix(" %")
        colour = "white" if value > 0.55 else INK
        ax.text(column + 0.5, row + 0.5, words, ha="center", va="center", fontsize=SMALL - 1, color=colour)
    ax.set_xticks(np.arange(len(claims)) + 0.5, claims, rotation=40, ha="left", fontsize=SMALL)
    ax.xaxis.tick_top()
    names = [option.name if _same(found, i) else f"{option.dimension}: {option.name}" for i, option in enumerate(found)]
    ax.set_yticks(np.arange(len(found)) + 0.5, names, fontsize=SMALL)
    ax.invert_yaxis()
    for i in range(1, len(found)):
        if not _same(found, i):
            ax.axhline(i, color=INK, linewidth=0.7)
    ax.tick_params(length=0)
    for spine in ax.spines.values():
        spine.set_visible(False)
    ax.set_xlabel(f"% of {readings} random readings for which the claim holds", fontsize=TEXT, color=INK)
    return figure


def _same(found: Sequence[Option], index: int) -> bool:
    """Whether an option is of the same dimension as the one before it."""
    return index > 0 and found[index].dimension == found[index - 1].dimension
