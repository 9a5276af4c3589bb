"""Results of advise and compare: the answer by name, the report of the command as text."""

from __future__ import annotations

from typing import Any

from haploop.tools.advise.advice import Advice
from haploop.tools.advise.report import report as advice_report
from haploop.tools.compare.comparison import Comparison
from haploop.tools.compare.ranking import best, choice
from haploop.tools.compare.report import element_data, most_sentence
from haploop.tools.compare.report import report as comparison_report
from haploop.tools.render.terminal import as_text


class AdviceResult(Advice):
    """An advice; ``print(advice)`` shows it as ``haploop advise`` does, ``advice.recommended`` is the answer."""

    def __str__(self) -> str:
        return as_text(advice_report(self))


class ComparisonResult(Comparison):
    """A comparison; ``print(comparison)`` shows it as ``haploop compare`` does."""

    @property
    def recommended(self) -> dict[str, Any]:
        """What to take on the loop as described: ``element``, ``held_N_m`` (N/m) and ``parameters`` in SI units.

        The first element in the list that is told to hold more than none and less than no other; ``nothing`` where
        none is.
        """
        return element_data(choice(self.loops[0]))

    @property
    def most(self) -> dict[str, Any]:
        """What holds most on the loop as described, likewise, be it told from the others or not."""
        return element_data(best(self.loops[0])[0])

    @property
    def held_N_m(self) -> dict[str, float]:
        """What each element holds on the loop as described, N/m, mean over the seeds; by its name."""
        return {row.family: element_data(row)["held_N_m"] for row in self.loops[0].rows}

    def __str__(self) -> str:
        return as_text(comparison_report(self))

    def __repr__(self) -> str:
        return f"<Comparison on {self.name}: {most_sentence(self.loops[0]).rstrip('.')}>"
