"""The figure of the other prices: bars of times, and stiffness against time for delay and control rate."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from haploop.tools.cost.data import Price, PriceGroup, chance_in
from haploop.tools.cost.figure import UNCERTAIN
from haploop.tools.figure import style
from haploop.tools.figure.data import FigureError
from haploop.tools.figure.labels import Label, place_labels
from haploop.tools.linear.stiffness_limit import StiffnessLimit
from haploop.tools.operations import AGAIN, NONE
from haploop.tools.render.units import fixed

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SIZE_IN = 15.0, 8.0
# Where each group stands: (row, rows, column) of six rows and three columns.
_PLACES = {"books": (0, 2, 0), "log": (2, 2, 0), "processes": (4, 2, 0), "effects": (0, 6, 1)}
_PLACES |= {"delay": (0, 3, 2), "control rate": (3, 3, 2)}


def figure_of(groups: list[PriceGroup]) -> Figure:
    """Makes a panel a group; raises FigureError where matplotlib is missing, or there is no group."""
    if not groups:
        raise FigureError("No price was measured, so there is nothing to draw.")
    figure = style.empty_figure(*_SIZE_IN)
    grid = figure.add_gridspec(6, 3, width_ratios=(1.0, 1.25, 1.0))
    special = {"effects": _effects, "delay": _curve, "control rate": _curve}
    for group in groups:
        row, rows, column = _PLACES[group.name]
        special.get(group.name, _bars)(figure.add_subplot(grid[row : row + rows, column]), group)
    style.fix_layout(figure)
    for ax, group in zip(figure.axes, groups, strict=True):
        _label(ax, group)
    return figure


def _bars(ax: Axes, group: PriceGroup) -> None:
    prices = group.prices
    style.dress(ax, group.title, f"{group.unit}\n{group.how}", "")
    colours = [style.GREY, *[style.WALL] * (len(prices) - 1)]
    words = [f"{fixed(price.time.median)}, {fixed(price.ratio)} ×" for price in prices]
    _rows(ax, prices, [price.time.median for price in prices], colours, words, xerr=_quartiles(prices))


def _effects(ax: Axes, group: PriceGroup) -> None:
    """Draws the time that each effect adds, the dearest first; the shaded band is chance."""
    whole = f"{group.unit}, of {fixed(group.prices[0].time.median)} with all effects"
    bare = next((f" and {fixed(p.time.median)} with none" for p in group.prices if p.what == NONE), "")
    style.dress(ax, "What each effect adds", f"{whole}{bare}; shaded: chance\n{group.how}", "")
    chance = chance_in(group)
    named = [price for price in group.prices[1:] if price.what not in (AGAIN, NONE)]
    named.sort(key=lambda price: -price.costs)
    ax.axvspan(-chance, chance, color=UNCERTAIN, zorder=0, linewidth=0, gid="chance")
    colours = [style.WALL if abs(price.costs) > chance else style.FAINT for price in named]
    _rows(ax, named, [price.costs for price in named], colours, [_counted(price, group) for price in named])


def _counted(price: Price, group: PriceGroup) -> str:
    words = fixed(price.costs, 2)
    whole, without = group.prices[0].instructions_per_tick, price.instructions_per_tick
    return words if whole is None or without is None else f"{words}; {fixed(whole - without)} instructions"


def _quartiles(prices: list[Price]) -> np.ndarray:
    """Returns how far the quartiles lie below and above the medians; shape (2, prices)."""
    times = [price.time for price in prices]
    return np.array([[time.median - time.q1, time.q3 - time.median] for time in times]).T


def _rows(
    ax: Axes, prices: list[Price], values: list[float], colours: list[str], words: list[str], **look: Any
) -> None:
    bars = ax.barh(range(len(values)), values, color=colours, height=0.62, zorder=2, ecolor=style.INK, **look)
    ax.bar_label(bars, words, padding=4, fontsize=style.SMALL, color=style.INK, gid="value")
    low, high = ax.get_xlim()
    ax.set_xlim(min(low, 0.0), high + 0.42 * (high - low))
    ax.set_yticks(range(len(prices)), [price.what for price in prices], fontsize=style.TEXT)
    ax.tick_params(axis="y", length=0)
    ax.grid(axis="y", visible=False)
    ax.invert_yaxis()
    ax.spines["left"].set_visible(False)


def _curve(ax: Axes, group: PriceGroup) -> None:
    style.dress(ax, group.title, f"{group.unit}\n{group.how}", "largest steady stiffness (N/m)")
    ax.loglog()
    style.plain_numbers(ax.xaxis)
    style.plain_numbers(ax.yaxis)
    colour = style.ELEMENTS[0] if group.name == "delay" else style.ELEMENTS[1]
    if not (limits := _limits(group)):
        return
    quartiles = _quartiles([price for price, _ in limits])
    xy = np.array([(price.time.median, limit.stiffness_N_m) for price, limit in limits])
    ax.errorbar(*xy.T, xerr=quartiles, color=colour, linewidth=1.4, elinewidth=1.0)
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
    place_labels(ax, labels, lines)
