"""Gains told of a change of the device: the element tuned anew, or left out, in the corners that are hardest."""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from haploop.protocol.amounts import fixed
from haploop.protocol.scene.paths import value_at, with_value
from haploop.protocol.scene.scene import ElementTable
from haploop.tools.advise import advice as of_advice
from haploop.tools.advise import search as of_search
from haploop.tools.advise.advice import Changed
from haploop.tools.advise.changes import Borne, changed_limits
from haploop.tools.advise.command import breaks_words
from haploop.tools.advise.families import DAMPING, NOTHING, Family, Values
from haploop.tools.advise.figure import figure_of
from haploop.tools.advise.report import _changes as changes_table
from haploop.tools.advise.report import answer, describe, describe_run, format_limit
from haploop.tools.advise.search import STAGES, Found
from haploop.tools.advise.subject import make_subject
from haploop.tools.advise.walls.felt import felt_force_N
from haploop.tools.advise.walls.limit import Limit
from haploop.tools.advise.walls.store import Failure, Job, Store
from haploop.tools.advise.walls.trial import Trial
from haploop.tools.advise.withstand import Best
from helpers.data.advices import ADVICE
from helpers.scenes.least import scene
from helpers.scenes.presets import loop_of
from helpers.scenes.pressed import pressed
from helpers.shown import row, shown

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
    """Kept at 5 N s/m the wall would gain 1.5 times by less delay, at 10, which is tried last, 2.7 times."""
    late, early = changed_limits(made := Made(), [LATE, EARLY], found_with(DAMPING, (5.0,), 2400.0, 400.0))  # type: ignore[arg-type]
    assert (late.values, early.values) == ((5.0,), (10.0,))
    assert early.limit.stiffness_N_m == pytest.approx(1e3 * 11.0 / 1.7, rel=0.07)
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
        scene=None, unchanged=changed(1.0, 1.0),
    )  # fmt: skip
    return dict(answer(told))


def changed(factor: float, alone_factor: float) -> Changed:
    base = Borne(Limit(1000.0, 1001.0), Limit(1000.0, 1001.0))
    limit, alone = (Limit(1e3 * times, 1e3 * times + 1.0) for times in (factor, alone_factor))
    some = Borne(limit, alone)
    return Changed.from_borne("delay halved", some, base)


def test_what_gains_without_the_element_alone_is_told_as_that_and_no_change_is_said_to_gain_with_it() -> None:
    told = told_with(changed(1.1, 1.5))
    assert told["gains most"] == "no single change that was tried gains a fifth, with the element tuned again"
    assert told["without one"] == "the wall without an element gains from more changes: delay halved: 1.5 times"
    assert "without one" not in told_with(changed(1.1, 1.1))
    assert told_with(changed(1.3, 1.5))["gains most"] == "delay halved: 1.3 times (1.5 without an element)"
    assert told_with(changed(1.5, 1.5), ())["gains most"] == "delay halved: 1.5 times"


def test_what_the_verdict_says_beside_its_word_has_a_line_of_its_own() -> None:
    told = told_with(changed(1.0, 1.0))
    assert told["safe up to"].endswith("swinging by less than a hand feels")
    assert told["its run"].endswith("adds to its verdict on advice.toml: only friction holds it")
    both = describe_run(("only friction holds it", "tried at only some holds of its hand", "its force ripples"))
    assert "only friction holds it, its force ripples; it pushes the loop at only some holds" in both
    assert both.endswith("this wall was tried at all of them")


