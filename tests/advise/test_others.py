"""Elements beside the simple ones: which go on to every corner, and what is told of those that hide their wall."""

from haploop.tools.advise import others
from haploop.tools.advise.advice import HOLDS_MORE
from haploop.tools.advise.families import (
    ADAPTIVE_DAMPING,
    ADAPTIVE_INERTIA,
    BIDIRECTIONAL,
    COUPLING,
    HIDING,
    NOTHING,
    OTHERS,
    STABILIZERS,
)
from haploop.tools.advise.others import hiding, worth_more
from haploop.tools.advise.subject import make_subject
from haploop.tools.advise.walls.cases import make_loop
from haploop.tools.advise.walls.limit import Limit, Query
from haploop.tools.advise.walls.rendered import Rendered, Trying
from haploop.tools.advise.walls.trial import Store, Trial
from helpers.scenes.least import KINDS


def test_no_element_is_both_compared_by_its_wall_and_known_to_hide_it_and_few_are_neither():
    assert not set(OTHERS) & set(HIDING)
    assert {family.name for family in STABILIZERS if family not in (*OTHERS, *HIDING) and family.parts} == {
        "damping", "bidirectional inertia", "unidirectional inertia", "damping and unidirectional inertia",
        "adaptive damping and inertia",
    }  # fmt: skip


def test_another_element_goes_on_only_where_it_bears_more_than_every_simple_one_and_a_tenth_more_than_none():
    stiffness = dict.fromkeys(OTHERS, 1000.0) | {NOTHING: 1000.0, BIDIRECTIONAL: 1500.0}

    def going_on(**changed: float):
        found = {family: changed.get(family.name.replace(" ", "_"), value) for family, value in stiffness.items()}
        return worth_more({(family, (1.0,)): Limit(value, value) for family, value in found.items()}, 1.1)

    assert going_on() == []
    assert going_on(adaptive_damping=1400.0) == []
    assert going_on(adaptive_damping=1600.0) == [ADAPTIVE_DAMPING]
    assert going_on(adaptive_damping=1600.0, adaptive_inertia=1700.0) == [ADAPTIVE_INERTIA, ADAPTIVE_DAMPING]
    assert going_on(adaptive_damping=1050.0, bidirectional_inertia=1000.0) == []


def test_a_coupling_is_told_where_it_holds_more_than_all_others_and_not_by_the_stiffness_of_its_wall(monkeypatch):
    asked = make_subject("premium15_cable", None, None, None, [], KINDS)
    loop = make_loop(asked.scene, asked.has_task)

    def held(trial: Trial, queries: list[Query], tolerance: float):
        return [Trying(1e6, 1e6, Rendered(held_N_m=100.0 * place), 1e9, None) for place, _ in enumerate(queries)]

    monkeypatch.setattr(others, "tried", held)
    with Trial(Store()) as trial:
        [found] = hiding(loop, trial, 2000.0, 400.0)
        assert hiding(loop, trial, 2000.0, 500.0) == ()
    assert (found.family, found.held_N_m) == (COUPLING, 500.0)
    assert "0.5 N/mm" in HOLDS_MORE.format(found.family.name, found.family.words(found.values), found.held_N_m / 1e3)
