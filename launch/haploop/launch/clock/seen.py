"""The answer to a change that a foreign program or element is to make: given once it is seen or refused."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator

from haploop.launch.clock.clock import Clock, ClockError
from haploop.launch.clock.roster import Roster
from haploop.protocol.changes import changes_of
from haploop.protocol.transport.wire import Message

# Part of the 5 s for which a terminal waits for its answer.
_PATIENCE_S = 3.0
_NOT_YET = {
    "logger": "; not all of this loop is haploop's own, so the end of that tick will show whether this is carried out",
    "controller": "; it will be tried on the motion of that tick when time reaches it",
}


def when_seen(
    clock: Clock, roster: Callable[[], Roster], text: str, data: Message, by: str = "logger"
) -> Generator[None, None, tuple[str, Message]]:
    """Returns a command's answer once its change has been seen in telemetry, or carried out by the controller.

    Yields while time goes on; if time does not reach the change soon, the answer says so.

    Args:
        by: the role whose tick shows it: ``logger`` or ``controller``.

    Raises ClockError if the change was refused.
    """
    tick, give_up = data["tick"], time.monotonic() + _PATIENCE_S
    while tick <= clock.until and not clock.paused and time.monotonic() < give_up:
        node = roster().own(by)
        if node is None or node.tick > tick or node.done:
            break
        yield
    if refused := next((c.refused for c in changes_of(clock.events) if c.tick == tick and c.refused), None):
        raise ClockError(refused)
    node = roster().own(by)
    return text + ("" if node and node.tick > tick else _NOT_YET[by]), data
