"""Elements in every corner: the size that suits a loop as described may bear nothing there, a smaller one much."""

from types import SimpleNamespace
from typing import Any

import pytest

from haploop.tools.advise.families import DAMPING, NOTHING, UNIDIRECTIONAL
from haploop.tools.advise.search import in_corners, worth_trying
from haploop.tools.advise.walls.cases import Case
from haploop.tools.advise.walls.limit import Limit
from haploop.tools.advise.walls.store import Failure
from helpers.scenes.presets import loop_of

LOOP = loop_of("premium15")
FAILS = Failure("a case", 1.0, gone=False)
ALONE_N_M = 1000.0
# Damping -> walls, N/m, borne as described and in the corners: the largest bears most, then nothing.
WALLS = {16.0: (8000.0, 0.0), 8.0: (6000.0, 0.0), 4.0: (4000.0, 3000.0), 2.0: (2500.0, 1800.0), 1.0: (1050.0, 1040.0)}


def found_in_corners(candidates: Any = None) -> Any:
    known = {(DAMPING, (size,)): Limit(0.98 * walls[0], walls[0], FAILS) for size, walls in WALLS.items()}
    known |= {(NOTHING, ()): Limit(ALONE_N_M, ALONE_N_M * 1.02, FAILS)}
    known |= {(UNIDIRECTIONAL, (0.01,)): Limit(ALONE_N_M, ALONE_N_M * 1.02, FAILS)}

    def bears(wall: Any) -> bool:
        sizes = [size for element in wall.elements for size in element.parameters.values()]
        return wall.stiffness_N_m < (WALLS[sizes[0]][1] if sizes else 0.9 * ALONE_N_M)

    def of_jobs(jobs: Any) -> Any:
        return [[None if bears(wall) else FAILS for wall in job.walls] for job in jobs]

    trial: Any = SimpleNamespace(of_jobs=of_jobs)
    families = DAMPING, UNIDIRECTIONAL
    candidates = worth_trying(known, families) if candidates is None else candidates
    return known, in_corners(LOOP, trial, known, (Case(1.0),), families, candidates)


def test_an_element_of_which_only_a_smaller_size_bears_the_corners_is_advised_at_that_size() -> None:
    known, (alone, damping, inertia) = found_in_corners()
    assert {values for family, values in worth_trying(known, (DAMPING,))} == {(16.0,), (8.0,), (4.0,), (2.0,)}
    assert alone.safe.stiffness_N_m == pytest.approx(900.0, rel=0.06)
    assert damping.values == (4.0,)
    assert damping.safe.stiffness_N_m == pytest.approx(3000.0, rel=0.06)
    assert inertia.safe is None


def test_the_sizes_that_bear_most_as_described_alone_would_say_that_no_element_helps() -> None:
    _, (_, damping, _) = found_in_corners([(DAMPING, (16.0,)), (DAMPING, (8.0,))])
    assert damping.safe is None
