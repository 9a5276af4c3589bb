"""The figures of the paper: every module ``figure_N`` here is one, found by its name."""

from __future__ import annotations

import pkgutil
import re
from importlib import import_module
from types import ModuleType

_NAME = re.compile(r"figure_(\d+)")


def numbers() -> list[int]:
    names = (module.name for module in pkgutil.iter_modules(__path__))
    return sorted(int(found[1]) for name in names if (found := _NAME.fullmatch(name)))


def figure(number: int) -> ModuleType:
    """Imports the module of a figure: ``CLAIMS`` by name, and ``make`` from a ``Work`` to findings."""
    return import_module(f"{__name__}.figure_{number}")
