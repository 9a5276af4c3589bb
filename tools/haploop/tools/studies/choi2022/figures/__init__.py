"""The figures of the paper: every module ``figure_N`` here is one, found by its name."""

from __future__ import annotations

import pkgutil
import re
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Protocol, cast

from haploop.tools.studies.choi2022.claims import Claim, Finding
from haploop.tools.studies.choi2022.work import Work

_NAME = re.compile(r"figure_(\d+)")


class PaperFigure(Protocol):
    """A module ``figure_N``."""

    CLAIMS: Mapping[str, Claim]
    make: Callable[[Work], list[Finding]]


def numbers() -> list[int]:
    """Returns the numbers of the figures, in order."""
    names = (module.name for module in pkgutil.iter_modules(__path__))
    return sorted(int(found[1]) for name in names if (found := _NAME.fullmatch(name)))


def figure(number: int) -> PaperFigure:
    """Imports the module of a figure."""
    return cast(PaperFigure, import_module(f"{__name__}.figure_{number}"))
