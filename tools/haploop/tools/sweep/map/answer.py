"""What a device builder asks of a map first: the stiffest wall that is steady."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from haploop.tools.sweep.map.data import NO_CONTACT, STEADY, STIFFNESS, Axis, Cells


@dataclass(frozen=True)
class StiffestSteady:
    """A cell, as an index into the cells it was looked for in.

    Attributes:
        index: of the cell.
        open_end: whether no stiffer wall was tried with its other values.
    """

    index: tuple[int, ...]
    open_end: bool


def stiffest_steady(axes: tuple[Axis, ...], cells: Cells) -> StiffestSteady | None:
    """The stiffest steady wall below which every wall that was tried with the same other values is steady, too.

    Where several cells share it, the one in the middle of them is taken. None where the wall was not swept, or no
    softest wall is steady.

    Args:
        axes: of the cells, in the order of their dimensions.
    """
    keys = [axis.key for axis in axes]
    if STIFFNESS not in keys:
        return None
    along = keys.index(STIFFNESS)
    verdict = np.moveaxis(cells.verdict, along, -1)
    held = np.logical_and.accumulate((verdict == STEADY) | (verdict == NO_CONTACT), axis=-1) & (verdict == STEADY)
    if not held.any():
        return None
    reached = np.where(held, np.arange(held.shape[-1]), -1).max(axis=-1)
    best = np.argwhere(reached == reached.max())
    others = tuple(int(index) for index in best[len(best) // 2])
    stiffness = int(reached.max())
    index = (*others[:along], stiffness, *others[along:])
    return StiffestSteady(index, stiffness == held.shape[-1] - 1)
