"""How quiet the machine is while times are taken: told with them, for no repeat mends what runs beside all of them."""

from __future__ import annotations

import os
import statistics
import time
from collections.abc import Iterable
from typing import Any

from haploop.tools.cost.data import Load

_STEPS = 100_000


def look(alone: bool) -> dict[str, Any]:
    """What can be seen now: the time of a loop that always does the same, s, and the load average.

    Args:
        alone: this process is all that should run; otherwise the load average tells nothing.
    """
    return {"loop_s": _loop_s(), "load": _load_average() if alone else None}


def _loop_s() -> float:
    value = 1.0
    began = time.perf_counter()
    for _ in range(_STEPS):
        value = 0.5 * value + 0.25
    return time.perf_counter() - began


def _load_average() -> float | None:
    """Processes running or waiting for a core in the last minute, where the system tells."""
    return os.getloadavg()[0] if hasattr(os, "getloadavg") else None


def judged(looks: Iterable[dict[str, Any]]) -> Load | None:
    """What several looks come to; None for none."""
    looks = list(looks)
    if not looks:
        return None
    loops = [look["loop_s"] for look in looks]
    loads = [look["load"] for look in looks if look["load"] is not None]
    q1, middle, q3 = statistics.quantiles(loops, n=4, method="inclusive") if len(loops) > 1 else loops * 3
    return Load(statistics.median(loads) if loads else None, (q3 - q1) / middle)
