"""The figure of the other prices: bars of times, and stiffness against time for delay and control rate."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from haploop.tools.cost.data import Price, PriceGroup, chance_in
from haploop.tools.cost.figure import UNCERTAIN
from haploop.tools.figure.data import FigureError
from haploop.tools.figure.labels import Label, place_labels
from haploop.tools.figure.style import (
    ELEMENTS,
    FAINT,
    GREY,
    INK,
    SMALL,
    TEXT,
    WALL,
    dress,
    empty_figure,
    fix_layout,
    plain_numbers,
)
from haploop.tools.operations import AGAIN, NONE
from haploop.tools.render.units import fixed

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SIZE_IN = 15.0, 8.0
# Where each group stands: (row, rows, column) of six rows and three columns.
_PLACES = {"books": (0, 2, 0), "log": (2, 2, 0), "processes": (4, 2, 0), "effects": (0, 6, 1)}
_CURVES = {"delay": (0, 3, 2), "control rate": (3, 3, 2)}


def figure_of(groups: list[PriceGroup]) -> Figure:
    """Makes a panel a group; the place of a group that was not measured stays empty.

    Raises:
        FigureError: matplotlib is missing, or there is no group.
    """
    if not groups:
        raise FigureError("No price was measured, so there is nothing to draw.")
    figure = empty_figure(*_SIZE_IN)
    grid = figure.add_gridspec(6, 3, width_ratios=(1.0, 1.25, 1.0))
    curves: list[tuple[Axes, PriceGroup]] = []
    for group in groups:
        row, rows, column = (_PLACES | _CURVES)[group.name]
        ax = figure.add_subplot(grid[row : row + rows, column])
        if group.name in _CURVES:
            _curve(ax, group)
            curves.append((ax, group))
        elif group.name == "effects":
            _effects(ax, group)
        else:
            _bars(ax, group)
    fix_layout(figure)
    for ax, group in curves:
        _label(ax, group)
    return figure


def _bars(ax: Axes, group: PriceGroup) -> None:
    prices = group.prices
    colours = [GREY, *[WALL] * (len(prices) - 1)]
    _rows(ax, [price.what for price in prices], [price.time.median for price in prices], colours, group.title)
    for row, price in enumerate(prices):
        ax.plot([price.time.q1, price.time.q3], [row, row], color=INK, linewidth=1.6, gid="quartiles")
    ax.set_xlabel(f"{group.unit}\n{group.how}", fontsize=SMALL, color=INK)
    _write(ax, [(price.time.q3, f"{fixed(price.time.median)}, {fixed(price.ratio)} ×") for price in prices])


def _effects(ax: Axes, group: PriceGroup) -> None:
    """Draws the time that each effect adds, the dearest first; the shaded band is chance."""
    chance = chance_in(group)
    named = [price for price in group.prices[1:] if price.what not in (AGAIN, NONE)]
    named.sort(key=lambda price: -price.costs)
    ax.axvspan(-chance, chance, color=UNCERTAIN, zorder=0, linewidth=0, gid="chance")
    colours = [WALL if abs(price.costs) > chance else FAINT for price in named]
    _rows(ax, [price.what for price in named], [price.costs for price in named], colours, "What each effect adds")
    whole = f"{group.unit}, of {fixed(group.baseline.time.median)} with all effects"
    bare = next((f" and {fixed(p.time.median)} with none" for p in group.prices if p.what == NONE), "")
    ax.set_xlabel(f"{whole}{bare}; shaded: chance\n{group.how}", fontsize=SMALL, color=INK)
    _write(ax, [(max(price.costs, 0.0), _counted(price, group)) for price in named])


def _counted(price: Price, group: PriceGroup) -> str:
    words = fixed(price.costs, 2)
    whole, without = group.baseline.instructions_per_tick, price.instructions_per_tick
    return words if whole is None or without is None else f"{words}; {fixed(whole - without)} instructions"


def _rows(ax: Axes, names: list[str], values: list[float], colours: list[str], title: str) -> None:
    dress(ax, title, "", "")
    ax.barh(range(len(values)), values, color=colours, height=0.62, zorder=2)
    ax.set_yticks(range(len(names)), names, fontsize=TEXT)
    ax.tick_params(axis="y", length=0)
    ax.grid(axis="y", visible=False)
    ax.invert_yaxis()
    ax.spines["left"].set_visible(False)


def _write(ax: Axes, ends: list[tuple[float, str]]) -> None:
    low, high = ax.get_xlim()
    ax.set_xlim(min(low, 0.0), high + 0.42 * (high - low))
    gap = 0.015 * (high - low)
    for row, (end, words) in enumerate(ends):
        ax.text(end + gap, row, words, va="center", fontsize=SMALL, color=INK, gid="value")


def _curve(ax: Axes, group: PriceGroup) -> None:
    """Draws the largest steady stiffness against time; hollow where runs did not agree with it."""
    dress(ax, group.title, f"{group.unit}\n{group.how}", "largest steady stiffness (N/m)")
    ax.xaxis.label.set_fontsize(SMALL)
    ax.set_xscale("log")
    ax.set_yscale("log")
    plain_numbers(ax.xaxis)
    plain_numbers(ax.yaxis)
    colour = ELEMENTS[0] if group.name == "delay" else ELEMENTS[1]
    prices = _with_limit(group)
    xy = np.array([(price.time.median, price.stiffness.stiffness_N_m) for price in prices if price.stiffness])
    if not len(xy):
        return
    ax.plot(*xy.T, color=colour, linewidth=1.4, zorder=2, gid=f"line {group.name}")
    for price, (x, y) in zip(prices, xy, strict=True):
        assert price.stiffness is not None
        face = colour if price.stiffness.confirmed else "white"
        ax.plot([price.time.q1, price.time.q3], [y, y], color=colour, linewidth=1.0, gid="quartiles")
        gid = "confirmed" if price.stiffness.confirmed else "not confirmed"
        ax.plot([x], [y], marker="o", color=colour, markerfacecolor=face, linestyle="none", zorder=4, gid=gid)
    ax.margins(0.12)


def _with_limit(group: PriceGroup) -> list[Price]:
    prices = [price for price in group.prices if price.stiffness]
    return sorted(prices, key=lambda price: price.stiffness.stiffness_N_m if price.stiffness else 0.0)


def _label(ax: Axes, group: PriceGroup) -> None:
    labels = [
        Label(price.time.median, price.stiffness.stiffness_N_m, price.what, INK, price.what)
        for price in _with_limit(group)
        if price.stiffness
    ]
    lines = [np.asarray(line.get_xydata()) for line in ax.lines if line.get_marker() == "None"]
    place_labels(ax, labels, lines)
