"""Reaching every array that something holds, to drop loops from it or to put another in its place."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from types import BuiltinFunctionType, FunctionType, MethodType, ModuleType
from typing import Any

import numpy as np

from haploop.plant.motion.hand_force import HandForce
from haploop.protocol.arrays import Shared


def keep(root: Any, loops: np.ndarray) -> None:
    """Drop loops from all arrays that can be reached from ``root``: those whose last axis has one entry for each.

    Attributes, slots, containers and what functions close over are followed; whoever holds an array of another
    meaning must not give its last axis that length.

    Args:
        loops: whether each loop is kept, shape (loops,).
    """

    def kept(array: np.ndarray) -> np.ndarray:
        is_over_loops = array.ndim and array.shape[-1] == len(loops)
        return np.compress(loops, array, axis=-1) if is_over_loops else array

    if len(loops) > 1:
        replace_arrays(root, kept)


def replace_arrays(root: Any, change: Callable[[np.ndarray], np.ndarray]) -> None:
    """Put ``change(array)`` in place of every array that can be reached from ``root``, place by place.

    Attributes, slots, containers and what functions close over are followed, always in the same order.
    """
    replace(root, np.ndarray, change)


def replace(root: Any, kinds: type | tuple[type, ...], change: Callable[[Any], Any]) -> None:
    """The same for everything of some kinds."""
    _Walk(kinds, change).visit(root)


class _Walk:
    """One walk through everything."""

    def __init__(self, kinds: type | tuple[type, ...], change: Callable[[Any], Any]) -> None:
        self._kinds, self._change = kinds, change
        self._seen: dict[int, Any] = {}

    def visit(self, value: Any) -> Any:
        """What takes the place of ``value``; all but what is to be replaced and tuples stay what they are."""
        if isinstance(value, self._kinds):
            return self._change(value)
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
            case HandForce() if value.is_shared:
                pass
            case Shared():
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
                    object.__setattr__(value, name, self.visit(getattr(value, name)))
