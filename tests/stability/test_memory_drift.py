"""A loop whose element goes on using up, or filling, what it remembers is not said to rest before that has an end."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from haploop.launch.stability.judge import judge
from haploop.launch.stability.memory_drift import drifts
from helpers.runs.judged import ended
from helpers.scenes.observed import observed

TIMES = np.linspace(0.0, 1.0, 65)[1:]


@pytest.mark.parametrize(("memory", "changes"), [
    (lambda t: 1.0 - 0.2 * t + 0.05 * np.sin(60.0 * t), True),
    (lambda t: 1.0 + 0.2 * t, True),
    (lambda t: 1.0 + np.exp(-6.0 * t), False),
    (lambda t: 1.0 + 0.2 * np.sin(60.0 * t), False),
    (lambda t: 1.0 - 5e-4 * t, False),
    (lambda t: 0.0 * t, False),
])  # fmt: skip
def test_a_memory_drifts_that_changes_one_way_at_a_rate_that_lasts(memory: Callable[[Any], Any], changes: bool):
    """Not one that settles, that swings, or that would take half an hour to be used up."""
    others = np.zeros_like(TIMES)
    assert drifts([np.array([other, number]) for other, number in zip(others, memory(TIMES), strict=True)]) == changes


@pytest.mark.slow
def test_what_rests_while_a_passivity_observer_is_used_up_swings_when_it_is():
    """It seems to rest for a second or two; within half a minute it swings so that a hand feels it."""
    end = ended(observed())
    assert judge(end).word == "limit-cycle"
    early = judge(end, (4.0,), blows=())
    assert (early.word, early.entries()["stability"]["provisos"]) == ("steady", ["an element's memory still changes"])
