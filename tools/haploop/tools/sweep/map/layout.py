"""Which axis of a sweep goes where: along a map, or from panel to panel."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice, product
from math import prod

import numpy as np

from haploop.tools.sweep.map.data import STIFFNESS, Axis, Cells, MapData

MOST_PANELS = 12


@dataclass(frozen=True)
class Layout:
    """Numbers of the axes: of those along x and y of a panel (y is None where the amplitude is), and of the others."""

    x: int
    y: int | None
    others: tuple[int, ...]

    @classmethod
    def of(cls, axes: Sequence[Axis]) -> Layout:
        """Numbers go along the map, the wall's stiffness upwards; names, or the shortest of three, make panels."""
        numeric = [number for number, axis in enumerate(axes) if not axis.names]
        if len(numeric) == 3:
            free = [number for number in numeric if axes[number].key != STIFFNESS]
            numeric.remove(min(free, key=lambda number: (len(axes[number].values), -number)))
        along = numeric or [*range(len(axes))][:2]
        if len(along) == 2 and axes[along[0]].key == STIFFNESS:
            along.reverse()
        others = tuple(number for number in range(len(axes)) if number not in along)
        return cls(along[0], along[1] if len(along) == 2 else None, others)

    def count(self, axes: Sequence[Axis]) -> int:
        """How many panels there are."""
        return prod(len(axes[number].values) for number in self.others)

    def panels(self, data: MapData, cells: Cells) -> Iterator[Panel]:
        """The first panels, as many as are drawn."""
        lengths = [range(len(data.axes[number].values)) for number in self.others]
        for fixed in islice(product(*lengths), MOST_PANELS):
            where: list[int | slice] = [slice(None)] * len(data.axes)
            for number, index in zip(self.others, fixed, strict=True):
                where[number] = index
            pairs = [(data.axes[n].key, data.axes[n].word(i)) for n, i in zip(self.others, fixed, strict=True)]
            full = ", ".join(f"{key} = {word}" for key, word in pairs)
            short = ", ".join(f"{key.rpartition('.')[2]} = {word}" for key, word in pairs)
            titles = full, short, ", ".join(word for _, word in pairs)
            yield Panel(titles, self._taken(cells, tuple(where)))

    def _taken(self, cells: Cells, where: tuple[int | slice, ...]) -> Cells:
        """The cells of a panel, x first."""
        turned = self.y is not None and self.y < self.x
        taken = [array[where] for array in vars(cells).values()]
        return Cells(*(np.ascontiguousarray(array.T) if turned else array for array in taken))


@dataclass(frozen=True)
class Panel:
    """A part of a sweep whose cells have the values of all axes but those along it in common.

    Attributes:
        titles: these values in words, in full and ever shorter; empty words where there are none.
        cells: of shape (x values, y values) or (x values,).
    """

    titles: tuple[str, ...]
    cells: Cells
