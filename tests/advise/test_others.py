"""Elements beside the simple ones: which go on to every corner, and what is told of those that hide their wall."""

from haploop.tools.advise import others
from haploop.tools.advise.families import (
    ADAPTIVE_INERTIA,
    COUPLING,
    HIDING,
    OTHERS,
    STABILIZERS,
    first_choices,
)
from haploop.tools.advise.others import hiding, others_bearing
from haploop.tools.advise.walls.cases import Case
from haploop.tools.advise.walls.limit import Query
from haploop.tools.advise.walls.rendered import Rendered, Trying
from haploop.tools.advise.walls.store import Failure, Store
from haploop.tools.advise.walls.trial import Trial
from helpers.scenes.presets import loop_of


def test_no_element_is_both_compared_by_its_wall_and_known_to_hide_it_and_few_are_neither():
    assert not set(OTHERS) & set(HIDING)
    assert {family.name for family in STABILIZERS if family not in (*OTHERS, *HIDING) and family.parts} == {
        "damping", "bidirectional inertia", "unidirectional inertia", "damping and unidirectional inertia",
        "passivity controller with inertia",
    }  # fmt: skip


def test_each_parameter_of_every_other_element_is_asked_for_a_wall_in_all_cases(monkeypatch):
    loop, asked = loop_of("premium15_cable"), []

    def of_jobs(self, jobs):
        asked.extend(jobs)
        kinds = [job.walls[0].elements[0].name for job in jobs]
        return [[None if kind == "adaptive-inertia" else Failure("a case", 1.0, gone=False)] for kind in kinds]

    monkeypatch.setattr(Trial, "of_jobs", of_jobs)
    cases = Case(0.3), Case(3.0)
    with Trial(Store()) as trial:
        found = others_bearing(loop, trial, cases, 2100.0)
    assert {(job.walls[0].stiffness_N_m, job.cases) for job in asked} == {(2100.0, cases)}
    assert len(asked) == sum(len(first_choices(family, loop)) for family in OTHERS)
    assert found == [(ADAPTIVE_INERTIA, values) for values in first_choices(ADAPTIVE_INERTIA, loop)]


def test_a_coupling_is_told_where_it_holds_more_than_all_others_and_not_by_the_stiffness_of_its_wall(monkeypatch):
    loop = loop_of("premium15_cable")

    def held(trial: Trial, queries: list[Query], tolerance: float):
        return [Trying(1e6, 1e6, Rendered(held_N_m=100.0 * place), 1e9, None) for place, _ in enumerate(queries)]

    monkeypatch.setattr(others, "tried", held)
    monkeypatch.setattr(Trial, "of_jobs", lambda self, jobs: [[None] for _ in jobs])
    with Trial(Store()) as trial:
        [found] = hiding(loop, trial, 2000.0, 400.0)
        assert hiding(loop, trial, 2000.0, 500.0) == ()
    assert (found.family, found.held_N_m) == (COUPLING, 500.0)
