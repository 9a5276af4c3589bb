"""Watching pushed copies of a loop until they tell what becomes of its swing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from haploop.controller.dissipation import ElementError
from haploop.launch.stability.finding import Finding
from haploop.launch.stability.looks import failed, findings, left_limit, watch_times
from haploop.launch.stability.memory_drift import may_act
from haploop.launch.stability.still_hand import End, StillHand
from haploop.launch.stability.swing import REST_M

# Whether a loop moves that is left alone is looked at for this long.
GLANCE_S = 0.25


def moves_on(end: End) -> bool:
    """Tells whether a loop moves on, left alone from the end of its run."""
    copy = StillHand(end, 0.0)
    try:
        copy.go_to(GLANCE_S)
    except (ArithmeticError, ElementError):
        return True
    return bool(copy.stop_reason) or float(np.ptp(copy.x)) >= REST_M


def watch(end: End, pushes_N: tuple[float, ...], looks_s: Sequence[float]) -> tuple[Finding, np.ndarray]:
    """Watches a copy of the loop for each push until the copies tell what becomes of its swing.

    Args:
        end: where the copies go on from.
        pushes_N: the force of each push; the hardest last.
        looks_s: times since the push at which the copies are looked at.

    Returns:
        The finding, and the positions of the copy pushed hardest at its ticks since the push, m.
    """
    copies = [StillHand(end, push_N) for push_N in pushes_N]
    wall, push_N = end.controller.params.wall, pushes_N[-1]
    delay_steps = end.plant.checkpoint().delay_steps
    times_s = watch_times(end.time, end.time.delay_steps if delay_steps is None else delay_steps, looks_s)
    found = failed(push_N, 0.0, "")
    for seconds in times_s:
        try:
            for copy in copies:
                copy.go_to(seconds)
        except (ArithmeticError, ElementError) as error:
            found = failed(push_N, seconds, str(error))
            break
        gone = [copy.x for copy in copies if copy.stop_reason]
        if gone:
            found = left_limit(push_N, seconds, wall, min(gone, key=len))
            break
        pushed = [each[None] for each in (copies[0].x, copies[-1].x, copies[-1].command)]
        last = seconds == times_s[-1]
        [found] = findings(pushed, end.time, wall, [end.scene], np.array([push_N]), last=last)
        if found.word == "steady":
            acts = may_act(copies[-1].memory(), found.width_m >= REST_M, seconds, last=last)
            found = replace(found, memory_drifts=bool(acts))
        if found.tells:
            break
    return found, copies[-1].x
