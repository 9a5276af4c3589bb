"""The largest stiffness that ``haploop run`` calls steady: no hand feels the swing that remains.

The study itself requires, like the paper, a swing of no more than one encoder step to either side (``steadiness``); a
hand feels most of that. By the verdict of a run fewer and softer walls are steady.
"""

from __future__ import annotations

import numpy as np

from haploop.controller.dissipation import registry
from haploop.launch.runs.in_batch import run_batch
from haploop.tools.search.intervals import Interval, mean_interval
from haploop.tools.studies.choi2022.answers import Answers
from haploop.tools.studies.choi2022.device import Setup
from haploop.tools.studies.choi2022.steadiness import CHOSEN_BY, JUDGED_BY, Presses, sizes_of

# From 0.1 N/mm in steps of 0.1 N/mm.
RUN_STIFFNESSES = np.arange(1, 81) * 100.0
# The sizes on a wall are judged in this many parts, so that as many cores share them.
_PARTS = 4


def steady_to_run(answers: Answers, setup: Setup, kind: str) -> Interval:
    """Returns the largest stiffness in N/mm up to which ``haploop run`` calls every wall steady, a mean over starts.

    The size, chosen on other starts, is the middle one of those that withstand the most.
    """
    sizes = sizes_of(kind, answers.small)[:: 3 if answers.small else 2].tolist()
    bears = _climbed(answers, setup, kind, sizes, CHOSEN_BY[:1] if answers.small else CHOSEN_BY).mean(axis=1)
    there = np.flatnonzero(bears == bears.max())
    best = sizes[there[len(there) // 2]]
    return mean_interval(_climbed(answers, setup, kind, [best], CHOSEN_BY[:2] if answers.small else JUDGED_BY)[0] / 1e3)


def _climbed(
    answers: Answers, setup: Setup, kind: str, sizes: list[list[float]], starts: tuple[int, ...]
) -> np.ndarray:
    """Returns the largest stiffness in N/m up to which ``haploop run`` calls all steady, shape (sizes, starts)."""
    rungs = np.zeros((len(sizes), len(starts)), int)
    for rung, wall in enumerate(RUN_STIFFNESSES.tolist()):
        there = np.flatnonzero((rungs == rung).any(axis=1))
        if not len(there):
            break
        presses = [
            Presses(setup, kind, [wall], [sizes[place] for place in part], starts)
            for part in np.array_split(there, 1 if answers.small else min(_PARTS, len(there)))
        ]
        called = answers.map_parallel(f"{kind.replace('-', ' ')} by run's word", called_steady, presses)
        rungs[there] += np.concatenate(called, axis=1)[0] & (rungs[there] == rung)
    return np.append(0.0, RUN_STIFFNESSES)[rungs]


def called_steady(presses: Presses) -> np.ndarray:
    """Returns which presses ``haploop run`` calls steady, shape (walls, sizes, starts)."""
    words = [result.get("verdict") for result in run_batch(presses.scenes(), registry(), energy=False)]
    return np.reshape([word == "steady" for word in words], (len(presses.walls), len(presses.sizes), -1))
