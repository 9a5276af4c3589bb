"""Jitter and loss on the line, against the rule itself applied to every step, and their statistics."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
import scipy
from hypothesis import given
from hypothesis import strategies as st

from haploop.plant.counters import DROPPED, LOST
from haploop.plant.line import Line
from haploop.plant.line.delay import DelayLine, make_line
from haploop.plant.line.lossy import LossyLine, make_jitter, make_loss
from haploop.protocol.scene import effects
from haploop.protocol.ticks import Timebase
from helpers.runs.captured import in_blocks, run
from helpers.scenes.least import PRESSED, scene, typed

MANY = 100_000
# Five standard errors: a right program meets another 999 999 of a million seeds as well.
ERRORS = 5.0


@dataclass
class Fate:
    """What became of the commands: command in effect at every step, and how many were dropped and lost."""

    command: list[int]
    dropped: int
    lost: int


def by_the_rule(time: Timebase, additional_steps: list[int], lost: list[bool]) -> Fate:
    """Looks at all commands at once, step by step: of those that have come the latest acts."""
    n, d, end = time.steps_per_tick, time.delay_steps, time.ticks * time.steps_per_tick
    effects = [k * n + d + j for k, j in enumerate(additional_steps)]
    comes = [k for k in range(time.ticks) if effects[k] < end and not lost[k]]
    command = [max((k for k in comes if effects[k] <= step), default=-1) for step in range(end)]
    dropped = sum(any(later > k and effects[later] < effects[k] for later in comes) for k in comes)
    return Fate(command, dropped, sum(lost[k] and effects[k] < end for k in range(time.ticks)))


def with_fates(time: Timebase, additional_steps: list[int], lost: list[bool]) -> LossyLine:
    """Makes a line with given delays and losses."""
    line = LossyLine(time)
    line.additional_steps, line.is_lost = iter(additional_steps).__next__, iter(lost).__next__
    return line


def by_the_line(line: Line, time: Timebase, ahead: list[int]) -> Fate:
    """Feeds a line command by command and empties it interval by interval.

    Args:
        ahead: how many commands more than needed have come before each interval.
    """
    received, command = 0, []
    for tick in range(time.ticks):
        needed = min(time.ticks, max(received, tick - time.lookahead_ticks + 1 + ahead[tick]))
        line.receive([float(k) + 0.5 for k in range(received, needed)])
        received = needed
        holds = line.holds(tick)
        assert all(count > 0 for count, _, _ in holds)
        assert all(force == (k + 0.5 if k >= 0 else 0.0) for _, force, k in holds)
        assert len({k for _, _, k in holds}) == len(holds)  # two holds in a row of the same command are one
        command += [k for count, _, k in holds for _ in range(count)]
    end = time.ticks * time.steps_per_tick
    dropped, lost = (int(line.counters[name].column(0, end)[-1]) for name in (DROPPED, LOST))
    return Fate(command, dropped, lost)


@st.composite
def lines(draw) -> tuple[Timebase, list[int], list[bool], list[int]]:
    n, ticks = draw(st.integers(1, 10)), draw(st.integers(1, 30))
    time = Timebase(plant_rate=n * 1000, control_rate=1000, delay_steps=draw(st.integers(0, 4 * n)), ticks=ticks)
    most = draw(st.sampled_from([0, 1, n, 5 * n, 3 * ticks * n]))
    delays = draw(st.lists(st.integers(0, most), min_size=ticks, max_size=ticks))
    share = draw(st.sampled_from([0.0, 0.1, 0.9, 1.0]))
    lost = draw(st.lists(st.floats(0, 1, exclude_max=True).map(lambda u: u < share), min_size=ticks, max_size=ticks))
    ahead = draw(st.lists(st.integers(0, 5), min_size=ticks, max_size=ticks))
    return time, delays, lost, ahead


@given(lines())
def test_holds_and_counts_are_those_of_the_rule_whatever_comes_late_overtakes_or_is_lost(drawn):
    time, delays, lost, ahead = drawn
    line = with_fates(time, delays, lost)
    assert by_the_line(line, time, ahead) == by_the_rule(time, delays, lost)


@given(lines(), st.integers(1, 30))
def test_counts_do_not_depend_on_how_far_ahead_commands_came_when_a_run_ends(drawn, ended):
    """A run that ends early counts what would have taken effect by then, known or not known how many came later."""
    time, delays, lost, ahead = drawn
    ended = min(ended, time.ticks)
    counts = []
    for more in (ahead, [0] * time.ticks, [time.ticks] * time.ticks):
        line, received = with_fates(time, delays, lost), 0
        for tick in range(ended):
            needed = min(time.ticks, max(received, tick - time.lookahead_ticks + 1 + more[tick]))
            line.receive([0.0] * (needed - received))
            received = needed
            line.holds(tick)
        counts.append([line.counters[name].column(0, ended * time.steps_per_tick)[-1] for name in (DROPPED, LOST)])
    assert counts[0] == counts[1] == counts[2]


def test_of_two_commands_for_the_same_step_the_later_acts_and_none_is_dropped():
    time = Timebase(plant_rate=10_000, control_rate=1000, delay_steps=0, ticks=3)
    line = with_fates(time, [10, 0, 0], [False] * 3)
    line.receive([1.0, 2.0, 3.0])
    assert [line.holds(tick) for tick in range(3)] == [[(10, 0.0, -1)], [(10, 2.0, 1)], [(10, 3.0, 2)]]
    assert not line.counters[DROPPED].column(0, 30).any()


def test_a_command_for_the_same_step_as_a_later_one_is_dropped_by_a_third_that_acts_before():
    time = Timebase(plant_rate=10_000, control_rate=1000, delay_steps=0, ticks=4)
    line = with_fates(time, [25, 15, 0, 0], [False] * 4)
    line.receive([1.0, 2.0, 3.0, 4.0])
    holds = [line.holds(tick) for tick in range(4)]
    assert holds[2:] == [[(10, 3.0, 2)], [(10, 4.0, 3)]]
    assert line.counters[DROPPED].column(0, 40).tolist() == [0.0] * 26 + [2.0] * 15


@pytest.mark.parametrize("delay", [0, 3, 10, 13, 50])
@pytest.mark.parametrize("effect", [typed(jitter={"kind": "uniform", "most": 0.0}), typed(loss={"probability": 0.0})])
def test_neutral_jitter_and_loss_hold_what_a_plain_line_holds(delay, effect):
    time = Timebase(plant_rate=10_000, control_rate=1000, delay_steps=delay, ticks=300)
    plain, neutral = DelayLine(time), make_line(effect, time)
    assert isinstance(neutral, LossyLine)
    for tick in range(time.ticks):
        for line in (plain, neutral):
            line.receive([float(tick)])
        assert neutral.holds(tick) == merged(plain.holds(tick))
    assert not any(tally.column(0, 3000).any() for tally in neutral.counters.values())


def merged(holds: list[Any]) -> list[Any]:
    """Holds of one command as one: a plain line cuts the interval also before the first command."""
    (_, force, first), (_, _, last) = holds[0], holds[-1]
    return [(sum(count for count, _, _ in holds), force, first)] if first == last else holds


def test_a_delay_beyond_the_run_and_the_loss_of_all_leave_the_device_alone():
    time = Timebase(plant_rate=10_000, control_rate=1000, delay_steps=0, ticks=50)
    never = {"jitter": {"kind": "gamma", "mean": 1e3, "deviation": 1e-3}}
    all_lost = {"loss": {"probability": 1.0}}
    for effects_of, lost in ((never, 0), (all_lost, 50), ({**never, **all_lost}, 0)):
        fate = by_the_line(make_line(typed(**effects_of), time), time, [0] * 50)
        assert fate == Fate([-1] * 500, 0, lost)


@pytest.mark.parametrize(("mean", "deviation", "way"), [(0.2, 2.0, 4000), (2.0, 2.0, 8000), (1e3, 1.0, 0)])
def test_a_line_remembers_no_more_than_is_on_its_way(mean, deviation, way):
    """Over half a minute: what is overtaken waits to be counted alone, what would come after the run is forgotten."""
    time = Timebase(plant_rate=10_000, control_rate=1000, delay_steps=0, ticks=30_000)
    line = make_line(typed(jitter={"kind": "gamma", "mean": mean, "deviation": deviation}), time)
    assert isinstance(line, LossyLine)
    coming = counted = uncounted = 0
    for tick in range(time.ticks):
        line.receive([0.0])
        line.holds(tick)
        coming = max(coming, len(line.state[2]))
        if tick % 1000 == 999:
            uncounted = max(uncounted, len(line.counters[DROPPED].state[1]))
            counted = line.counters[DROPPED].column((tick - 999) * 10, (tick + 1) * 10)[-1]
    assert coming <= min(50, way)
    assert uncounted <= way  # commands that have a few mean delays yet to go
    assert counted > 1000 or not way


def taken(draw) -> np.ndarray:
    return np.array([draw() for _ in range(MANY)])


def test_uniform_jitter_is_every_step_up_to_the_most_equally_often():
    delays = taken(make_jitter(effects.UniformJitter(most=0.0012), 1, 10_000))
    counts = np.bincount(delays)
    assert len(counts) == 13
    assert scipy.stats.chisquare(counts).pvalue > 1e-6


@pytest.mark.parametrize(("mean", "deviation"), [(0.002, 0.001), (0.001, 0.003), (0.01, 1e-5)])
def test_gamma_jitter_has_its_mean_and_deviation_and_is_rounded_to_the_nearest_step(mean, deviation):
    """Every step against the integral of the density over half a step to either side."""
    delays = taken(make_jitter(effects.GammaJitter(mean=mean, deviation=deviation), 1, 10_000))
    gamma = scipy.stats.gamma((mean / deviation) ** 2, scale=deviation**2 / mean * 10_000)
    steps = np.arange(delays.max() + 2)
    expected = MANY * (gamma.cdf(steps + 0.5) - gamma.cdf(np.maximum(steps - 0.5, 0.0)))
    counts = np.bincount(delays, minlength=len(steps))
    usual = expected > 20
    statistic = np.sum((counts[usual] - expected[usual]) ** 2 / expected[usual])
    assert statistic < scipy.stats.chi2.isf(1e-6, max(1, usual.sum() - 1))
    assert counts[~usual].sum() == pytest.approx(expected[~usual].sum() + gamma.sf(steps[-1] + 0.5) * MANY, abs=60)
    if deviation > 2e-4:
        assert abs(delays.mean() / (mean * 1e4) - 1.0) < ERRORS * deviation / mean / math.sqrt(MANY) + 0.01


@pytest.mark.parametrize("probability", [0.0, 0.01, 0.9, 1.0])
def test_each_command_is_lost_by_itself_with_its_probability(probability):
    lost = taken(make_loss(effects.Loss(probability=probability), 1))
    assert scipy.stats.binomtest(int(lost.sum()), MANY, probability).pvalue > 1e-6
    after_a_loss = lost[1:][lost[:-1]]
    if len(after_a_loss):
        assert scipy.stats.binomtest(int(after_a_loss.sum()), len(after_a_loss), probability).pvalue > 1e-6


LONG = PRESSED | {"duration": 0.4}
LATE = {"jitter": {"kind": "gamma", "mean": 0.002, "deviation": 0.002}, "loss": {"probability": 0.3}}


def expected_fate(delays: int, seed: int, jitter: effects.Jitter, probability: float, ticks: int) -> Fate:
    time = Timebase(plant_rate=10_000, control_rate=1000, delay_steps=delays, ticks=ticks)
    late, lost = make_jitter(jitter, seed, 10_000), make_loss(effects.Loss(probability=probability), seed)
    return by_the_rule(time, [late() for _ in range(ticks)], [lost() for _ in range(ticks)])


def test_a_run_applies_the_commands_by_the_rule_and_counts_what_was_dropped_and_lost():
    ran = run(scene(**LONG, **LATE))
    fate = expected_fate(13, 5, effects.GammaJitter(mean=0.002, deviation=0.002), 0.3, 400)
    command = ran.plant["command"][:-1]
    assert np.array_equal(command, fate.command)
    total = np.append(ran.controller["total"], 0.0)  # at -1: before the first
    assert np.array_equal(ran.plant["force"][:-1], total[command.astype(int)])
    assert ran.summary["lost"] == {"commands_dropped": fate.dropped, "commands_lost": fate.lost, "telemetry_gaps": 0}
    assert fate.dropped > 20
    assert fate.lost > 90


def test_noise_changes_neither_delays_nor_losses():
    noisy = run(scene(**LONG, **LATE, noise={"deviation": 1e-5, "cutoff": 100.0}))
    assert np.array_equal(noisy.plant["command"], run(scene(**LONG, **LATE)).plant["command"])


@pytest.mark.slow
def test_blocks_of_any_size_give_the_same_summary_also_when_the_run_is_stopped_or_diverges():
    stopped = {"event": [{"at": 0.2003, "stop": True}]}
    diverging = {"device": {"mass": 0.01, "damping": 0.0, "velocity": -1.0}, "diverged_beyond": 0.02}
    for change, ended in (({}, "done"), (stopped, "stopped"), (diverging, "diverged")):
        late = scene(**LONG | LATE | change)
        usual = in_blocks(late, 100)
        assert usual["ended"] == ended
        assert usual["lost"]["commands_lost"] > 0
        for block_ticks in (1, 7, 1000):
            assert in_blocks(late, block_ticks) == usual
