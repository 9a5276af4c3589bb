"""The figure of the other prices: bars of times, and stiffness against time for delay and control rate."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from haploop.protocol.amounts import fixed
from haploop.tools.cost.data import Price, PriceGroup, Spread
from haploop.tools.cost.findings import effects_sentence, interval
from haploop.tools.figure import style
from haploop.tools.figure.data import FigureError
from haploop.tools.figure.labels import Label, place_labels
from haploop.tools.linear.stiffness_limit import StiffnessLimit
from haploop.tools.operations import NONE, WHOLE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SIZE_IN = 15.0, 8.0
# Where each group stands: (row, rows, column) of six rows and three columns.
_PLACES = {"books": (0, 2, 0), "log": (2, 2, 0), "processes": (4, 2, 0), "effects": (0, 6, 1)}
_PLACES |= {"delay": (0, 3, 2), "control rate": (3, 3, 2)}


def figure_of(groups: list[PriceGroup]) -> Figure:
    """Makes a panel per group; raises FigureError if matplotlib is missing or there is no group."""
    if not groups:
        raise FigureError("No price was measured, so there is nothing to draw.")
    figure = style.empty_figure(*_SIZE_IN)
    grid = figure.add_gridspec(6, 3, width_ratios=(1.0, 1.25, 1.0))
    special = {"effects": _effects, "delay": _curve, "control rate": _curve}
    for group in groups:
        row, rows, column = _PLACES[group.name]
        special.get(group.name, _bars)(figure.add_subplot(grid[row : row + rows, column]), group)
    if sentences := [effects_sentence(group) for group in groups if group.name == "effects"]:
        figure.suptitle(sentences[0], x=0.01, ha="left", fontsize=style.TEXT + 2, color=style.INK, gid="takes away")
    style.fix_layout(figure)
    for ax, group in zip(figure.axes, groups, strict=True):
        _label(ax, group)
    return figure


def _bars(ax: Axes, group: PriceGroup) -> None:
    prices = group.prices
    style.dress(ax, group.title, f"yardsticks {group.unit}\n{group.how}", "")
    colours = [style.GREY, *[style.WALL] * (len(prices) - 1)]
    times = [price.time for price in prices]
    _rows(ax, prices, times, colours, [interval(time) for time in times])


def _effects(ax: Axes, group: PriceGroup) -> None:
    """Draws the time that each effect adds by itself, the dearest first; grey: its interval reaches 0."""
    bare = next((f"; {fixed(p.time.median, 2)} without any" for p in group.prices if p.what == NONE), "")
    style.dress(ax, "What each effect adds, alone", f"yardsticks {group.unit}{bare}\n{group.how}", "")
    named = [price for price in group.prices if price.adds and price.what != WHOLE]
    named.sort(key=lambda price: -price.adds.median if price.adds else 0.0)
    adds = [price.adds for price in named if price.adds]
    _rows(ax, named, adds, [style.WALL if add.low > 0.0 else style.FAINT for add in adds], list(map(interval, adds)))


def _errors(spreads: list[Spread]) -> np.ndarray:
    """Returns how far the ends of the intervals lie below and above the medians; shape (2, prices)."""
    return np.array([[each.median - each.low, each.high - each.median] for each in spreads]).T


def _rows(ax: Axes, prices: list[Price], spreads: list[Spread], colours: list[str], words: list[str]) -> None:
    medians = [each.median for each in spreads]
    look = {"color": colours, "height": 0.62, "zorder": 2, "ecolor": style.INK}
    ax.barh(range(len(medians)), medians, xerr=_errors(spreads), **look)
    low, high = ax.get_xlim()
    for row, (each, text) in enumerate(zip(spreads, words, strict=True)):
        beside = max(each.high, 0.0) + 0.012 * (high - low)
        ax.text(beside, row, text, va="center", fontsize=style.SMALL, color=style.INK, gid="value")
    ax.set_xlim(min(low, 0.0), high + 0.42 * (high - low))
    ax.set_yticks(range(len(prices)), [price.what for price in prices], fontsize=style.TEXT)
    ax.tick_params(axis="y", length=0)
    ax.grid(axis="y", visible=False)
    ax.invert_yaxis()
    ax.spines["left"].set_visible(False)


def _curve(ax: Axes, group: PriceGroup) -> None:
    style.dress(ax, group.title, f"yardsticks {group.unit}\n{group.how}", "largest steady stiffness (N/m)")
    ax.loglog()
    style.plain_numbers(ax.xaxis)
    style.plain_numbers(ax.yaxis)
    colour = style.ELEMENTS[0] if group.name == "delay" else style.ELEMENTS[1]
    if not (limits := _limits(group)):
        return
    xy = np.array([(price.time.median, limit.stiffness_N_m) for price, limit in limits])
    ax.errorbar(*xy.T, xerr=_errors([price.time for price, _ in limits]), color=colour, linewidth=1.4, elinewidth=1.0)
    for (_, limit), (x, y) in zip(limits, xy, strict=True):
        face, gid = (colour, "confirmed") if limit.confirmed else ("white", "not confirmed")
        ax.plot([x], [y], marker="o", color=colour, markerfacecolor=face, linestyle="none", zorder=4, gid=gid)
    ax.margins(0.12)


def _limits(group: PriceGroup) -> list[tuple[Price, StiffnessLimit]]:
    found = [(price, price.stiffness) for price in group.prices if price.stiffness]
    return sorted(found, key=lambda limit: limit[1].stiffness_N_m)


def _label(ax: Axes, group: PriceGroup) -> None:
    limits = _limits(group)
    labels = [
        Label(price.time.median, limit.stiffness_N_m, price.what, style.INK, price.what) for price, limit in limits
    ]
    lines = [np.asarray(line.get_xydata()) for line in ax.lines if line.get_marker() == "None"]
    ends = [(price.time.low, price.time.high, limit.stiffness_N_m) for price, limit in limits]
    bars = [np.array([[low, y], [high, y]]) for low, high, y in ends]
    place_labels(ax, labels, [*lines, *bars])
