"""Functions of numbers and arrays as machine code (numba, the extra ``haploop[numba]``), kept from run to run.

The same operations in the same order give the same bits as Python and NumPy.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from hashlib import sha256
from importlib import import_module
from pathlib import Path
from shutil import rmtree
from types import FunctionType, ModuleType
from typing import Any


class WhereItPays:
    """A module of loops of machine code, loaded once so much was to be done in this process: sooner it costs more.

    The module has ``try_out()``, which raises where the loops cannot be compiled, or loaded.

    Attributes:
        pays: from how much on it pays.
        asked: how much was to be done so far.
    """

    def __init__(self, module: str, pays: float) -> None:
        self.pays, self.asked = pays, 0
        self._name, self._loaded = module, []

    def module_for(self, amount: int) -> Any:
        """Returns the module where it pays with so much more to do, and works; else None."""
        self.asked += amount
        return self.module() if self.asked >= self.pays else None

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


class MachineCode:
    """A compiler of the functions of a module, which keeps what it made beside that module's file.

    numba by itself looks at the file of a function alone, and would go on with machine code of changed formulas: the
    directory is that of the very sources of the module and of those whose functions it compiles.

    Attributes:
        kept: that directory; "" where there is none to write into.
    """

    def __init__(self, file: str, formulas: tuple[ModuleType, ...]) -> None:
        here = Path(file).parent / "__pycache__"
        self.kept = ""
        if os.access(here if here.exists() else here.parent, os.W_OK):
            sources = [Path(str(of)).read_bytes() for of in (__file__, file, *(of.__file__ for of in formulas))]
            self.kept = str(here / f"{Path(file).stem}-{sha256(b''.join(sources)).hexdigest()[:16]}")

    def compiled(self, function: Any, **others: Callable[..., Any]) -> Any:
        """Returns a function of numbers and arrays as machine code, with IEEE arithmetic as it is written.

        Args:
            others: what it calls by a name of its module, where that is to be something else.
        """
        import numba.core.config  # pyright: ignore[reportMissingImports]

        settings: Any = numba.core.config
        if others:
            function = FunctionType(function.__code__, function.__globals__ | others)
        before, settings.CACHE_DIR = settings.CACHE_DIR, self.kept
        try:
            return numba.njit(function, cache=bool(self.kept), fastmath=False, error_model="numpy")
        finally:
            settings.CACHE_DIR = before

    def try_out(self, function: Callable[[], object]) -> None:
        """Calls a function that compiles the loops, or loads them.

        Raises whatever numba does; the next process then finds no machine code kept, which may be damaged.
        """
        try:
            function()
        except Exception:
            rmtree(self.kept, ignore_errors=True)
            raise
