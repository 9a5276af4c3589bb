"""The best size of an element for one wall: "best tuned to render the stiffnesses used" (Choi et al. 2022, V.B.1)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from haploop.tools.render.units import amount
from haploop.tools.studies.choi2022.experiment.map_parallel import is_steady, runs
from haploop.tools.studies.choi2022.experiment.setup import Elements, Setup
from haploop.tools.studies.choi2022.work import Work

# An encoder's step to either side; what is steady and swings wider is dying down.
_STEPS_M = 2.0 * 28.7e-6


class Tuned(NamedTuple):
    """The elements with which a wall swings least, and what came of that run."""

    elements: Elements
    result: dict[str, Any]

    @property
    def steady(self) -> bool:
        return is_steady(self.result)

    @property
    def ended(self) -> str:
        """The verdict, and how it swings at last."""
        if not self.swing_m:
            return f"{self.result['verdict']}, comes to rest"
        dying = ", dying down" if self.steady and self.swing_m > _STEPS_M else ""
        return f"{self.result['verdict']}, swings {amount(self.swing_m, 'm')} peak to peak{dying}"

    @property
    def swing_m(self) -> float:
        """Peak to peak over the last 0.5 s."""
        return self.result["window"]["oscillation_m"]


def tuned(work: Work, name: str, setup: Setup, stiffness: float, choices: Sequence[Elements]) -> Tuned:
    """Of some elements those that are steady, or swing least."""
    results = runs(work, name, [setup.scene(stiffness, elements) for elements in choices])
    told = [(Tuned(elements, result)) for elements, result in zip(choices, results, strict=True) if "window" in result]
    return min(told, key=lambda one: (not one.steady, one.swing_m))
