"""The comparison of stabilizers: one search for all, what is measured of a wall, what is told apart, what is said."""

from dataclasses import replace

import numpy as np
import pytest

from haploop.protocol.scene.paths import with_value
from haploop.protocol.scene.scene import Scene
from haploop.tools.advise import families
from haploop.tools.advise.families import STABILIZERS, Family, applies, halton
from haploop.tools.advise.subject import make_subject
from haploop.tools.advise.walls.cases import Case, make_loop, ranges
from haploop.tools.advise.walls.limit import Query
from haploop.tools.advise.walls.rendered import Rendered, Trying, rendered, tried
from haploop.tools.advise.walls.trial import Store, Trial
from haploop.tools.compare.bench import Effort, Row, along
from haploop.tools.compare.comparison import AGAIN, TOLD, Comparison, Kept, OfLoop, as_comparison
from haploop.tools.compare.conditions import draw
from haploop.tools.compare.page import page, sentences
from haploop.tools.compare.ranking import best, held, ranking
from haploop.tools.compare.report import comparison_data, report
from haploop.tools.search.intervals import mean_interval
from helpers.scenes.least import KINDS
from helpers.shown import shown

WAVES = (-1.0, 1.0, -0.5, 0.5)


def loop_of(device: str, *overrides: str) -> Scene:
    asked = make_subject(device, None, None, None, overrides, KINDS)
    return make_loop(asked.scene, asked.has_task)


def row(family: Family, held_N_m: float, block: int = TOLD, spread_N_m: float = 10.0) -> Row:
    """A row whose seeds hold about so much."""
    seeds = [Trying(held_N_m, held_N_m, Rendered(held_N_m + spread_N_m * wave), np.inf, None) for wave in WAVES]
    return Row(family.name, block, (1.0,) * len(family.parts), (), tuple(seeds), None)


def compared(**held_N_m: float) -> Comparison:
    """A comparison on one loop, in which all stabilizers but those named hold 1000 N/m."""
    told = [held_N_m.get(name, 1000.0) for name in (family.name.replace(" ", "_") for family in STABILIZERS)]
    rows, again = (
        tuple(row(family, value, block) for family, value in zip(STABILIZERS, told, strict=True))
        for block in (TOLD, AGAIN)
    )
    return Comparison("a device", "a task", (), Effort(), (OfLoop("as described", 0.0, 1000.0, rows, again),))


def test_every_installed_element_is_compared():
    assert {kind for family in STABILIZERS for kind, _ in family.parts} == KINDS.keys()


def test_a_family_makes_elements_that_the_kinds_accept():
    for family in STABILIZERS:
        for table in family.elements((0.5,) * len(family.parts)):
            assert KINDS[table.name](**table.parameters)


def test_seeds_and_blocks_draw_other_conditions_and_the_same_seed_the_same():
    of = ranges(loop_of("premium15_cable"))
    assert draw(of, 1, 3, 4) == draw(of, 1, 3, 4)
    drawn = [case for block in (1, 2) for seed in range(6) for case in draw(of, block, seed, 3)]
    assert len(set(drawn)) == 36
    holds = sorted(case.hold for case in draw(of, 1, 1, 10))
    assert all(0.3 * 10 ** (i / 10) <= hold <= 0.3 * 10 ** ((i + 1) / 10) for i, hold in enumerate(holds))


@pytest.mark.parametrize("count", [1, 2, 3])
def test_parameters_lie_in_their_box_as_many_for_one_as_for_three(count):
    ends = [(1e-3, 10.0)] * count
    points = halton(ends, 6)
    beside = along(points[0], ends, 0.8, 6)
    assert len(points) == len(beside) == 6
    assert all(1e-3 <= value <= 10.0 for values in (*points, *beside) for value in values)


@pytest.fixture(scope="module")
def smooth() -> Scene:
    """A rigid device without friction and encoder, in the hand."""
    return replace(loop_of("touch"), friction=None, encoder=None, actuator=None)


def test_a_wall_alone_renders_its_own_stiffness_and_a_coupling_that_of_two_springs_in_a_row(smooth: Scene):
    case = (Case(1.0, sway=0.0),)
    coupling = families.STABILIZERS[-1].elements((900.0, 1.0, 0.01))[0]
    plain, coupled, none = rendered(
        [Query(smooth, elements, case, ()) for elements in ((), (coupling,), ())], [300.0, 300.0, 0.0]
    )
    assert plain[:2] == pytest.approx((300.0, 300.0), rel=1e-9)
    assert plain[3:] == pytest.approx((0.0, 0.0), abs=1e-12)
    assert coupled.held_N_m == pytest.approx(225.0, rel=0.01)
    assert none == Rendered()


