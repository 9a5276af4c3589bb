"""The comparison of stabilizers: one search for all, what is measured of a wall, and what is told apart."""

from dataclasses import replace

import numpy as np
import pytest

from haploop.protocol.scene.paths import with_value
from haploop.protocol.scene.scene import Encoder, Scene
from haploop.tools.advise import families
from haploop.tools.advise.families import STABILIZERS, Family, Values, halton
from haploop.tools.advise.subject import make_subject
from haploop.tools.advise.walls.cases import Case, make_loop
from haploop.tools.advise.walls.corners import ranges
from haploop.tools.advise.walls.limit import Query
from haploop.tools.advise.walls.rendered import Rendered, Trying, rendered, tried
from haploop.tools.advise.walls.store import Store
from haploop.tools.advise.walls.trial import Trial
from haploop.tools.compare import bench as of_bench
from haploop.tools.compare.bench import BESIDE, Effort, Job, Shown, along, bench, gentlest
from haploop.tools.compare.comparison import AGAIN, TOLD, Kept, OfLoop, _each, bounded_N_m, plays
from haploop.tools.compare.conditions import draw
from haploop.tools.compare.ranking import best, choice, held, ranking
from haploop.tools.executor.executors import make_executor
from haploop.tools.search.intervals import mean_interval
from helpers.data.compared import row
from helpers.scenes.least import KINDS


def loop_of(device: str, *overrides: str) -> Scene:
    asked = make_subject(device, None, None, None, overrides, KINDS)
    return make_loop(asked.scene, asked.has_task)


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


@pytest.mark.parametrize("family", [families.NOTHING, families.DAMPING, families.ADAPTIVE_BOTH, STABILIZERS[-1]])
def test_every_stabilizer_has_the_same_effort_and_the_search_goes_where_most_is_held(
    family: Family, monkeypatch: pytest.MonkeyPatch
):
    """In place of loops: a hill of what is held over the parameters, highest in the middle of their box."""
    ends = families.box(family, loop := loop_of("touch", "clock.round_trip_delay=1e-3"), 1000.0)
    asked: list[int] = []

    def hill(_: Trial, queries: list[Query], tolerance: float) -> list[Trying]:
        values = [tuple(v for table in query.elements for v in table.parameters.values()) for query in queries]
        off = [sum((np.log(v / (low * high) ** 0.5) / np.log(high / low)) ** 2
                   for v, (low, high) in zip(some, ends, strict=True)) for some in values]  # fmt: skip
        asked.append(len(queries))
        return [Trying(1000.0, 1000.0, Rendered(1000.0 - 500.0 * each), np.inf, None) for each in off]

    monkeypatch.setattr(of_bench, "tried", hill)
    effort = Effort()
    rows = bench(Job(loop, family.name, 1000.0, ((TOLD, None), (AGAIN, None)), effort))
    *tuning, trial = asked
    if family.parts:
        first, second, last = (count / 2 for count in tuning)
        assert first == effort.first * (effort.points + 1)
        assert effort.tuning * effort.around <= second <= effort.tuning * (effort.finalists + effort.around)
        assert last == effort.last * (effort.finalists + 1)
    else:
        assert not tuning
    moved = 2 + 2 * bool(family.parts)
    assert trial == 2 * effort.seeds + moved * effort.moved
    assert [row.block for row in rows] == [TOLD, AGAIN]
    assert all(held(row).value > 970.0 for row in rows), "of 625 to 1000 in the box of three parameters"
    assert len(rows[0].device) == 2
    assert len(rows[0].parameter) == 2 * bool(family.parts)
    beside = bench(Job(loop, family.name, 1000.0, tuple((row.block, row.values) for row in rows), BESIDE))
    assert all(held(more).value >= held(less).value for more, less in zip(beside, rows, strict=True))


def test_of_what_holds_as_much_within_a_standard_error_the_least_force_is_taken():
    held_N_m: dict[Values, list[float]] = {
        (9.0,): [900.0, 1100.0, 1000.0],
        (5.0,): [950.0, 990.0, 1040.0],
        (1.0,): [700.0, 800.0, 750.0],
    }
    known = {values: Shown(np.array(of), np.full(3, values[0])) for values, of in held_N_m.items()}
    assert gentlest(known) == (5.0,)
    assert gentlest({values: each for values, each in known.items() if values != (5.0,)}) == (9.0,)


@pytest.fixture(scope="module")
def smooth() -> Scene:
    """A rigid device without friction and encoder, in the hand."""
    return replace(loop_of("touch"), friction=None, encoder=None, actuator=None)


@pytest.mark.slow
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
    coarse = replace(smooth, encoder=Encoder(resolution=2e-4))
    [read] = rendered([Query(coarse, (), case, ())], [300.0])
    assert read.held_N_m == pytest.approx(300.0, rel=1e-9), "of what is read, wherever between counts the device is"


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
    assert choice(wide).family == "nothing"
    assert choice(same).family == "damping"
    assert not ranking(wide).told
    assert best(wide)[1] == [wide.rows[0]]
    assert held(rows[0]).low < 1000.0 < held(rows[0]).high


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


@pytest.mark.slow
def test_force_bounding_holds_two_b_over_t_and_is_left_out_where_that_is_next_to_nothing(smooth: Scene):
    bounding = families.FORCE_BOUNDING
    [found] = rendered([Query(smooth, bounding.elements((1.0,)), (Case(0.3, sway=0.0),), ())], [2000.0])
    assert found.held_N_m == pytest.approx(bounded_N_m(smooth), rel=0.1)
    assert bounded_N_m(smooth) == pytest.approx(20.0)
    assert plays(bounding, smooth, 150.0)
    assert not plays(bounding, smooth, 250.0)
    assert plays(families.DAMPING, smooth, 250.0)


@pytest.mark.slow
def test_inertia_as_the_page_tuned_it_holds_more_than_nothing_behind_a_cable_under_seeds_of_neither_set():
    loop, rungs = loop_of("premium15_cable"), tuple(2200.0 * times for times in (0.4, 0.7, 0.85, 1.0, 1.2, 1.45))
    cases = [draw(ranges(loop), 3, seed, 3) for seed in range(1, 13)]
    elements = (families.NOTHING.elements(()), families.BIDIRECTIONAL.elements((0.29e-3,)))
    with Trial(Store()) as trial:
        found = tried(trial, [Query(loop, some, each, rungs) for some in elements for each in cases], 0.08)
    without, inertia = found[: len(cases)], found[len(cases) :]
    more = [one.rendered.held_N_m - than.rendered.held_N_m for one, than in zip(inertia, without, strict=True)]
    assert mean_interval(more).low > 0.0


def test_a_comparison_tells_how_many_of_how_many_are_done_and_counts_what_was_kept(tmp_path):
    told: list[tuple[str, int]] = []
    done: list[str] = []

    def stage(name: str, count: int):
        told.append((name, count))
        return lambda: done.append(name)

    kept = Kept(tmp_path / "rows.jsonl")
    with make_executor(1) as executor:
        for _ in range(2):
            _each(float, {"a": 1.0, "b": 2.0}, kept, executor, stage, "walls", float)
    assert told == [("walls", 2)] * 2
    assert done == ["walls"] * 4
