"""Waiting for what a process does: until it is seen, never for a time that should do."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

# Time after which a test gives up. It does not imply how long anything may take.
PATIENCE_S = 120.0


def wait_for(what: str, look: Callable[[], Any]) -> Any:
    """The first true result of ``look``."""
    give_up = time.monotonic() + PATIENCE_S
    while not (answer := look()):
        assert time.monotonic() < give_up, f"{what} has not come within {PATIENCE_S:g} s"
        time.sleep(0.03)
    return answer


def wait_till_stays(what: str, look: Callable[[], Any], value: Any) -> None:
    """Waits until ``look`` gives a value eleven times in a row: a node that is greeted has the tick of the run, too."""
    found: list[bool] = []

    def stays() -> bool:
        found.append(look() == value)
        return len(found) > 10 and all(found[-11:])

    wait_for(what, stays)
