"""The row of panels with what elements show of themselves: a panel for each unit."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from haploop.tools.figure import style
from haploop.tools.figure.time import line, mark_events
from haploop.tools.render.units import prefix_for

if TYPE_CHECKING:
    from matplotlib.figure import SubFigure
    from matplotlib.gridspec import GridSpec

    from haploop.tools.figure.data import Floats, RunData

_MOST_PANELS = 3
_PREFIXED = {"J", "m", "m/s", "N", "s", "W"}
_NAME = re.compile(r"dissipation\.(\d+)\.(\w+)")


def own_columns(run: RunData) -> dict[str, dict[str, Floats]]:
    """Returns by unit what elements show in the log beside their forces, by name, at every tick."""
    units = getattr(run.controller, "units", {})
    found: dict[str, dict[str, Floats]] = {}
    for name, column in run.controller.items():
        if _NAME.fullmatch(name):
            found.setdefault(units.get(name, ""), {})[name] = column
    return found


def draw_own_columns(body: SubFigure, grid: GridSpec, row: int, run: RunData) -> None:
    """Draws them over the whole run into a row of a grid of three columns; the first units, where there are more."""
    shown = list(own_columns(run).items())[:_MOST_PANELS]
    for place, (unit, columns) in enumerate(shown):
        ax = body.add_subplot(grid[row, place])
        largest = [float(np.nanmax(np.abs(column), initial=0.0)) for column in columns.values()]
        factor, letter = prefix_for(largest) if unit in _PREFIXED else (1.0, "")
        for number, (name, column) in enumerate(columns.items()):
            label = "{1} of element {0}".format(*_parts(name))
            line(ax, run.ticks_s, column / factor, label, style.element_colour(number), held=True)
        ax.set_xlim(*run.span_s)
        # One alone is named at its axis, too.
        own_name = _parts(next(iter(columns)))[1] if len(columns) == 1 else ""
        label = f"{own_name} ({letter}{unit})".lstrip() if unit else own_name
        style.dress(ax, "Elements' own columns", "time (s)", label)
        style.legend(ax)
        mark_events([ax], run)


def _parts(name: str) -> tuple[str, ...]:
    """Returns the element's number and the column's own name, of a name such as ``dissipation.0.alpha``."""
    return _NAME.fullmatch(name).groups()  # pyright: ignore[reportOptionalMemberAccess]
