"""What a tick of many loops reads and changes, laid out as lists: so that a compiler can be given one tick."""

from __future__ import annotations

from typing import Any

import jax
import numpy as np

from haploop.launch.batch.object_state import replace

_KINDS = (np.ndarray, jax.Array, float, int)


class Leaves:
    """Every number and array that can be reached from ``root``, in an order that depends on its structure alone.

    Whole numbers and truth values are of the program that a tick is (counters, sizes, ways taken); all else is data.

    Attributes:
        data: floats and arrays.
        whole: the whole numbers.
    """

    def __init__(self, root: Any) -> None:
        self._root = root
        self.data: list[Any] = []
        self.whole: list[int] = []
        replace(root, _KINDS, self._note)

    def _note(self, value: Any) -> Any:
        (self.whole if isinstance(value, int) else self.data).append(value)
        return value

    def put(self, data: list[Any], whole: list[int]) -> None:
        """Put other values in the places of all of these; the structure is still the same."""
        new_data, new_whole = iter(data), iter(whole)
        replace(self._root, _KINDS, lambda value: next(new_whole if isinstance(value, int) else new_data))

    def shapes(self) -> tuple[Any, ...]:
        """What of the data a program depends on."""
        return tuple((np.shape(value), np.result_type(value).name) for value in self.data)
