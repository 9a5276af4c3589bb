"""The figures of the paper, and how they are drawn, described and kept.

A function ``make_N`` in a module with N in its name, ``figure_N`` or ``figure_M_N``, makes figure N from a ``Work`` and
returns its findings; it needs no entry anywhere. Its words are in ``words.toml``.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Callable
from importlib import import_module
from typing import Any


def _modules() -> dict[int, str]:
    names = [module.name for module in pkgutil.iter_modules(__path__) if module.name.startswith("figure_")]
    return {int(number): name for name in names for number in name.split("_")[1:]}


def numbers() -> list[int]:
    """Returns the numbers of the figures that can be made."""
    return sorted(_modules())


def maker(number: int) -> Callable[..., Any]:
    """Imports the function that makes a figure: from a ``Work`` to findings."""
    return getattr(import_module(f"{__name__}.{_modules()[number]}"), f"make_{number}")
