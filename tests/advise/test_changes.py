"""Gains told of a change of the device: the element tuned anew, or left out, in the corners that are hardest."""

from __future__ import annotations

import math
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import pytest

from haploop.protocol.scene.paths import value_at, with_value
from haploop.tools.advise.advice import Changed
from haploop.tools.advise.changes import Borne, changed_limits
from haploop.tools.advise.families import DAMPING, NOTHING, Family, Values
from haploop.tools.advise.report import answer, describe
from haploop.tools.advise.search import Found
from haploop.tools.advise.walls.limit import Limit
from haploop.tools.advise.walls.store import Failure, Job, Store
from haploop.tools.advise.walls.trial import Trial
from haploop.tools.advise.withstand import Best
from helpers.scenes.presets import loop_of

LATE, EARLY = (loop_of("premium15", f"clock.round_trip_delay={delay}") for delay in (1.5e-3, 0.7e-3))
# Which of its quantities are 20 % more in the corners that are hardest on that device, the others less.
HARD = ((0, 0, 1, 1, 1, 0, 0), (0, 1, 1, 0, 0, 0, 0), (1, 0, 1, 0, 0, 0, 0), (0, 0, 0, 0, 0, 0, 0))
CORNER = (("friction", 0.8), ("delay", 1.2))


def found_with(family: Family, values: Values, stiffness_N_m: float, alone_N_m: float) -> Found:
    best = Best(family, values, Limit(stiffness_N_m, 1.1 * stiffness_N_m))
    return Found((best,), best, stiffness_N_m, None, None, 10, alone_N_m=alone_N_m, hardest=(CORNER,))


class Made:
    """Walls that bear K up to 1e3 (1 + b) / (T + d), where b is below the 8e-3 / d that a late damper bears."""

    def __init__(self) -> None:
        self.corners: set[Any] = set()

    def of_jobs(self, jobs: Sequence[Job]) -> list[list[Failure | None]]:
        self.corners |= {case.corner for job in jobs for case in job.cases}
        return [[self._fails(job, wall) for wall in job.walls] for job in jobs]

    def _fails(self, job: Job, wall: Any) -> Failure | None:
        late_ms = 1e3 * value_at(job.loop, "clock.round_trip_delay")
        b = wall.elements[0].parameters["damping"] if wall.elements else 0.0
        bears = 1e3 * (1.0 + b) / (1.0 + late_ms) if b * late_ms < 8.0 else 0.0
        return None if wall.stiffness_N_m <= bears else Failure("a case", 1.0, gone=False)


def test_the_element_is_tuned_anew_for_each_change_and_left_out_where_that_bears_more() -> None:
    """Kept at 5 N s/m the wall would gain 1.5 times by less delay, at 7.1 twice; without, as much as in the formula."""
    late, early = changed_limits(made := Made(), [LATE, EARLY], found_with(DAMPING, (5.0,), 2400.0, 400.0))  # type: ignore[arg-type]
    assert (late.values, early.values) == ((5.0,), (7.1,))
    assert early.limit.stiffness_N_m == pytest.approx(1e3 * 8.1 / 1.7, rel=0.07)
    assert late.alone.stiffness_N_m == pytest.approx(400.0, rel=0.07)
    assert early.alone.stiffness_N_m == pytest.approx(1e3 / 1.7, rel=0.07)
    assert made.corners == {(), CORNER}


def test_what_a_changed_loop_has_no_longer_is_not_varied() -> None:
    made = Made()
    changed_limits(made, [with_value(LATE, "clock.round_trip_delay", 0.0)], found_with(NOTHING, (), 400.0, 400.0))  # type: ignore[arg-type]
    assert made.corners == {(), CORNER[:1]}


@pytest.mark.slow
def test_half_the_delay_gains_with_the_element_tuned_anew_and_without_one() -> None:
    """Kept at 7.8 N s/m the element would lose a tenth; the faster loop bears 20 % more, 68 % without."""
    of = ["friction.kinetic=0.12", "encoder.resolution=36.6e-6", "actuator.saturation=9"]
    of += ["device.mass=0.085", "device.damping=0.05"]
    late, early = (loop_of("premium15", f"clock.round_trip_delay={delay}", *of) for delay in (1.5e-3, 0.7e-3))
    names = ("delay", "device mass", "hand mass", "hand damping", "hand stiffness", "friction", "device damping")
    corners = tuple(
        tuple((name, 1.2 if more else 0.8) for name, more in zip(names, each, strict=True)) for each in HARD
    )
    asked = found_with(DAMPING, (7.8,), 3230.0, 1660.0)
    with Trial(Store()) as trial:
        unchanged, halved = changed_limits(trial, [late, early], Found(**{**vars(asked), "hardest": corners}))
    assert halved.limit.stiffness_N_m > unchanged.limit.stiffness_N_m
    assert halved.values < (7.8,)
    assert halved.alone.stiffness_N_m > 1.3 * unchanged.alone.stiffness_N_m


def told_with(row: Changed, values: Values = (5.0,)) -> dict[str, str]:
    told: Any = SimpleNamespace(
        is_ideal=False, hand=None, provisos=("only friction holds it",), changed=(row,), without=(), published=(),
        own=None, found=found_with(DAMPING if values else NOTHING, values, 3230.0, 1660.0), breaks=None, assumed=(),
    )  # fmt: skip
    return dict(answer(told))


def changed(factor: float, alone_factor: float) -> Changed:
    base = Borne(Limit(1000.0, math.inf), Limit(1000.0, math.inf))
    some = Borne(Limit(1e3 * factor, math.inf), Limit(1e3 * alone_factor, math.inf))
    return Changed.from_borne("delay halved", some, base)


def test_what_gains_without_the_element_alone_is_told_as_that_and_no_change_is_said_to_gain_with_it() -> None:
    told = told_with(changed(1.1, 1.5))
    assert told["gains most"] == "no single change that was tried gains a fifth, the element tuned anew"
    assert told["without one"] == "the wall without an element gains by more: delay halved: 1.5 times"
    assert "without one" not in told_with(changed(1.1, 1.1))
    assert told_with(changed(1.3, 1.5))["gains most"] == "delay halved: 1.3 times (1.5 without an element)"
    assert told_with(changed(1.5, 1.5), ())["gains most"] == "delay halved: 1.5 times"


def test_what_the_verdict_says_beside_its_word_stands_with_the_wall() -> None:
    assert told_with(changed(1.0, 1.0))["safe up to"].endswith("than a hand feels, only friction holds it")


def test_a_frequency_is_told_of_a_line_alone_and_both_senses_where_both_feel_it() -> None:
    spikes = Failure("hold x 1", 1.0, False, 22e-6, 0.7, 12.0, 2.0, True, None, 0.5, False, 6, 0.25)
    assert describe(spikes) == (
        "700 mN and 22 µm peak to peak at no one frequency, turning 6 times in 0.25 s, felt as force; hold x 1"
    )
    wide = Failure("hold x 1", 1.0, False, 5.4e-3, 11.0, 30.0, 200.0, True, None, 90.0, True, 15, 0.25)
    assert "at 30 Hz, felt as force and as motion; " in describe(wide)
