"""Dropping loops from everything that holds an array of them."""

from __future__ import annotations

from collections import deque
from types import BuiltinFunctionType, FunctionType, MethodType, ModuleType
from typing import Any

import numpy as np

from haploop.plant.hand_force_array import HandForceArray


def keep(root: Any, loops: np.ndarray) -> None:
    """Drop loops from all arrays that can be reached from ``root``: those whose last axis has one entry for each.

    Attributes, slots, containers and what functions close over are followed; whoever holds an array of another
    meaning must not give its last axis that length.

    Args:
        loops: whether each loop is kept, shape (loops,).
    """
    if len(loops) > 1:
        _Keeper(loops).visit(root)


class _Keeper:
    """One walk through everything."""

    def __init__(self, loops: np.ndarray) -> None:
        self._loops = loops
        self._seen: dict[int, Any] = {}

    def visit(self, value: Any) -> Any:
        """What takes the place of ``value``; all but arrays and tuples stay what they are."""
        if isinstance(value, np.ndarray):
            is_over_loops = value.ndim and value.shape[-1] == len(self._loops)
            return np.compress(self._loops, value, axis=-1) if is_over_loops else value
        if isinstance(value, tuple):
            items = [self.visit(item) for item in value]
            changed = any(new is not old for new, old in zip(items, value, strict=True))
            return value if not changed else type(value)(*items) if hasattr(value, "_fields") else tuple(items)
        if id(value) not in self._seen and not isinstance(value, type | ModuleType | str | int | float | None):
            self._seen[id(value)] = value
            self._inside(value)
        return value

    def _inside(self, value: Any) -> None:
        match value:
            case list():
                value[:] = map(self.visit, value)
            case deque():
                for index, item in enumerate(value):
                    value[index] = self.visit(item)
            case dict():
                value.update({key: self.visit(item) for key, item in value.items()})
            case FunctionType():
                for cell in value.__closure__ or ():
                    cell.cell_contents = self.visit(cell.cell_contents)
            case HandForceArray() if value.is_shared:
                pass
            case MethodType() | BuiltinFunctionType():
                self.visit(value.__self__)
            case _:
                self._attributes(value)

    def _attributes(self, value: Any) -> None:
        if hasattr(value, "__dict__"):
            self.visit(value.__dict__)
        for kind in type(value).__mro__:
            slots = vars(kind).get("__slots__", ())
            for name in (slots,) if isinstance(slots, str) else slots:
                if hasattr(value, name):
                    setattr(value, name, self.visit(getattr(value, name)))
