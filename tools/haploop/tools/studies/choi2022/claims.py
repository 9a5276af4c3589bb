"""Claims of the paper, and the findings that tests of them come to."""

from __future__ import annotations

import tomllib
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any, Literal

Verdict = Literal["holds", "holds under a stated assumption", "does not hold here"]
HOLDS, ASSUMING, FAILS = "holds", "holds under a stated assumption", "does not hold here"
VERDICTS: tuple[Verdict, ...] = (HOLDS, ASSUMING, FAILS)


@dataclass(frozen=True)
class Claim:
    """A sentence of the paper.

    Attributes:
        place: section, and figure, equation or item: "III, Fig. 4".
        quote: its words, shortened; what was left out or put in is in brackets or dots.
    """

    place: str
    quote: str

    def holds(self, numbers: str) -> Finding:
        """Finds that it holds, without any assumption beyond the paper's own words."""
        return Finding(self, HOLDS, numbers)

    def assuming(self, assumption: str, numbers: str) -> Finding:
        """Finds that it holds where the assumption is met, and not elsewhere."""
        return Finding(self, ASSUMING, numbers, assumption)

    def fails(self, numbers: str) -> Finding:
        """Finds that it does not hold."""
        return Finding(self, FAILS, numbers)

    def holds_if(self, is_so: bool, numbers: str, assumption: str = "", under_it: bool = False) -> Finding:
        """Finds that it holds if ``is_so``, else that it holds under the assumption if ``under_it``, else neither."""
        if is_so:
            return self.holds(numbers)
        return self.assuming(assumption, numbers) if under_it else self.fails(numbers)


@dataclass(frozen=True)
class Finding:
    """The outcome of a test of a claim.

    Attributes:
        numbers: what was computed, with units.
        assumption: what has to be assumed for it to hold; empty for the other verdicts.

    Raises:
        ValueError: there is no such verdict, or an assumption does not belong to it.
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
        """Returns it as it is kept beside the figure."""
        kept = asdict(self)
        return kept.pop("claim") | kept

    @classmethod
    def from_dict(cls, kept: dict[str, Any]) -> Finding:
        """Reads back what ``as_dict`` returned."""
        return cls(Claim(kept["place"], kept["quote"]), kept["verdict"], kept["numbers"], kept["assumption"])


def claims_of(figure: int) -> dict[str, Claim]:
    """Returns the claims that a figure tests, by name, from ``claims.toml``."""
    return {name: Claim(**claim) for name, claim in _claims()[str(figure)].items()}


@cache
def _claims() -> dict[str, dict[str, dict[str, str]]]:
    return tomllib.loads(Path(__file__).with_name("claims.toml").read_text(encoding="utf-8"))
