"""The row of panels with the columns that elements show of their own: a panel for each unit."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from haploop.protocol.amounts import prefix_for
from haploop.tools.figure import style
from haploop.tools.figure.time import line, mark_events

if TYPE_CHECKING:
    from matplotlib.figure import SubFigure
    from matplotlib.gridspec import GridSpec

    from haploop.tools.figure.data import Floats, RunData

_MOST_PANELS, _MOST_NAMED = 3, 2
_PREFIXED = {"J", "m", "m/s", "N", "s", "W"}
# For several columns of one element in one panel, which all have its colour.
_DASHES = ("-", (0, (4, 2)), (0, (1, 1.5)), (0, (6, 2, 1, 2)))
_NAME = re.compile(r"dissipation\.(\d+)\.(\w+)")


def own_columns(run: RunData) -> dict[str, dict[str, Floats]]:
    """Returns the columns that elements log beside their forces, by unit and then by name, at every tick."""
    units = getattr(run.controller, "units", {})
    found: dict[str, dict[str, Floats]] = {}
    for name, column in run.controller.items():
        if _NAME.fullmatch(name):
            found.setdefault(units.get(name, ""), {})[name] = column
    return found


class _Shown(NamedTuple):
    """A column of one element while it was at work: its name, the number of the element's book, times and values."""

    column: str
    element: int
    t_s: Floats
    values: Floats


def draw_own_columns(body: SubFigure, grid: GridSpec, row: int, run: RunData) -> None:
    """Draws the elements' own columns over the whole run into a row of three panels; the first units if there are more.

    An element has the same colour and name as in the other panels.
    """
    for place, (unit, columns) in enumerate(list(own_columns(run).items())[:_MOST_PANELS]):
        ax = body.add_subplot(grid[row, place])
        shown = [part for name, column in columns.items() for part in _by_element(run, name, column)]
        largest = [float(np.nanmax(np.abs(part.values), initial=0.0)) for part in shown]
        factor, letter = prefix_for(largest) if unit in _PREFIXED else (1.0, "")
        names = list(dict.fromkeys(part.column for part in shown))
        for part in shown:
            name = run.history.elements[part.element].name
            label = name if len(names) == 1 else f"{part.column} of {name}"
            look = {"linestyle": _DASHES[names.index(part.column) % len(_DASHES)]}
            line(ax, part.t_s, part.values / factor, label, style.element_colour(part.element), held=True, **look)
        ax.set_xlim(*run.span_s)
        # A single column is named at its axis, too.
        own_name = names[0] if len(names) == 1 else ""
        label = f"{own_name} ({letter}{unit})".lstrip() if unit else own_name
        title = f"Own columns: {', '.join(names)}" if len(names) <= _MOST_NAMED else f"Own columns in {unit}"
        style.dress(ax, title, "time (s)", label)
        style.legend(ax)
        mark_events([ax], run)


def _by_element(run: RunData, name: str, column: Floats) -> list[_Shown]:
    """Returns a column of the log, such as ``dissipation.0.alpha``, divided among the elements that wrote it."""
    slot, own_name = _NAME.fullmatch(name).groups()  # pyright: ignore[reportOptionalMemberAccess]
    ticks = np.rint(run.ticks_s * run.control_rate)
    parts = []
    for number, span in enumerate(run.history.elements):
        for place, first, end in span.slots:
            inside = (ticks >= first) & (ticks < end)
            if place == int(slot) and np.isfinite(column[inside]).any():
                parts.append(_Shown(own_name, number, run.ticks_s[inside], column[inside]))
    return parts
