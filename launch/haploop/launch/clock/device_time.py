"""A run whose plant owns the time, as a device does: what it needs, what it refuses, and the lateness it reports."""

from __future__ import annotations

import math
from typing import Any

from haploop.launch.spec import OutputError, RunSpec
from haploop.protocol.ticks import DELAY
from haploop.protocol.transport.wire import Message

PLANT = "plant"
# Commands that would halt a device's time or hurry it.
REFUSED = ("pause", "resume", "step", "pace")
GOES_ON = "The plant owns the time of this run, which advances by the clock of the plant; `haploop stop` ends it."
DELAY_STAYS = "The delay is the time available for the answers to a device; it stays as it was when the run began."
_SECONDS = ("median_s", "percent_99_s", "percent_99_9_s", "most_s", "late_s", "lost_s")
_COUNTS = ("ticks", "late_ticks")


def check_owner(spec: RunSpec) -> None:
    """Raises OutputError if the plant of a run is to own the time but cannot."""
    if spec.clock != PLANT:
        return
    if PLANT not in spec.programs:
        raise OutputError(
            "--clock plant needs a plant that keeps the time, given by --node plant=COMMAND or --external plant; "
            "the run's own plant does not keep time, but --pace 1 does."
        )
    if not math.isinf(spec.pace):
        raise OutputError("--clock plant leaves the time to the plant, but --pace sets it; leave out one of them.")
    if any(event.pause for event in spec.scene.event):
        raise OutputError("--clock plant was asked for, but an [[event]] of the scene pauses; a device does not pause.")
    if any(DELAY in (event.set or {}) for event in spec.scene.event):
        raise OutputError(f"--clock plant was asked for, but an [[event]] sets {DELAY}. {DELAY_STAYS}")


def refusal(verb: str, arguments: Message) -> str:
    """Returns why a command cannot be carried out while the plant owns the time; "" if it can."""
    if verb in REFUSED:
        return GOES_ON
    values = arguments.get("set")
    return DELAY_STAYS if verb == "set" and isinstance(values, dict) and DELAY in values else ""


def lateness_told(told: Message) -> dict[str, Any]:
    """Returns the ``lateness`` figures that a plant reported, marked by ``clock``; only the mark if there are none."""
    late = told.get("lateness")
    if not isinstance(late, dict):
        return {"clock": PLANT}
    figures: dict[str, Any] = {key: late.get(key) for key in (*_COUNTS, *_SECONDS)}
    are_counts = all(type(figures[key]) is int and figures[key] >= 0 for key in _COUNTS)
    are_seconds = all(type(figures[key]) in (int, float) and 0.0 <= figures[key] < math.inf for key in _SECONDS)
    return {**(figures if are_counts and are_seconds and figures["ticks"] else {}), "clock": PLANT}
