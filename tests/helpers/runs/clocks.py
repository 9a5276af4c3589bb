"""The clock that the tests of the clock query, and short forms of the queries."""

import math
from typing import Any

from haploop.launch.clock.clock import Clock
from haploop.protocol.ticks import Timebase
from helpers.scenes.least import KINDS, WALL, scene

DAMPING = {"kind": "damping", "damping": 0.5}
SWAP = {"swap": DAMPING, "element": 0}
TICKS, WINDOW = 1000, 400
WINDOW_OF_400 = {"block_ticks": 100, "window_blocks": 4}


def clock(pace: float = math.inf, run: dict[str, Any] | None = None, **tables: Any) -> Clock:
    """The clock of a run of 1000 ticks that grants 400 beyond the slowest node."""
    resolved = scene(wall=WALL, dissipation=[DAMPING], run=run or WINDOW_OF_400, **tables)
    return Clock(resolved, Timebase.from_scene(resolved), KINDS, pace)


def granted(subject: Clock, slowest: int = TICKS, now: float = 0.0) -> int:
    return subject.grant(slowest, now)


def sent(subject: Clock) -> list[tuple[int, str]]:
    """The events that are sent now, by what they do."""
    verbs = ("swap", "set", "pause", "resume", "stop", "refused")
    return [(tick, next(verb for verb in verbs if verb in event)) for tick, event in subject.take_events()]
