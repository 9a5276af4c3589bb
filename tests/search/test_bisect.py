"""Bisection of many members, and ladders: common rounds, and no more questions than needed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from hypothesis import given
from hypothesis import strategies as st

from haploop.tools.search.bisect import Tolerance, bisect, bisect_many, climb, rungs_held


@given(st.floats(-99.0, 99.0), st.booleans())
def test_an_exact_bisection_ends_at_neighbouring_floats_of_which_one_holds(change: float, downwards: bool) -> None:
    def holds(x: float) -> bool:
        return x > change if downwards else x <= change

    near, far = bisect(holds, *((100.0, -100.0) if downwards else (-100.0, 100.0)))
    assert holds(near)
    assert not holds(far)
    assert far == math.nextafter(near, -math.inf if downwards else math.inf)


def test_members_share_rounds_and_one_without_an_answer_keeps_its_bracket() -> None:
    rounds: list[list[str]] = []

    def holds(middles: Mapping[str, float]) -> dict[str, bool | None]:
        rounds.append(sorted(middles))
        return {member: None if member == "unknown" else x < 30.0 for member, x in middles.items() if member != "lost"}

    brackets = {"known": (0.0, 64.0), "unknown": (0.0, 64.0), "lost": (0.0, 64.0), "narrow": (29.0, 30.0)}
    found = bisect_many(brackets, holds, Tolerance(absolute=1.0))
    assert found == {"known": (29.0, 30.0), "unknown": (0.0, 64.0), "lost": (0.0, 64.0), "narrow": (29.0, 30.0)}
    assert rounds == [["known", "lost", "unknown"]] + [["known"]] * 5


def test_no_more_rounds_are_made_than_asked_for() -> None:
    assert bisect_many({0: (0.0, 16.0)}, lambda middles: {0: middles[0] < 5.0}, most_rounds=2) == {0: (4.0, 8.0)}
    assert bisect_many({0: (0.0, 16.0)}, lambda _: {}, most_rounds=0) == {0: (0.0, 16.0)}


def test_who_fails_at_a_rung_is_not_asked_at_the_next() -> None:
    asked: list[tuple[int, list[str]]] = []

    def ask(rung: int, members: Sequence[str]) -> list[bool]:
        asked.append((rung, list(members)))
        return [len(member) >= rung for member in members]

    answers = climb(["a", "bbb", "cc"], [1, 2, 3, 4, 5], ask)
    assert answers == {"a": [True, False], "bbb": [True, True, True, False], "cc": [True, True, False]}
    assert asked == [(1, ["a", "bbb", "cc"]), (2, ["a", "bbb", "cc"]), (3, ["bbb", "cc"]), (4, ["bbb"])]
    assert {member: rungs_held(held) for member, held in answers.items()} == {"a": 1, "bbb": 3, "cc": 2}
    assert (rungs_held([]), rungs_held([False, True])) == (0, 0)
