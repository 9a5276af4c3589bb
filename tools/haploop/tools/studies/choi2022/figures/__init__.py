"""The figures of the paper: every module ``figure_N`` here is one, found by its name."""

from __future__ import annotations

import pkgutil
from importlib import import_module
from types import ModuleType


def numbers() -> list[int]:
    return sorted(int(module.name.removeprefix("figure_")) for module in pkgutil.iter_modules(__path__))


def figure(number: int) -> ModuleType:
    """Imports the module of a figure: ``CLAIMS`` by name, and ``make`` from a ``Work`` to findings."""
    return import_module(f"{__name__}.figure_{number}")
