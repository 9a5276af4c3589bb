"""An axis of a map: where its values stand, how far their cells reach, and what is written along it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from haploop.tools.figure.style import FAINT, GREY, INK, SMALL, TEXT, plain_numbers
from haploop.tools.sweep.map.data import Axis, short, with_prefix

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Steps as different as this are even neither in size nor in ratio; such values stand side by side in even cells.
_UNEVEN = 4.0
# Ratios of a logarithmic axis differ by no more than this, and reach over this range at least.
_LIKE, _RANGE = 1.6, 8.0
# Letters along an axis, and those left of each word however many there are.
_LETTERS, _LEAST_LETTERS = 90, 10
# A logarithmic axis that reaches over more has numbers at the powers of ten alone.
_DECADES = 1000.0


@dataclass(frozen=True)
class Ruler:
    """Converts the values of an axis to coordinates: values over a factor, in the unit that is left.

    Attributes:
        scale: ``"linear"``, ``"log"``, or ``"even"``: cells of one width in the order of the values.
    """

    axis: Axis
    scale: str
    factor: float
    unit: str

    @classmethod
    def from_axis(cls, axis: Axis) -> Ruler:
        if axis.names:
            return cls(axis, "even", 1.0, "")
        return cls(axis, _scale(axis.planned), *with_prefix(axis.values, axis.unit))

    def place(self, values: Iterable[float]) -> np.ndarray:
        """Returns the coordinates of some values; between the values of an even axis, in proportion."""
        given = np.asarray(list(values), dtype=float)
        if self.scale == "even":
            return np.interp(given, self.axis.values, np.arange(len(self.axis.values), dtype=float))
        return given / self.factor

    @property
    def coordinates(self) -> np.ndarray:
        """Those of the axis' own values."""
        return self.place(self.axis.values)

    @property
    def edges(self) -> np.ndarray:
        """Ends of the cells, half way to their neighbours; shape (values + 1,)."""
        at = self.coordinates
        if self.scale == "log":
            return np.exp(_halfway(np.log(at), alone=np.log(3.0)))
        return _halfway(at, alone=1.0 if self.scale == "even" or not at[0] else abs(at[0]))

    @property
    def label(self) -> str:
        """The scene's own key, and the unit of the numbers along the axis."""
        return f"{self.axis.key} ({self.unit})" if self.unit else self.axis.key

    def dress(self, ax: Axes, which: Literal["x", "y"], label: bool = True) -> None:
        """Sets scale, limits, numbers and label along one side of a panel; ``which`` is "x" or "y"."""
        axis = ax.xaxis if which == "x" else ax.yaxis
        edges = self.edges
        if self.scale == "log":
            ax.set(**{f"{which}scale": "log"})
            plain_numbers(axis)
            if edges[-1] > _DECADES * edges[0]:
                from matplotlib.ticker import LogLocator

                axis.set_major_locator(LogLocator(subs=(1.0,)))
        elif self.scale == "even":
            axis.set_ticks(*self._names())
        elif len(self.axis.values) == 1:
            axis.set_ticks(self.coordinates.tolist(), [short(self.coordinates[0])])
        else:
            ax.ticklabel_format(axis=which, useOffset=False, style="plain")
        ax.set(**{f"{which}lim": (edges[0], edges[-1])})
        ax.tick_params(axis=which, labelsize=SMALL, colors=GREY, labelcolor=INK if label else "none")
        if label:
            ax.set(**{f"{which}label": self.label})
            axis.label.set(fontsize=TEXT, color=INK)
        for spine in ax.spines.values():
            spine.set_color(FAINT)

    def _names(self) -> tuple[list[float], list[str]]:
        words = [self.axis.word(i) for i in range(len(self.axis.names))] or [
            short(value / self.factor) for value in self.axis.values
        ]
        every = -(-len(words) // 12)
        most = max(_LEAST_LETTERS, _LETTERS // len(words))
        cut = [word if len(word) <= most else f"{word[: most - 1]}…" for word in words]
        return [float(place) for place in range(0, len(words), every)], cut[::every]


def _scale(values: np.ndarray) -> str:
    if len(values) < 3:
        return "log" if len(values) == 2 and values[0] > 0.0 and values[1] > _RANGE * values[0] else "linear"
    steps = np.diff(values)
    if steps.max() < 1.01 * steps.min():
        return "linear"
    if values[0] > 0.0:
        ratios = values[1:] / values[:-1]
        if values[-1] >= _RANGE * values[0] and np.log(ratios.max()) <= _LIKE * np.log(ratios.min()):
            return "log"
    return "linear" if steps.max() <= _UNEVEN * steps.min() else "even"


def _halfway(at: np.ndarray, alone: float) -> np.ndarray:
    if len(at) == 1:
        return np.array([at[0] - alone / 2.0, at[0] + alone / 2.0])
    middle = (at[1:] + at[:-1]) / 2.0
    return np.concatenate([[2.0 * at[0] - middle[0]], middle, [2.0 * at[-1] - middle[-1]]])
