"""Bisection of the boundary of a property, and ladders of rungs climbed until one fails, for many members at once."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import count, takewhile
from typing import TypeVar

Member = TypeVar("Member")
Rung = TypeVar("Rung")
Answer = TypeVar("Answer")
# Two values: the property holds at the first, and does not at the second.
Bracket = tuple[float, float]


@dataclass(frozen=True)
class Tolerance:
    """The width down to which a bracket is halved: absolute, or relative to its greater end; 0: to adjacent floats."""

    absolute: float = 0.0
    relative: float = 0.0

    def met(self, near: float, far: float) -> bool:
        """Tells whether the bracket is narrow enough, or holds no number between its ends."""
        width, size = abs(far - near), max(abs(near), abs(far))
        return width <= max(self.absolute, self.relative * size) or self.middle(near, far) in (near, far)

    def middle(self, near: float, far: float) -> float:
        """Returns the geometric mean for a relative tolerance between ends of one sign, else the arithmetic mean."""
        if self.relative and not self.absolute and near * far > 0.0:
            return math.copysign(math.sqrt(abs(near)) * math.sqrt(abs(far)), far)
        return near + (far - near) / 2.0


EXACT = Tolerance()


def bisect_many(
    brackets: Mapping[Member, Bracket],
    holds: Callable[[Mapping[Member, float]], Mapping[Member, bool | None]],
    tolerance: Tolerance = EXACT,
    most_rounds: int | None = None,
) -> dict[Member, Bracket]:
    """Halves the brackets of all members in common rounds, one value of each member a round.

    Args:
        holds: from values by member to whether the property holds there; None, or no answer, ends the search of that
            member with the bracket it has.
        most_rounds: most halvings; when None, as many as the tolerance takes.
    """
    narrowed = dict(brackets)
    going = dict(brackets)
    for _ in count() if most_rounds is None else range(most_rounds):
        middles = {member: tolerance.middle(*ends) for member, ends in going.items() if not tolerance.met(*ends)}
        if not middles:
            break
        answers = holds(middles)
        going = {}
        for member, middle in middles.items():
            answer = answers.get(member)
            if answer is not None:
                near, far = narrowed[member]
                going[member] = narrowed[member] = (middle, far) if answer else (near, middle)
    return narrowed


def bisect(holds: Callable[[float], bool], near: float, far: float, tolerance: Tolerance = EXACT) -> Bracket:
    """Halves one bracket; the property holds at ``near`` and does not at ``far``."""
    return bisect_many({0: (near, far)}, lambda middles: {0: holds(middles[0])}, tolerance)[0]


def climb(
    members: Iterable[Member],
    rungs: Iterable[Rung],
    ask: Callable[[Rung, Sequence[Member]], Iterable[Answer]],
    passes: Callable[[Answer], object] = bool,
) -> dict[Member, list[Answer]]:
    """Asks all members at each rung, in order; one that fails is not asked at later rungs.

    Args:
        ask: from a rung and the members that have passed all rungs before to their answers, in their order.
        passes: from an answer to whether the member goes on.

    Returns:
        The answers of each member from the first rung on; only the last of them may be a failure.
    """
    answers: dict[Member, list[Answer]] = {member: [] for member in members}
    going = list(answers)
    for rung in rungs:
        if not going:
            break
        for member, answer in zip(going, ask(rung, going), strict=True):
            answers[member].append(answer)
        going = [member for member in going if passes(answers[member][-1])]
    return answers


def rungs_held(held: Iterable[object]) -> int:
    """Counts the rungs that hold before the first that does not."""
    return sum(1 for _ in takewhile(bool, held))
