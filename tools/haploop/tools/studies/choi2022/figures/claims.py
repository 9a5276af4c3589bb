"""Claims of the paper, the findings that result from testing them, and the texts of the figures (``words.toml``)."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, Literal, cast, get_args

Verdict = Literal["holds", "holds under a stated assumption", "rare", "does not hold here"]
VERDICTS: tuple[Verdict, ...] = get_args(Verdict)
HOLDS, ASSUMING, RARE, FAILS = VERDICTS
# A claim is rare where it holds in less than this share of random interpretations.
RARE_BELOW = 0.05


@dataclass(frozen=True)
class Claim:
    """A sentence of the paper.

    Attributes:
        place: section, and figure, equation or item: "III, Fig. 4".
        quote: its words, shortened; dots or brackets mark what was left out or added.
        name: name by which its figure tests it.
        numbers, assumption: those of a finding, with names in braces for computed values.
        tested: name by which the search of Fig. 7 tests it; "" where it does not.
    """

    place: str
    quote: str
    name: str = field(default="", compare=False)
    numbers: str = field(default="", compare=False, repr=False)
    assumption: str = field(default="", compare=False, repr=False)
    tested: str = field(default="", compare=False, repr=False)

    def holds_if(self, is_so: bool, under_it: bool = False, /, **computed: Any) -> Finding:
        """Finds that it holds if ``is_so``, or else under its assumption if ``under_it``, or else not at all."""
        numbers = self.numbers.format(**computed)
        if is_so:
            return Finding(self, HOLDS, numbers)
        if under_it:
            return Finding(self, ASSUMING, numbers, self.assumption.format(**computed))
        return Finding(self, FAILS, numbers)


@dataclass(frozen=True)
class Finding:
    """The outcome of a test of a claim.

    Attributes:
        assumption: what must be assumed for it to hold, or where it holds if it is rare; empty for other verdicts.

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
        if bool(self.assumption) != (self.verdict in (ASSUMING, RARE)):
            raise ValueError(f"An assumption belongs to the verdicts {ASSUMING!r} and {RARE!r}, and to no other.")

    @classmethod
    def by_share(cls, claim: Claim, numbers: str, share: float, where: str) -> Finding:
        """Finds by the share of random interpretations in which a claim holds, and any in which it does ("": none)."""
        if not where:
            return cls(claim, FAILS, numbers)
        return cls(claim, ASSUMING if share >= RARE_BELOW else RARE, numbers, where)

    def as_dict(self) -> dict[str, str]:
        """Returns the finding as it is kept beside the figure: with the claim's name instead of its words."""
        kept = {"verdict": self.verdict, "assumption": self.assumption, "numbers": self.numbers}
        return {"claim": self.claim.name, **kept}

    @classmethod
    def from_dict(cls, kept: Mapping[str, str], claims: Mapping[str, Claim]) -> Finding:
        """Reads back what ``as_dict`` returned, given the claims by name."""
        return cls(claims[kept["claim"]], cast(Verdict, kept["verdict"]), kept["numbers"], kept["assumption"])


@cache
def _words() -> dict[str, Any]:
    return tomllib.loads(Path(__file__).with_name("words.toml").read_text(encoding="utf-8"))


def claims_of(figure: int) -> dict[str, Claim]:
    """Returns the claims that a figure tests, by name."""
    return {name: Claim(name=name, **claim) for name, claim in _words()[str(figure)]["claims"].items()}


def texts_of(part: int | Literal["page"]) -> dict[str, Any]:
    """Returns title, caption and the other texts of a figure, with names in braces for computed values.

    Those of the page include the titles of the paper's ``sections``.
    """
    return {name: text for name, text in _words()[str(part)].items() if name != "claims"}
