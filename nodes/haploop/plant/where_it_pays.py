"""Loops of machine code that are loaded where they pay."""

from __future__ import annotations

from importlib import import_module
from typing import Any, ClassVar


class WhereItPays:
    """A module of loops of machine code, loaded once so much was to be done in this process: sooner it costs more.

    The module has ``try_out()``, which raises where the loops cannot be compiled, or loaded.

    Attributes:
        may_wait: whether this process may wait until they are compiled, 16 s, or a minute on a busy machine: not the
            nodes of a run, which have deadlines; runs in one process and batches set it.
        pays: from how much on it pays.
        asked: how much was to be done so far.
    """

    may_wait: ClassVar[bool] = False

    def __init__(self, module: str, pays: float) -> None:
        self.pays, self.asked = pays, 0
        self._name, self._loaded = module, []

    def module_for(self, amount: int) -> Any:
        """Returns the module where it pays with so much more to do, and may be waited for, and works; else None."""
        self.asked += amount
        return self.module() if self.may_wait and self.asked >= self.pays else None

    def module(self) -> Any:
        """Returns the module, or None where it does not work."""
        if not self._loaded:
            try:
                loops = import_module(self._name)
                loops.try_out()
            except Exception:  # not installed, or not for this version of NumPy, or broken: NumPy does the same
                loops = None
            self._loaded.append(loops)
        return self._loaded[0]

    def forget(self) -> None:
        """Has the module looked for anew when it is next asked for."""
        self._loaded.clear()