def test_by_how_much_the_force_jumps_at_a_count_is_told_with_how_much_of_it_a_hand_would_feel() -> None:
    """B q / T + m q / T²: 0.4 N and 0.15 N for 20 N s/m and 7.5 g behind 20 um at 1 kHz; the inertia pushes back."""
    elements = tuple(
        ElementTable(name=kind, acts="in-contact", parameters=parameters)
        for kind, parameters in (("damping", {"damping": 20.0}), ("bidirectional-inertia", {"mass": 7.5e-3}))
    )
    of = replace(scene(**pressed(encoder={"resolution": 2e-5})), dissipation=elements)
    told = dict(answer(replace(ADVICE, scene=of)))
    line = told["at a count"]
    assert "changes by 10.0 mN and the element's force jumps by up to 550 mN and back" in line
    felt_N = float(felt_force_N(of)(np.array([100.0]))[0])
    assert line.endswith(f"at 100 Hz would be {fixed((0.4 + 2.0 * 0.15) / felt_N, 2)} times what a hand feels")
    assert told["safe up to"].endswith("less than a hand feels; counts may be felt as grit")
    alone = dict(answer(replace(ADVICE, scene=replace(of, dissipation=()))))
    assert "the wall's force changes by 10.0 mN: in a slow press, grit" in alone["at a count"]
    assert alone["safe up to"].endswith("swinging by less than a hand feels"), "0.26 times what a hand feels"
    assert "at a count" not in dict(answer(replace(ADVICE, scene=replace(of, encoder=None))))


def test_of_a_loop_that_bears_no_wall_only_what_makes_one_possible_is_told() -> None:
    none, some = Borne(Limit(0.0, 1.0), Limit(0.0, 1.0)), Borne(Limit(120.0, 130.0), Limit(0.0, 1.0))
    useless, helps = Changed.from_borne("ticks halved", none, none), Changed.from_borne("delay halved", some, none)
    found = replace(ADVICE.found, stiffness_N_m=0.0)
    told = replace(ADVICE, found=found, unchanged=Changed.from_borne("unchanged", none, none), without=())
    lines = dict(answer(replace(told, changed=(useless, helps))))
    assert lines["safe up to"] == "none: no wall withstands every case"
    assert lines["gains most"] == "delay halved: 0.12 N/mm"
    assert "loses most" not in lines
    nothing = replace(told, changed=(useless,))
    assert dict(answer(nothing))["gains most"] == "no single change that was tried makes a wall possible"
    panels = [ax for ax in figure_of(nothing).axes if ax.get_title("left")]
    assert [ax.get_title("left") for ax in panels] == ["mine: how stiff a wall may be"]
    assert len([ax for ax in figure_of(replace(told, changed=(helps,))).axes if ax.get_title("left")]) == 2


def test_where_no_wall_withstands_the_attack_a_multiple_says_of_which_wall_it_is() -> None:
    """No wall was safe, and halving the count was said to gain 2.5 times, of nothing."""
    lines = dict(answer(replace(ADVICE, found=replace(ADVICE.found, stiffness_N_m=0.0))))
    of = "of 2.9 N/mm, a wall that withstands the hardest corners, but not the attack: "
    assert lines["gains most"] == f"{of}ticks twice as often: 2.0 times (1.0 without an element)"
    assert lines["loses most"].startswith(f"{of}no friction: ")
    assert not dict(answer(ADVICE))["gains most"].startswith("of ")


def test_a_scene_without_a_wall_is_advised_as_its_device_is(tmp_path) -> None:
    path = tmp_path / "no_wall.toml"
    path.write_text('extends = "devices/premium15"\nduration = "2 s"\n')
    subject = make_subject(str(path))
    assert not subject.has_task
    assert subject.scene.duration == 2.0
    assert subject.scene.wall == make_subject("premium15").scene.wall


def test_a_factor_within_what_both_limits_are_known_to_is_told_as_no_change() -> None:
    def times(stiffness_N_m: float, fails_N_m: float) -> list[str]:
        base = Borne(Limit(2020.0, 2140.0), Limit(2020.0, 2140.0))
        some = Changed.from_borne("delay halved", Borne(Limit(stiffness_N_m, fails_N_m), base.alone), base)
        told: Any = SimpleNamespace(
            found=found_with(DAMPING, (5.0,), 2000.0, 1000.0),
            changed=(some,), without=(), unchanged=Changed.from_borne("unchanged", base, base),
        )  # fmt: skip
        return row(shown(changes_table(told)), "delay halved")

    assert times(2140.0, 2270.0) == ["2.1 N/mm", "same", "2.0 N/mm", "same"]
    assert times(1600.0, 1700.0) == ["1.6 N/mm", "0.79", "2.0 N/mm", "same"]


