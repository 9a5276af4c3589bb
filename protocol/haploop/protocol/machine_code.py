"""Functions of numbers and arrays as machine code (numba, the extra ``haploop[numba]``), kept from run to run.

The same operations in the same order give the same bits as Python and NumPy.
"""

from __future__ import annotations

import fcntl
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from hashlib import sha256
from pathlib import Path
from shutil import rmtree
from types import FunctionType, ModuleType
from typing import Any

# Prefix of the name of the file that marks the machine code beside it as complete.
MADE = "made-"
# Compiling takes 16 s, a minute on a busy machine; a process stopped meanwhile delays the others no longer than this.
_PATIENCE_S = 120.0


class MachineCode:
    """A compiler of a module's functions, which keeps the machine code beside that module's file.

    numba itself checks only the file of a function, and would continue to use the machine code of formulas that have
    changed. Here each state of the sources, of the module and of those whose functions it compiles, has its directory.

    Attributes:
        kept: the directory of the present state; "" if it cannot be written.
    """

    def __init__(self, file: str, formulas: tuple[ModuleType, ...]) -> None:
        here = Path(file).parent / "__pycache__"
        self.kept = ""
        if os.access(here if here.exists() else here.parent, os.W_OK):
            sources = [Path(str(of)).read_bytes() for of in (__file__, file, *(of.__file__ for of in formulas))]
            self.kept = str(here / f"{Path(file).stem}-{sha256(b''.join(sources)).hexdigest()[:16]}")

    def compiled(self, function: Any, inlined: bool = False, **others: Callable[..., Any]) -> Any:
        """Returns a function of numbers and arrays as machine code, with IEEE arithmetic as written.

        Args:
            inlined: whether it is inlined where it is called, which avoids passing structures of arrays.
            others: replacements for functions that it calls, by their names in its module.
        """
        import numba.core.config  # pyright: ignore[reportMissingImports]

        settings: Any = numba.core.config
        if others:
            function = FunctionType(function.__code__, function.__globals__ | others)
        before, settings.CACHE_DIR = settings.CACHE_DIR, self.kept
        try:
            return numba.njit(
                function,
                cache=bool(self.kept),
                fastmath=False,
                error_model="numpy",
                inline="always" if inlined else "never",
            )
        finally:
            settings.CACHE_DIR = before

    def try_out(self, function: Callable[[], object]) -> None:
        """Calls a function that compiles or loads the loops, and marks the kept machine code as complete.

        Raises whatever numba raises, and removes the kept machine code, which may be damaged.
        """
        try:
            with self._one_at_a_time():
                function()
                with suppress(OSError, AttributeError):  # without the mark, nodes do without the loops
                    if self.kept and not self.is_made():
                        self._mark.touch()
        except Exception:
            rmtree(self.kept, ignore_errors=True)
            raise

    @contextmanager
    def _one_at_a_time(self) -> Iterator[None]:
        """Lets one process compile where several would, such as workers of a sweep; the others load the result."""
        with ExitStack() as held:
            with suppress(OSError, AttributeError):  # without a lock each compiles
                if self.kept and not self.is_made():
                    Path(self.kept).mkdir(parents=True, exist_ok=True)
                    directory = os.open(self.kept, os.O_RDONLY)
                    held.callback(os.close, directory)
                    _wait_for(directory)
                    if self.is_made():
                        held.close()
            yield

    def is_made(self) -> bool:
        """Tells whether the loops were compiled before, for this processor, so that loading them takes about 1 s."""
        return bool(self.kept) and self._mark.exists()

    @property
    def _mark(self) -> Path:
        import numba  # pyright: ignore[reportMissingImports]
        import numba.core.registry  # pyright: ignore[reportMissingImports]

        registry: Any = numba.core.registry
        processor = registry.cpu_target.target_context.codegen().magic_tuple()
        made_for = numba.__version__, sys.implementation.cache_tag, processor
        return Path(self.kept, MADE + sha256(repr(made_for).encode()).hexdigest()[:16])


def _wait_for(directory: int) -> None:
    give_up = time.monotonic() + _PATIENCE_S
    while time.monotonic() < give_up:
        with suppress(BlockingIOError):
            fcntl.flock(directory, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return
        time.sleep(0.05)
