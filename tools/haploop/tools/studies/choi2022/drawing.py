"""Drawings and tables of several figures: colours of elements, momentum over velocity, and what a search found."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from haploop.tools.figure.style import ELEMENTS, FAINT, INK, SMALL, TEXT, WALL, dress, empty_figure
from haploop.tools.render.terminal import markdown_table
from haploop.tools.search.random import Effort, Row
from haploop.tools.studies.choi2022.interpretations import (
    SEED,
    Found,
    InterpretationSpace,
    Option,
    decider,
    interval,
    often,
    percent,
    share,
    yes,
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
# A legend within the axes, on a ground that hides what is behind it; and one in the upper left corner.
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
    around: Sequence[Row],
    random: Sequence[Row],
    found: Sequence[Option],
) -> str:
    """Returns a table with a row a claim: where it holds, how often, and what decides it.

    Args:
        alone: interpretations with a column of yes or no, by heading.
        around, random: interpretations with a column of shares; the latter with its interval of confidence.
    """
    rows = []
    for name, about in claims.items():
        decides = decider(found, name)
        held, shares = (
            (yes(row, name) for row in alone.values()),
            (percent(share(around, name)), often(interval(random, name, space))),
        )
        rows.append([f"*{name}*", about, *held, *shares, decides.describe(name) if decides else ""])
    heads = ["claim", "as tested", *alone, "its neighbours", "at random [95 %]", "most with, least with"]
    return markdown_table(heads, rows, numbers=range(2 + len(alone), len(heads) - 1))


def search_words(
    space: InterpretationSpace, effort: Effort, found: Found[Any], claims: Collection[str]
) -> dict[str, str | float]:
    """Returns what the words on any search name: its seed and effort, the interpretations of each stage, ``claims``,
    the choices as a list, and ``counts``: how many random interpretations have how many of the claims.
    """
    holding = Counter(row["holding"] for row in found.of("random"))
    choices = (
        f"- {space.label(key)}: {', '.join(space.value(key, option) for option in some)}"
        for key, some in space.choices.items()
    )
    return {
        **Counter(row["stage"] for row in found.rows),
        "seed": SEED,
        "far": effort.far,
        "close": effort.close,
        "claims": len(claims),
        "choices": "\n".join(choices),
        "counts": ", ".join(f"{n} of {len(claims)}: {holding[n]}" for n in sorted(holding, reverse=True)),
    }


def share_map(found: Sequence[Option], claims: Sequence[str], count: int) -> Figure:
    """Draws a row an option, a column a claim, the share of interpretations as colour and number."""
    shares = np.array([[option.share(claim) for claim in claims] for option in found])
    starts = [i == 0 or option.dimension != found[i - 1].dimension for i, option in enumerate(found)]
    figure = empty_figure(11.5, 2.0 + 0.2 * len(found))
    ax = figure.subplots()
    ax.pcolormesh(shares, cmap="YlGnBu", vmin=0.0, vmax=1.0, edgecolors="white", linewidth=0.5)
    for (row, column), value in np.ndenumerate(shares):
        text = percent(float(value)).removesuffix(" %")
        colour = "white" if value > 0.55 else INK
        ax.text(column + 0.5, row + 0.5, text, ha="center", va="center", fontsize=SMALL - 1, color=colour)
    ax.set_xticks(np.arange(len(claims)) + 0.5, claims, rotation=40, ha="left", fontsize=SMALL)
    ax.xaxis.tick_top()
    names = [
        f"{option.dimension}: {option.name}" if start else option.name
        for option, start in zip(found, starts, strict=True)
    ]
    ax.set_yticks(np.arange(len(found)) + 0.5, names, fontsize=SMALL)
    ax.invert_yaxis()
    for i in np.flatnonzero(starts)[1:]:
        ax.axhline(i, color=INK, linewidth=0.7)
    ax.tick_params(length=0)
    for spine in ax.spines.values():
        spine.set_visible(False)
    ax.set_xlabel(f"% of {count} random interpretations under which the claim holds", fontsize=TEXT, color=INK)
    return figure
