"""Histories in virtual time: whatever a seed does to a run, it keeps what haploop promises (docs/reliability.md)."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from helpers.scenes.effect_tables import slowly
from simulation.computer import network
from simulation.defects import DEFECTS, put_back
from simulation.faults import Kill, LateStart, Slow, Stop, When
from simulation.plan import Plan, draw, fewest, shrink, tell
from simulation.play import play
from simulation.plugins import BROKEN, HANGS, SOUND, Reload
from simulation.visitors import Impostor, SecondLogger, Stranger

_STARTS_S = {"plant": 0.1, "controller": 0.2, "logger": 0.3}
_CALM = Plan(0, "wall", 0.0, 1e-4, math.inf, _STARTS_S, ())
_STAYS = ("stays", 0.0)
_PAGE = (Path(__file__).parents[2] / "docs/reliability.md").read_text(encoding="utf-8")
# Histories that once broke a promise: nodes waited for, and a run ended, by the deadline of a loop that runs; a clock
# that asked the time without end while nodes loaded; an impostor's refusal told as the reason of a death.
_RECORDED = {
    "a controller that takes 9 s to start, in a scene whose deadline is 2 s": (
        LateStart(When(-1, 0.0), "controller", 9.0),
    ),
    "a plant stopped for 3 s before the others have joined": (Stop(When(-1, 0.23), "plant", 3.0),),
    "an impostor with the secret, and a death": (
        Impostor(When(-1, 0.4), _STAYS, "plant"),
        Kill(When(21, 0.002), "plant"),
    ),
    "false joins of a stranger, and a death": (
        Stranger(When(-1, 0.1), _STAYS, "clock", 600, 452),
        Kill(When(-1, 0.25), "logger"),
    ),
    "a second logger that joins as the run ends": (SecondLogger(When(69, 0.0), _STAYS),),
}


def broken_in(seeds: range) -> str:
    """The first seed that breaks a promise, with its plan; "" where none does."""
    for seed in seeds:
        if broken := play(draw(seed), reads_log=seed % 4 == 0).broken:
            return f"{broken}\n{tell(draw(seed))}\nIts shortest history: make simulate FROM={seed} SEEDS=1"
    return ""


@pytest.mark.parametrize("part", [0, *slowly([1])])
def test_a_share_of_the_seeds_keeps_every_promise(part: int) -> None:
    assert broken_in(range(15 * part, 15 * part + 15)) == ""


@pytest.mark.slow
@pytest.mark.parametrize("part", range(4))
def test_further_seeds_keep_every_promise(part: int) -> None:
    assert broken_in(range(30 + 30 * part, 60 + 30 * part)) == ""


@pytest.mark.parametrize("pace", [math.inf, 0.5])
@pytest.mark.parametrize("what", _RECORDED)
def test_a_history_that_broke_a_promise_once_keeps_it(what: str, pace: float) -> None:
    assert play(replace(_CALM, faults=_RECORDED[what], pace=pace)).broken == ""


# A plant each of whose exchanges takes 0.18 s, so that a block takes longer than the deadline of 2 s.
_SLOW_BLOCK = replace(_CALM, scene="least", faults=(Slow(When(40, 0.0), "plant", 0.18),))
_STOPPED_AT_THE_END = replace(_CALM, faults=(SecondLogger(When(50, 0.0), ("held", 0.0065)),))


# Nothing of what is sent to a stopped logger leaves its sender: the kernel is as good as full.
_NO_ROOM = replace(_CALM, faults=(Stop(When(70, 0.008), "logger", 1.6),))


@pytest.mark.parametrize(
    ("plan", "defect"),
    [
        (_SLOW_BLOCK, "a node at work on a block says nothing"),
        (_STOPPED_AT_THE_END, "who may miss nothing is not waited for at the end"),
    ],
    ids=["a block that takes long", "a second logger that is stopped as the run ends"],
)
def test_a_history_ends_in_order_that_a_defect_put_back_breaks(plan: Plan, defect: str) -> None:
    def ends() -> tuple[str, str]:
        outcome = play(plan)
        return outcome.broken, outcome.how

    assert ends() == ("", "in order")
    with put_back(defect):
        assert ends() != ("", "in order")


def test_plant_and_controller_stay_until_the_logger_has_all_and_else_the_deadline_says_who_waits_for_what(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(network, "_KERNEL_BYTES", 0)
    outcome = play(_NO_ROOM)
    assert (outcome.broken, outcome.how) == ("", "in order")
    with put_back("the logger is not waited for at the end"):
        broken = play(_NO_ROOM).broken
    assert "the logger is at tick 70 and waits for the plant's END." in broken


def test_a_seed_gives_the_same_history_again() -> None:
    plan = next(plan for plan in map(draw, range(1000)) if len(plan.faults) == 6 and plan.jumpiness == 0.2)
    first, second = play(plan), play(plan)
    assert first.history == second.history
    assert first.how == second.how
    assert len(first.history) > 6


def test_a_sound_plugin_is_taken_up_by_a_run_that_goes_on_and_no_broken_one() -> None:
    reload = Reload(When(5, 0.0), _STAYS, (SOUND[1], *(text for text in BROKEN if text != HANGS), SOUND[0]))
    outcome = play(replace(_CALM, pace=0.02, faults=(reload,)))
    assert (outcome.broken, outcome.how) == ("", "in order")
    told = [what for _, what in outcome.history if "brake" in what and not what.startswith("Reload")]
    assert ["becomes brake" in what for what in told] == [True, *[False] * (len(BROKEN) - 1), True]


@given(st.lists(st.integers(0, 9), unique=True, max_size=9), st.sets(st.integers(0, 9), max_size=3))
def test_of_what_was_drawn_only_that_is_kept_without_which_nothing_fails(drawn: list[int], guilty: set[int]) -> None:
    if guilty <= set(drawn):
        assert set(fewest(drawn, lambda kept: guilty <= set(kept))) == guilty


def test_a_failing_history_is_told_without_the_faults_that_have_no_part_in_it() -> None:
    late = LateStart(When(-1, 0.0), "logger", 9.0)
    plan = replace(
        _CALM, jumpiness=0.05, faults=(SecondLogger(When(3, 0.0), _STAYS), late, Kill(When(40, 0.0), "plant"))
    )
    with put_back("the deadline of a running loop rules its start"):
        shortest = shrink(plan, lambda candidate: bool(play(candidate).broken))
    assert shortest.faults == (late,)
    assert (shortest.jumpiness, shortest.scene) == (0.0, "least")


@pytest.mark.parametrize("defect", [*[*DEFECTS][:3], *slowly([*DEFECTS][3:])])
def test_every_defect_put_back_is_found_by_the_seed_that_the_page_names(defect: str) -> None:
    """Where it is not, ``python -m simulation.defects`` tells the page's seeds anew."""
    row = re.search(rf"^\| {re.escape(defect)} \| (\d+) \|$", _PAGE, re.MULTILINE)
    assert row, f"docs/reliability.md has no seed for: {defect}"
    with put_back(defect):
        assert play(draw(int(row[1]))).broken
