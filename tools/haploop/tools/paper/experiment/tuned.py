"""The best size of an element for one wall: "best tuned to render the stiffnesses used" (Choi et al. 2022, V.B.1)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from haploop.tools.paper.experiment.many import is_steady, runs
from haploop.tools.paper.experiment.setup import Elements, Setup
from haploop.tools.paper.work import Work


class Tuned(NamedTuple):
    """The elements with which a wall swings least, and what came of that run."""

    elements: Elements
    result: dict[str, Any]

    @property
    def steady(self) -> bool:
        return is_steady(self.result)

    @property
    def swing_m(self) -> float:
        """Peak to peak over the last 0.5 s."""
        return self.result["window"]["oscillation_m"]


def tuned(work: Work, name: str, setup: Setup, stiffness: float, choices: Sequence[Elements]) -> Tuned:
    """Of some elements those that are steady, or swing least."""
    results = runs(work, name, [setup.scene(stiffness, elements) for elements in choices])
    told = [(Tuned(elements, result)) for elements, result in zip(choices, results, strict=True) if "window" in result]
    return min(told, key=lambda one: (not one.steady, one.swing_m))
