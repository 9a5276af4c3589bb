"""The answer to a change that a program of somebody else's is asked for: given when it has been seen, or refused."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator

from haploop.launch.clock.clock import Clock, ClockError
from haploop.launch.clock.roster import Roster
from haploop.protocol.changes import changes_of
from haploop.protocol.transport.wire import Message

# Of the 5 s for which a terminal waits for its answer.
_PATIENCE_S = 3.0
_NOT_YET = "; not all of this loop is haploop's own, and whether it carries this out is seen when the tick is done"


def when_seen(
    clock: Clock, roster: Callable[[], Roster], text: str, data: Message
) -> Generator[None, None, tuple[str, Message]]:
    """Returns a command's answer once its change has been seen in telemetry.

    It yields while time goes on, and says so in the answer where time does not get there soon.

    Raises ClockError where the change was refused.
    """
    tick, give_up = data["tick"], time.monotonic() + _PATIENCE_S
    while tick <= clock.until and not clock.paused and time.monotonic() < give_up:
        logger = roster().own("logger")
        if logger is None or logger.tick > tick or logger.done:
            break
        yield
    if refused := next((c.refused for c in changes_of(clock.events) if c.tick == tick and c.refused), None):
        raise ClockError(refused)
    logger = roster().own("logger")
    return text + ("" if logger and logger.tick > tick else _NOT_YET), data
