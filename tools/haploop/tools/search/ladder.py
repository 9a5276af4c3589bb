"""A ladder: rungs tried in order, each member as far as the first rung at which it fails."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from itertools import takewhile
from typing import TypeVar

Member = TypeVar("Member")
Rung = TypeVar("Rung")
Answer = TypeVar("Answer")


def climb(
    members: Iterable[Member],
    rungs: Iterable[Rung],
    ask: Callable[[Rung, Sequence[Member]], Iterable[Answer]],
    passes: Callable[[Answer], object] = bool,
) -> dict[Member, list[Answer]]:
    """Asks all members at each rung; one that fails is not asked at later rungs.

    Args:
        members: distinct.
        rungs: in the order in which they are tried.
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
