"""Drawings and tables that several figures share: colours of elements, momentum over velocity, results of a search."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from haploop.tools.figure.style import ELEMENTS, FAINT, INK, TEXT, WALL, dress
from haploop.tools.render.terminal import markdown_table
from haploop.tools.search.random import Effort, Row
from haploop.tools.studies.choi2022.interpretations import (
    SEED,
    Found,
    InterpretationSpace,
    Option,
    decider,
    holds,
    interval,
    often,
    tables_of,
)
from haploop.tools.studies.choi2022.sampled import steps_J

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


# Colour and short name of each kind of element, and of the wall's spring.
_LOOKS = {
    "nothing": (FAINT, "nothing"),
    "spring": (WALL, "spring"),
    "damping": (ELEMENTS[0], "damping"),
    "bidirectional-inertia": (ELEMENTS[1], "bidirectional"),
    "unidirectional-inertia": (ELEMENTS[2], "unidirectional"),
    "both": (ELEMENTS[3], "damping and unidirectional"),
}
COLOURS, SHORT = ({kind: look[i] for kind, look in _LOOKS.items()} for i in (0, 1))
# A legend within the axes, on a background that hides what is behind it; and one in the upper left corner.
INSIDE: dict[str, Any] = {"framealpha": 0.8, "edgecolor": "none"}
UPPER_LEFT: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (0.0, 1.0), "ncols": 1}
_TAKEN, _GIVEN = "#9FD3B0", "#E8A0A0"
# Steps shorter than this share of all have no arrow.
_ARROW = 0.04


def legend_of_colours(figure: Figure, colours: Mapping[str, str]) -> None:
    """Draws a legend of labelled colours below a figure."""
    from matplotlib.patches import Patch

    handles = [Patch(facecolor=colour, edgecolor=INK, linewidth=0.4, label=name) for name, colour in colours.items()]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), frameon=False, fontsize=TEXT)


def draw_momentum(ax: Axes, v_m_s: np.ndarray, mass_kg: float, title: str) -> None:
    """Draws velocity against momentum of a virtual inertia (Choi et al. 2022, Figs. 4 and 5).

    The path is the staircase v[k-1] -> v[k-1], m v[k]; the rectangle of each step is the energy taken (green) or given
    (red).
    """
    v, momentum = 1e3 * v_m_s, 1e6 * mass_kg * v_m_s
    path = [(v[0], momentum[1])]
    for k, taken in enumerate(steps_J(v_m_s, mass_kg)[2:], 2):
        colour = _TAKEN if taken >= 0.0 else _GIVEN
        ax.fill_between([v[k - 2], v[k - 1]], momentum[k], color=colour, alpha=0.45, linewidth=0)
        path += [(v[k - 2], momentum[k]), (v[k - 1], momentum[k])]
    ax.plot(*np.array(path).T, color=INK, linewidth=1.2)
    for k in range(2, len(v)):
        step, middle = v[k - 1] - v[k - 2], (v[k - 1] + v[k - 2]) / 2.0
        if abs(step) > _ARROW * np.ptp(v):
            arrow = {"arrowstyle": "->", "color": INK}
            ax.annotate("", (middle + 1e-3 * step, momentum[k]), (middle, momentum[k]), arrowprops=arrow)
    ax.axhline(0.0, color=FAINT, linewidth=0.8, zorder=0)
    dress(ax, title, "velocity v[k−1] (mm/s)", "momentum m v[k] (g mm/s)")


def claims_table(
    claims: Mapping[str, str],
    space: InterpretationSpace,
    alone: Mapping[str, Row],
    found: Found,
    options: Sequence[Option],
) -> str:
    """Returns a table with one row per claim: where it holds, how often, and what decides it.

    Args:
        alone: single interpretations, by the heading of their column of yes or no.
        options: those of the random interpretations.
    """
    random, around = found.of("random"), found.of("neighbour")
    rows: list[list[str]] = []
    for name, about in claims.items():
        held = ("yes" if holds(row, name) else "no" for row in alone.values())
        near = f"{sum(holds(row, name) for row in around)} of {len(around)}"
        shares = often(interval(random, name, space)), str(decider(options, name) or "")
        rows.append([f"*{name}*", about, *held, near, *shares])
    heads = ["claim", "as tested", *alone, "its neighbours", "at random [95 %]", "most with, least with"]
    return markdown_table(heads, rows, numbers=range(2 + len(alone), len(heads) - 1))


def open_table(space: InterpretationSpace, figure: int) -> str:
    """Returns a table of what the paper leaves open: options, or bounds and the reasons for them."""
    rows = [
        [space.label(key), ", ".join(space.value(key, one) for one in some), ""] for key, some in space.choices.items()
    ]
    whys = tables_of(figure)["numbers"]
    for key, (low, high) in space.bounds.items():
        rows.append(
            [space.label(key), f"{space.value(key, low)} to {space.value(key, high)}", whys[key].get("why", "")]
        )
    return markdown_table(["open", "drawn from", "why"], rows)


def columns_of(rows: Sequence[Row]) -> dict[str, list[Any]]:
    """Returns a table of interpretations by column."""
    return {key.replace(" ", "_"): [row[key] for row in rows] for key in rows[0]}


def search_words(found: Found, effort: Effort, claims: Collection[str]) -> dict[str, Any]:
    """Returns the values that the words on any search name: its seed and spread, the interpretations of each stage, the
    number of ``claims``, how many hold in the ``nearest``, which it ``lacks``, and how many hold at ``most``.
    """
    [nearest] = found.of("nearest")
    stages = Counter(row["stage"] for row in found.rows)
    return {
        "random": stages["random"],
        "refined": stages["refined"],
        "neighbours": stages["neighbour"],
        "seed": SEED,
        "far": effort.far,
        "close": effort.close,
        "claims": len(claims),
        "nearest": nearest["holding"],
        "lacks": ", ".join(f"*{name}*" for name in claims if not holds(nearest, name)),
        "most": max(row["holding"] for row in found.rows),
    }