def test_what_its_tolerance_makes_the_same_in_the_table_neither_gains_nor_loses_in_the_answer() -> None:
    """A limit of 0.59 times of which no stiffer wall was tried stood under "loses most", and as "same" in its table."""
    base = Borne(Limit(1000.0, 1060.0), Limit(0.0, 1.0))
    row_of = Changed.from_borne("delay halved", Borne(Limit(590.0, math.inf), Limit(0.0, 1.0)), base)
    told = told_with(row_of)
    assert told["loses most"] == "no single change that was tried costs a sixth"
    less = Changed.from_borne("delay halved", Borne(Limit(590.0, 620.0), Limit(0.0, 1.0)), base)
    assert told_with(less)["loses most"] == "delay halved: 0.59 times (1.0 without an element)"
    nothing = replace(ADVICE, changed=(less,), without=(), unchanged=Changed.from_borne("unchanged", base, base))
    assert row(shown(changes_table(nothing)), "delay halved")[-1] == "–", "no wall is borne that could be multiplied"


def test_an_element_with_which_no_wall_as_soft_as_was_tried_is_safe_is_told_with_that_wall() -> None:
    failure = Failure("a case", 1.0, gone=False)
    assert format_limit(Limit(0.0, 310.0, failure)) == "below 0.31 N/mm"
    assert format_limit(Limit(0.0, 1.0, failure)) == "none"


def test_the_line_of_the_scene_that_breaks_says_on_which_wall_that_is() -> None:
    broken = 390.0, Failure("hold x 1", 1.0, gone=False)

    def words(stiffness_N_m: float, verdict: str) -> str:
        scene = SimpleNamespace(wall=SimpleNamespace(stiffness=stiffness_N_m), run=SimpleNamespace(verdict=verdict))
        told: Any = SimpleNamespace(breaks=scene, found=SimpleNamespace(breaks=broken))
        return breaks_words(told)

    stiffer = ": the case that breaks first, with a wall of 0.67 N/mm, on which the swing is plainer"
    assert words(665.0, "pushed").startswith(stiffer)
    assert words(390.0, "pushed") == ": the case that breaks first, with a wall of 0.39 N/mm"
    assert "to the end of the time in which" in words(390.0, "window")


def test_the_stages_of_an_advice_are_told_by_their_place_among_all() -> None:
    source = "".join(inspect.getsource(module) for module in (of_search, of_advice))
    assert tuple(re.findall(r'stage\("([^"]+)"\)', source)) == STAGES


def test_a_frequency_is_told_of_a_line_alone_and_both_senses_where_both_feel_it() -> None:
    spikes = Failure("hold x 1", 1.0, False, 22e-6, 0.7, 12.0, 2.0, True, None, 0.5, False, 6, 0.25)
    assert describe(spikes) == (
        "700 mN commanded and 22 µm peak to peak at no single frequency, turning 6 times in 0.25 s, felt as force; "
        "hold x 1"
    )
    wide = Failure("hold x 1", 1.0, False, 5.4e-3, 11.0, 30.0, 200.0, True, None, 90.0, True, 15, 0.25)
    assert "at 30 Hz, felt as force and as motion; " in describe(wide)


def test_how_rare_a_buzz_the_cases_may_have_missed_is_told_beside_the_answer() -> None:
    """Of what happens in one of n cases, (1 - 1/n)^N of the tries of N cases see nothing."""
    told = dict(answer(replace(ADVICE, found=replace(ADVICE.found, cases=2571))))["tried in"]
    [cases, one_of] = map(int, re.findall(r"\d{2,}", told))
    assert (cases, one_of) == (2571, 857)
    assert (1.0 - 1.0 / one_of) ** cases == pytest.approx(0.05, abs=1e-3)
    assert "tried in" not in dict(answer(replace(ADVICE, found=replace(ADVICE.found, stiffness_N_m=0.0))))