def test_a_delay_is_felt_as_a_softer_contact_and_damping_as_a_harder_one(smooth: Scene):
    late = with_value(smooth, "clock.round_trip_delay", 1e-3)
    damping = families.DAMPING.elements((2.0,))
    case = (Case(1.0, sway=0.0),)
    queries = [Query(loop, elements, case, ()) for loop, elements in ((late, ()), (smooth, damping))]
    softer, harder = rendered(queries, [300.0, 300.0])
    assert softer.contact_N_m < 297.0
    assert harder.contact_N_m > 310.0
    assert softer.held_N_m == pytest.approx(300.0, rel=0.02)
    assert harder.extra_N > harder.extra_rms_N > 0.0


def test_what_may_differ_by_nothing_or_is_not_reproduced_cannot_be_told_apart():
    few, many = families.NOTHING, families.DAMPING
    rows = (row(few, 1000.0), row(many, 1050.0))
    same = OfLoop("a", 0.0, 1.0, rows, (row(few, 1000.0, AGAIN), row(many, 1050.0, AGAIN)))
    assert ranking(same).versus("damping", "nothing") == "more"
    assert ranking(same).versus("nothing", "damping") == "less"
    other = replace(same, again=(row(few, 1050.0, AGAIN), row(many, 1000.0, AGAIN)))
    assert ranking(other).versus("damping", "nothing") == "alike"
    assert ranking(other).contradicted == {("damping", "nothing")}
    wide = replace(same, rows=(row(few, 1000.0, spread_N_m=200.0), row(many, 1050.0)))
    assert not ranking(wide).told
    assert best(wide)[1] == [wide.rows[0]]
    assert held(rows[0]).low < 1000.0 < held(rows[0]).high


def test_the_sentences_follow_from_the_rankings():
    told = sentences([compared()])
    assert len(told) == 5
    assert "adaptive inertia does not help" in told[4]
    assert told[2] == "Damping against nothing: it cannot be told from it on any of these loops."
    assert told[1].endswith("on a device at 0 ms nothing.")
    helped = sentences([compared(adaptive_damping_and_inertia=2000.0)])
    assert "against adaptive damping: it renders more on each of these loops" in helped[4]
    assert "adaptive inertia helps there" in helped[4]
    assert helped[1].endswith("adaptive damping and inertia.")
    worse = sentences([compared(adaptive_damping_and_inertia=2000.0, adaptive_inertia=500.0)])
    assert "adaptive inertia is no remedy" in worse[4]
    assert "no element holds more than none" in told[0]
    assert "no element" not in helped[0]
    harmful = sentences([compared(unidirectional_inertia=500.0)])
    assert "renders less on each of these loops" in harmful[3]


def test_page_and_report_are_made_of_what_was_written():
    told = compared(bidirectional_inertia=2000.0)
    again = as_comparison(comparison_data(told))
    assert page([again]) == page([told])
    assert "bidirectional inertia" in page([told])
    assert max(map(len, shown(report(told), 80).splitlines())) <= 80


def test_what_is_kept_survives_a_line_that_was_cut_off(tmp_path):
    kept = Kept(tmp_path / "rows.jsonl")
    kept.add("a", 1.0)
    kept.add("b", {"x": [1, 2]})
    whole = (tmp_path / "rows.jsonl").read_text()
    (tmp_path / "rows.jsonl").write_text(whole[:-8])
    again = Kept(tmp_path / "rows.jsonl")
    assert again.get("a") == 1.0
    assert again.get("b") is None
    again.add("c", 2.0)
    assert Kept(tmp_path / "rows.jsonl").get("c") == 2.0


def test_force_bounding_is_left_out_where_the_device_declares_no_damping():
    bounding = families.FORCE_BOUNDING
    assert not applies(bounding, loop_of("premium15_cable"))
    assert applies(bounding, loop_of("touch"))


@pytest.mark.slow
def test_inertia_as_the_page_tuned_it_holds_more_than_nothing_behind_a_cable_under_seeds_of_neither_set():
    loop, rungs = loop_of("premium15_cable"), tuple(2200.0 * times for times in (0.4, 0.7, 0.85, 1.0, 1.2, 1.45))
    cases = [draw(ranges(loop), 3, seed, 3) for seed in range(1, 6)]
    elements = (families.NOTHING.elements(()), families.BIDIRECTIONAL.elements((0.29e-3,)))
    with Trial(Store()) as trial:
        found = tried(trial, [Query(loop, some, each, rungs) for some in elements for each in cases], 0.08)
    without, inertia = found[: len(cases)], found[len(cases) :]
    more = [one.rendered.held_N_m - than.rendered.held_N_m for one, than in zip(inertia, without, strict=True)]
    assert mean_interval(more).low > 0.0
