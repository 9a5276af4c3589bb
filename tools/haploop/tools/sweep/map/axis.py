"""An axis of a map: its values and their places, how far their cells reach, and what is written along it."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from haploop.launch.scene.toml_writer import inline
from haploop.protocol.amounts import prefix_for
from haploop.tools.figure.style import FAINT, GREY, INK, SMALL, TEXT, plain_numbers

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Units that take a prefix; stiffness, damping and mass keep the units of scene files.
_WITH_PREFIX = ("m", "s", "N", "Hz")
# Steps that differ by more than this factor are even neither in size nor in ratio; such values get cells of one width.
_UNEVEN = 4.0
# The ratios of a logarithmic axis differ by no more than this, and its values reach over at least this range.
_LIKE, _RANGE = 1.6, 8.0
# Letters along an axis, and those that each word keeps however many words there are.
_LETTERS, _LEAST_LETTERS = 90, 10
# A logarithmic axis that reaches over more than this has numbers only at the powers of ten.
_DECADES = 1000.0
# Share of a linear axis below its least value, at least.
_MARGIN = 0.015


@dataclass(frozen=True)
class Axis:
    """An axis of a sweep as a map shows it.

    Attributes:
        values: ascending; 0, 1, ... where they stand for ``names``.
        names: names of the values where these are not numbers, in the order of the sweep; else empty.
        planned: the values that the sweep asks for, ascending; a search runs others in between.
    """

    key: str
    unit: str
    values: np.ndarray
    names: tuple[str, ...] = ()
    planned: np.ndarray = field(default_factory=lambda: np.empty(0))

    @classmethod
    def from_column(cls, key: str, unit: str, column: Sequence[Any], planned: Sequence[Any] = ()) -> Axis:
        """Makes the axis of a column of the table; ``planned`` are values the sweep has, run or not."""
        given = [*planned, *column]
        if any(isinstance(value, str | bool | np.bool_ | list | dict) for value in given):
            names = tuple(dict.fromkeys(_name(value) for value in given))
            return cls(key, "", np.arange(len(names), dtype=float), names)
        values = np.unique(np.asarray(given, dtype=float))
        return cls(key, unit, values, (), np.unique(np.asarray(planned, dtype=float)) if len(planned) else values)

    def indices(self, column: Sequence[Any]) -> np.ndarray:
        """Returns the place of each entry of a column among the values."""
        if self.names:
            return np.array([self.names.index(_name(value)) for value in column], dtype=int)
        return np.searchsorted(self.values, np.asarray(column, dtype=float))

    def word(self, index: int) -> str:
        """Returns a value in words, with its unit."""
        return _short_name(self.names[index]) if self.names else with_unit(self.values[index], self.unit)

    @cached_property
    def scale(self) -> str:
        """``"linear"``, ``"log"``, or ``"even"``: cells of one width in the order of the values."""
        return "even" if self.names else _scale(self.planned)

    @cached_property
    def factor_and_unit(self) -> tuple[float, str]:
        """The factor by which the values are divided along a panel, and the unit of the result."""
        return with_prefix(self.values, self.unit)

    def place(self, values: Iterable[float]) -> np.ndarray:
        """Returns the coordinates of some values; on an even axis, others are interpolated linearly."""
        given = np.asarray(list(values), dtype=float)
        if self.scale == "even":
            return np.interp(given, self.values, np.arange(len(self.values), dtype=float))
        return given / self.factor_and_unit[0]

    @property
    def coordinates(self) -> np.ndarray:
        return self.place(self.values)

    @property
    def edges(self) -> np.ndarray:
        """Ends of the cells, half way to their neighbours, not below 0 where no value is; shape (values + 1,)."""
        at = self.coordinates
        if self.scale == "log":
            return np.exp(_halfway(np.log(at), alone=np.log(3.0)))
        ends = _halfway(at, alone=1.0 if self.scale == "even" or not at[0] else abs(at[0]))
        if self.scale == "linear" and at[0] >= 0.0:
            ends[0] = max(ends[0], 0.0)
        return ends

    @property
    def label(self) -> str:
        """The key of the scene, and the unit of the numbers along the axis."""
        unit = self.factor_and_unit[1]
        return f"{self.key} ({unit})" if unit else self.key

    def dress(self, ax: Axes, which: Literal["x", "y"], label: bool = True) -> None:
        """Sets scale, limits, numbers and label along one side of a panel."""
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
        elif len(self.values) == 1:
            axis.set_ticks(self.coordinates.tolist(), [short(self.coordinates[0])])
        else:
            ax.ticklabel_format(axis=which, useOffset=False, style="plain")
        low, high = edges[[0, -1]]
        if self.scale == "linear":  # so that a mark at the end of a cell has room
            low = min(low, self.coordinates[0] - _MARGIN * (high - low))
        ax.set(**{f"{which}lim": (low, high)})
        ax.tick_params(axis=which, labelsize=SMALL, colors=GREY, labelcolor=INK if label else "none")
        if label:
            ax.set(**{f"{which}label": self.label})
            axis.label.set(fontsize=TEXT, color=INK)
        for spine in ax.spines.values():
            spine.set_color(FAINT)

    def _names(self) -> tuple[list[float], list[str]]:
        """Returns the places of words along an even axis, at most twelve, and the words, cut to fit."""
        factor, _ = self.factor_and_unit
        words = [self.word(i) if self.names else short(value / factor) for i, value in enumerate(self.values)]
        every, most = -(-len(words) // 12), max(_LEAST_LETTERS, _LETTERS // len(words))
        cut = [word if len(word) <= most else f"{word[: most - 1]}…" for word in words]
        return [float(place) for place in range(0, len(words), every)], cut[::every]


def with_prefix(values: Iterable[float], unit: str) -> tuple[float, str]:
    """Returns the factor that suits some values, and the unit of the values divided by it."""
    factor, letter = prefix_for(values) if unit in _WITH_PREFIX else (1.0, "")
    return factor, f"{letter}{unit}"


def with_unit(value: float, unit: str) -> str:
    factor, prefixed = with_prefix([value], unit)
    return f"{short(value / factor)} {prefixed}".strip()


def short(value: float) -> str:
    """Returns a number with four digits, or with as many as it has before its point."""
    return f"{value:.4g}" if abs(value) < 1e4 else f"{value:.7g}"


def _name(value: Any) -> str:
    """Returns a value that is no number as the table has it: text unchanged, all else as TOML writes it."""
    if isinstance(value, str):
        return value
    return inline(bool(value) if isinstance(value, np.bool_) else value)


def _short_name(name: str) -> str:
    """Returns a list of elements without its punctuation, ``"damping 0.8 + brake 0.1"``; any other name unchanged."""
    if not name.startswith("["):
        return name
    try:
        elements = tomllib.loads(f"list = {name}")["list"]
        numbers = [[f"{v:g}" for v in table.values() if isinstance(v, int | float)] for table in elements]
        words = [" ".join([table["kind"], *given]) for table, given in zip(elements, numbers, strict=True)]
    except (ValueError, TypeError, KeyError, AttributeError):
        return name
    return " + ".join(words) or "none"


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
