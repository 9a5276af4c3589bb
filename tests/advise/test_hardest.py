"""The corner that is hardest on a wall is found by its direction, also where no design of 32 corners has it."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from haploop.tools.advise.hardest import hardest
from haploop.tools.advise.walls.cases import Case
from haploop.tools.advise.walls.corners import corner, design
from haploop.tools.advise.walls.store import Failure
from helpers.scenes.presets import loop_of

LOOP, FAILS = loop_of("premium15"), Failure("a case", 1.0, gone=False, tried=Case(1.0))
OF = {f"q{number}": (0.8, 1.2) for number in range(11)}
HOLDS = (0.3, 1.0, 3.0)
# What is told of a case in which friction holds the device off the wall.
UNTOLD = Failure("cannot be told", 1.0, gone=False)


def is_held_off(hold: float, some: Any) -> bool:
    return hold == 0.3 and dict(some).get("q0") == 1.2


@pytest.mark.parametrize("together", [0.0, 0.04])
@pytest.mark.parametrize("seed", range(3))
def test_of_eleven_quantities_of_which_some_act_together_the_hardest_of_2048_corners_is_told_at_each_hold(
    seed, together
):
    random = np.random.default_rng(seed)
    main = random.uniform(0.03, 0.12, (3, len(OF))) * random.choice([-1.0, 1.0], (3, len(OF)))
    i, j = random.choice(len(OF), (2, 4), replace=False)

    def bears(hold: float, some: Any) -> float:
        signs = np.array([5.0 * (factor - 1.0) for _, factor in some])
        return 2000.0 * float(np.exp(main[HOLDS.index(hold)] @ signs + together * np.sum(signs[i] * signs[j])))

    def of_jobs(jobs: Any) -> Any:
        limits = [min(bears(case.hold, case.corner) if case.corner else 9e9 for case in job.cases) for job in jobs]
        found = []
        for job, limit in zip(jobs, limits, strict=True):
            fails = UNTOLD if any(is_held_off(case.hold, case.corner) for case in job.cases) else FAILS
            found.append([None if wall.stiffness_N_m < limit and fails is FAILS else fails for wall in job.walls])
        return found

    trial: Any = SimpleNamespace(of_jobs=of_jobs)
    found = hardest(LOOP, trial, (), OF, 1000.0)
    every = [corner(OF, number) for number in range(2 ** len(OF))]
    for hold in HOLDS:
        least, in_design = (
            min(bears(hold, some) for some in of if some and not is_held_off(hold, some)) for of in (every, design(OF))
        )
        told = min(bears(hold, some) for some in found if not is_held_off(hold, some))
        assert told <= 1.1 * least, "a rung is a tenth"
        assert told <= in_design


def test_where_nothing_is_safe_or_nothing_uncertain_there_is_no_hardest_corner():
    trial: Any = SimpleNamespace()
    assert hardest(LOOP, trial, (), OF, 0.0) == hardest(LOOP, trial, (), {}, 1000.0) == ()
