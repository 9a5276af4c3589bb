"""The figure of an advice: the stiffest wall with each element, and without each cause of buzzing."""

from __future__ import annotations

import math
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING

from haploop.tools.advise.advice import Advice
from haploop.tools.advise.buzz import Ablation, Buzz
from haploop.tools.advise.report import buzz_sentences, format_limit, format_stiffness, gain_sentences
from haploop.tools.figure import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH_IN, _ROW_IN, _BESIDE_IN = 12.5, 0.44, 1.6
_BAR = 0.62
# Colour and dashes of each bound, in the order in which they first apply.
_BOUNDS = ("#D55E00", "#CC79A7", "#009E73", "#E69F00")
_DASHES = ((), (2.0, 2.0), (1.0, 3.0))
# Letters of a sentence on a line; as many times an end as words beside it may cover.
_LINE, _CLOSE = 125, 2.2


def draw(found: Advice, target: Path) -> Path:
    """Draws into a file, in the format of its suffix; FigureError without matplotlib, or where it cannot be written."""
    return style.write_figure(figure_of(found), target)


def figure_of(found: Advice) -> Figure:
    """Makes bars of the largest steady walls; below, where something buzzes, bars of those without each cause.

    Raises FigureError where matplotlib is missing.
    """
    buzz = found.buzz if found.buzz and _rows(found.buzz) else None
    rows = [len(found.gains), *([len(_rows(buzz)) + 1] if buzz else [])]
    heights = [count * _ROW_IN + _BESIDE_IN for count in rows]
    figure = style.empty_figure(_WIDTH_IN, sum(heights))
    panels = figure.subplots(len(rows), 1, squeeze=False, height_ratios=heights)[:, 0]
    _gains(panels[0], found)
    if buzz:
        _causes(panels[1], buzz)
    return figure


def _gains(ax: Axes, found: Advice) -> None:
    """Draws a light bar for the loop as described, a dark one with everything a fifth off, and bounds as lines."""
    for row, gains in enumerate(found.gains):
        end = gains.limit.stiffness_N_m / 1e3
        safe = gains.safe.stiffness_N_m / 1e3
        labels = ("_", "_") if row else ("as described", "also with all 20 % off")  # once in the legend
        ax.barh(row, end, _BAR, color=style.WALL_FILL, edgecolor=style.WALL, linewidth=0.8, label=labels[0])
        ax.barh(row, safe, _BAR, color=style.WALL, label=labels[1])
        words = format_limit(gains.limit)
        if gains.family.parts and gains.limit.stiffness_N_m:
            words += f" with {gains.family.words(gains.values)}"
        if gains is found.safe.gains and found.safe.stiffness_N_m:
            words += f"\nuse {format_stiffness(found.safe.stiffness_N_m)}"
            words += f" with {gains.family.words(gains.safe_values)}" * (gains.safe_values != gains.values)
        lines = [found.exact_N_m[row], *(bound.stiffness_N_m for bound in found.bounds[row])]
        right = max([end, safe, *(value / 1e3 for value in lines if value)])
        _beside(ax, right, row, words, gains is found.safe.gains)
    _bounds(ax, found)
    lines = [bound.stiffness_N_m for bounds in found.bounds for bound in bounds] + found.exact_N_m
    ends = [end for gains in found.gains for end in (gains.limit.stiffness_N_m, gains.safe.stiffness_N_m)]
    ends += [value for value in lines if value]
    names = [gains.family.name for gains in found.gains]
    _finish(ax, f"{found.name}: the largest steady wall", names, ends, gain_sentences(found))


def _beside(ax: Axes, right: float, row: int, words: str, bold: bool = False) -> None:
    ax.annotate(
        words, (right, row) if right else (0.0, row), (6, 0),
        xycoords="data" if right else ax.get_yaxis_transform(), textcoords="offset points",
        va="center", fontsize=style.SMALL, color=style.INK, fontweight="bold" if bold else "normal",
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5, "alpha": 0.85},
    )  # fmt: skip


