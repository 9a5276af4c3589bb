"""A claim of the paper, and what came of it here."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

Verdict = Literal["holds", "holds under a stated assumption", "does not hold here"]
HOLDS, ASSUMING, FAILS = "holds", "holds under a stated assumption", "does not hold here"
VERDICTS: tuple[Verdict, ...] = (HOLDS, ASSUMING, FAILS)


@dataclass(frozen=True)
class Claim:
    """Something the paper says.

    Attributes:
        place: section, and figure, equation or item: "III, Fig. 4".
        quote: its words, shortened; what was left out or put in is in brackets or dots.
    """

    place: str
    quote: str

    def holds(self, numbers: str) -> Finding:
        """It is so here: without any assumption beyond the paper's own words."""
        return Finding(self, HOLDS, numbers)

    def assuming(self, assumption: str, numbers: str) -> Finding:
        """It is so where the assumption is met, and not elsewhere."""
        return Finding(self, ASSUMING, numbers, assumption)

    def fails(self, numbers: str) -> Finding:
        """It is not so here."""
        return Finding(self, FAILS, numbers)

    def judged(self, is_so: bool, numbers: str) -> Finding:
        """``holds`` or ``fails``."""
        return self.holds(numbers) if is_so else self.fails(numbers)


@dataclass(frozen=True)
class Finding:
    """What our test of a claim came to.

    Attributes:
        numbers: what was computed, with units.
        assumption: what has to be assumed for it to hold; empty for the other verdicts.
    """

    claim: Claim
    verdict: Verdict
    numbers: str
    assumption: str = ""

    def __post_init__(self) -> None:
        if self.verdict not in VERDICTS:
            raise ValueError(f"A verdict is one of {', '.join(VERDICTS)}, but {self.verdict!r} was given.")
        if bool(self.assumption) != (self.verdict == ASSUMING):
            raise ValueError(f"An assumption belongs to the verdict {ASSUMING!r} and to no other.")

    def as_dict(self) -> dict[str, Any]:
        """As it is kept beside the figure."""
        claim = {"place": self.claim.place, "quote": self.claim.quote}
        return {**claim, "verdict": self.verdict, "assumption": self.assumption, "numbers": self.numbers}

    @classmethod
    def of(cls, kept: dict[str, Any]) -> Finding:
        """Read back what ``as_dict`` gave."""
        claim = Claim(kept["place"], kept["quote"])
        return cls(claim, kept["verdict"], kept["numbers"], kept["assumption"])
