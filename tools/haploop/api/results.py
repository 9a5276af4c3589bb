"""Results of advise and compare: the answer as attributes, the report of the command as text."""

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
        """The element to use on the loop as described: ``element``, ``held_N_m`` (N/m) and ``parameters`` in SI units.

        It is the first in the list that can be told to hold more than no element does, and cannot be told to hold less
        than any other; ``nothing`` if there is none.
        """
        return element_data(choice(self.loops[0]))

    @property
    def most(self) -> dict[str, Any]:
        """The element that holds most on the loop as described, in the same form, told from the others or not."""
        return element_data(best(self.loops[0])[0])

    @property
    def held_N_m(self) -> dict[str, float]:
        """The stiffness that each element holds on the loop as described, N/m, mean over the seeds; by its name."""
        return {row.family: element_data(row)["held_N_m"] for row in self.loops[0].rows}

    def __str__(self) -> str:
        return as_text(comparison_report(self))

    def __repr__(self) -> str:
        return f"<Comparison on {self.name}: {most_sentence(self.loops[0]).rstrip('.')}>"
