"""The figures there are: the modules ``figure_N`` of this package."""

from __future__ import annotations

import pkgutil
import re
from collections.abc import Callable, Sequence
from importlib import import_module
from typing import Protocol, cast

import haploop.tools.studies.choi2022.figures
from haploop.tools.studies.choi2022.claims import Claim, Finding
from haploop.tools.studies.choi2022.work import Work

_NAME = re.compile(r"figure_(\d+)")


class PaperFigure(Protocol):
    """What a module ``figure_N`` holds."""

    TITLE: str
    CLAIMS: Sequence[Claim]
    make: Callable[[Work], list[Finding]]


def numbers() -> list[int]:
    """The numbers of the figures, in order."""
    names = (module.name for module in pkgutil.iter_modules(haploop.tools.studies.choi2022.figures.__path__))
    return sorted(int(found[1]) for name in names if (found := _NAME.fullmatch(name)))


def figure(number: int) -> PaperFigure:
    """The module of a figure, imported."""
    return cast(PaperFigure, import_module(f"haploop.tools.studies.choi2022.figures.figure_{number}"))