def _bounds(ax: Axes, found: Advice) -> None:
    colours: dict[str, str] = {}
    for row, (bounds, exact) in enumerate(zip(found.bounds, found.exact_N_m, strict=True)):
        lines = [("exact map, ρ(M) = 1", exact)] + [(f"{b.name} ({b.kind})", b.stiffness_N_m) for b in bounds]
        for name, stiffness in lines:
            if not stiffness:
                continue
            label = "_" if name in colours else name
            colours.setdefault(name, style.INK if name.startswith("exact") else _BOUNDS[len(colours) % len(_BOUNDS)])
            # One that lies upon another leaves it to be seen.
            dashes = (2, 1.2) if name.startswith("exact") else _DASHES[list(colours).index(name) % len(_DASHES)]
            drawn = {"color": colours[name], "linewidth": 1.8, "zorder": 4, "label": label}
            [line] = ax.plot([stiffness / 1e3] * 2, [row - 0.46, row + 0.46], **drawn)
            if dashes:
                line.set_dashes(dashes)


def _causes(ax: Axes, buzz: Buzz) -> None:
    rows = _rows(buzz)
    names = ["as it is", *(" and ".join(f"without {name}" for name in without.without) for without in rows)]
    limits = [buzz.largest, *(without.largest for without in rows)]
    wall = buzz.stiffness_N_m / 1e3
    for row, limit in enumerate(limits):
        assert limit
        cures = limit.stiffness_N_m >= buzz.stiffness_N_m
        end = limit.stiffness_N_m / 1e3
        ax.barh(row, end, _BAR, color=style.VERDICTS["steady"] if cures else "#D9B08C")
        # The words begin beyond the line of the wall where it would run through them.
        _beside(ax, wall if end < wall < _CLOSE * end else end, row, format_limit(limit))
    ax.axvline(
        wall, color=style.VERDICTS["diverged"], linewidth=1.4, label=f"its wall, {format_stiffness(buzz.stiffness_N_m)}"
    )
    question = "how far from buzzing" if buzz.steady else "why does it buzz?"
    title = f"{buzz.scene.title}: {question}"
    title = title if len(title) < 110 else f"{title[:60]} ...: {question}"
    ends = [buzz.stiffness_N_m, *(limit.stiffness_N_m for limit in limits if limit)]
    _finish(ax, title, names, ends, buzz_sentences(buzz))


def _rows(buzz: Buzz) -> list[Ablation]:
    return [without for without in (*buzz.alone, *buzz.together) if without.largest]


def _finish(ax: Axes, title: str, names: list[str], stiffnesses: list[float], sentences: list[str]) -> None:
    """Names the rows, writes the sentences below the axis, and the legend beside it, where no bar can run into it.

    The axis goes from below the softest stiffness to well above the stiffest, where the words stand.
    """
    style.dress(ax, title, "wall stiffness, N/mm", "")
    ax.set_yticks(range(len(names)), names, fontsize=style.TEXT)
    ax.set_ylim(len(names) - 0.4, -0.6)
    ax.grid(axis="y", visible=False)
    real = [value / 1e3 for value in stiffnesses if value > 0.0 and math.isfinite(value)] or [1e-3, 1.0]
    low, high = min(real) / 3.0, max(real)
    ax.set_xscale("log")
    ax.set_xlim(low, high * (high / low) ** 0.55)
    style.plain_numbers(ax.xaxis)
    if math.log10(high / low) > 2.0:
        from matplotlib.ticker import LogLocator

        ax.xaxis.set_major_locator(LogLocator())
    text = "\n".join(["wall stiffness, N/mm", *textwrap.wrap(" ".join(sentences), _LINE)])
    ax.set_xlabel(text, loc="left", fontsize=style.TEXT, color=style.GREY, linespacing=1.5)
    handles, labels = ax.get_legend_handles_labels()
    if handles:
        ax.legend(handles, labels, loc="upper left", bbox_to_anchor=(1.01, 1.0), fontsize=style.SMALL, frameon=False)
