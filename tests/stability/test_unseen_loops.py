"""Loops whose stability is known from their linear map: none that grows is called steady, few others are accused."""

from __future__ import annotations

import itertools
from collections import Counter

import pytest

from haploop.launch.stability.looks import PUSH
from haploop.launch.stability.still_hand import StillHand
from haploop.launch.stability.traces import widths
from helpers.runs.judged import ended, found
from helpers.runs.wild_verdicts import judged
from helpers.scenes import wild_loops
from helpers.scenes.effect_tables import slowly
from helpers.scenes.unseen_loops import KINDS, drawn


@pytest.mark.slow
@pytest.mark.parametrize("kind", [5, *slowly(range(5))], ids=KINDS.__getitem__)
def test_a_loop_that_grows_is_never_called_steady(kind):
    """Two loops of each kind; hundreds are slow."""
    drawn_loops = filter(None, map(drawn, itertools.count(kind, len(KINDS))))
    for loop in itertools.islice((loop for loop in drawn_loops if loop.rate_1_s > 0.0), 2):
        assert found(loop.scene).word != "steady", loop


@pytest.mark.slow
def test_of_two_dozen_loops_none_is_called_steady_that_grows_and_few_stay_undecided():
    words: Counter[tuple[bool, str]] = Counter()
    gone = 0
    for seed in range(1000, 1024):
        loop = drawn(seed)
        finding = found(loop.scene) if loop else None
        if loop and finding and finding.word not in ("diverged", "no-contact"):
            grows = loop.rate_1_s > 0.0
            words[grows, finding.word] += 1
            if not grows and finding.word in ("limit-cycle", "growing"):
                gone += not still_swings(loop.scene, finding.width_m)
    assert not words[True, "steady"], words
    assert not gone, "called a limit cycle, or growing, yet at rest two minutes later"
    assert words[False, "undecided"] + words[True, "undecided"] <= 0.15 * sum(words.values()), words


@pytest.mark.slow
def test_none_is_called_steady_that_an_independent_program_sees_swing_and_few_stay_undecided():
    """Loops of every kind but with dry friction, which takes that program long: 600 and these by its own command."""
    scenes = ((seed, wild_loops.drawn(seed)) for seed in itertools.count(9000))
    loops = judged((seed for seed, scene in scenes if scene and not scene.friction), 12)
    assert not [one for one in loops if one.is_unsafe or one.is_false_alarm]
    assert sum(one.finding.word == "undecided" for one in loops) <= 2
    assert sum(one.swings > 1.0 for one in loops) >= 3


def still_swings(scene, width_m: float) -> bool:
    """Whether the loop still swings a minute after the push: large swings may last where small ones die."""
    end = ended(scene)
    copy = StillHand(end, PUSH * end.hold_N)
    copy.go_to(120.0)
    return bool(copy.stop_reason) or widths(copy.x[-2000:], 500).max() > 0.5 * width_m


@pytest.mark.slow
def test_the_rate_is_that_of_the_linear_map():
    """ln rho(M) / T within three standard errors and 2 %, for unrounded loops that decay slowly enough to see."""
    seen = 0
    for seed in range(4, 200, len(KINDS)):
        loop = drawn(seed)
        if loop is None or loop.scene.encoder or not -3.0 < loop.rate_1_s < -0.1:
            continue
        finding = found(loop.scene)
        if finding.word != "steady" or finding.rate_1_s is None:
            continue
        assert finding.error_1_s is not None
        assert abs(finding.rate_1_s - loop.rate_1_s) < 3.0 * finding.error_1_s - 0.02 * loop.rate_1_s, seed
        seen += finding.error_1_s < -0.1 * loop.rate_1_s
    assert seen >= 3
