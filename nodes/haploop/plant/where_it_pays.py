"""Loops of machine code that are loaded where they save time."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, ClassVar


class WhereItPays:
    """A module of machine-code loops, loaded once this process has had work enough: sooner it costs more than it saves.

    The module has ``try_out()``, which raises if the loops cannot be compiled or loaded, and ``is_made()``, which
    tells whether they were compiled before.

    Attributes:
        may_wait: whether this process may wait until they are compiled, 16 s, or a minute on a busy machine. The nodes
            of a run may not: they have deadlines, and load what is already compiled. Runs in one process and batches
            set it.
        is_off: whether everything runs without such loops; set by ``none`` alone.
        pays: the amount of work from which on loading them saves time.
        asked: the amount of work requested so far.
    """

    may_wait: ClassVar[bool] = False
    is_off: ClassVar[bool] = False

    @classmethod
    @contextmanager
    def none(cls) -> Iterator[None]:
        """Makes everything that is created meanwhile run without machine-code loops."""
        before, cls.is_off = cls.is_off, True
        try:
            yield
        finally:
            cls.is_off = before

    def __init__(self, module: str, pays: float) -> None:
        self.pays, self.asked = pays, 0
        self._name, self._loaded = module, []

    def module_for(self, amount: int) -> Any:
        """Returns the module if it pays for so much more, is compiled or may be waited for, and works; else None."""
        self.asked += amount
        pays = self.asked >= self.pays and not self.is_off
        return self.module() if pays and (self.may_wait or self._is_made()) else None

    def module(self) -> Any:
        """Returns the module, or None if it does not work."""
        if not self._loaded:
            try:
                loops = import_module(self._name)
                loops.try_out()
            except Exception:  # not installed, or not for this version of NumPy, or broken: NumPy computes the same
                loops = None
            self._loaded.append(loops)
        return self._loaded[0]

    def _is_made(self) -> bool:
        """Tells whether the loops are compiled already; imports numba for this, 1 s, only if they may be."""
        from haploop.protocol.machine_code import MADE

        spec = find_spec(self._name)
        file = Path((spec and spec.origin) or self._name)
        if not any((file.parent / "__pycache__").glob(f"{file.stem}-*/{MADE}*")):
            return False
        try:
            return import_module(self._name).is_made()
        except Exception:  # as above
            return False

    def forget(self) -> None:
        """Forgets the module, so that the next request looks for it again."""
        self._loaded.clear()
