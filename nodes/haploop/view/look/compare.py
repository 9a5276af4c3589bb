"""Comparison of a loop before and after its last change: the half second on either side, in figures and numbers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from haploop.protocol.changes import Event, is_change, refused_change
from haploop.view.look.budget import budget
from haploop.view.look.sight import Sight, see, window_ticks
from haploop.view.store.history import History

# Number of changes, the newest, of which the half second before is kept.
_MOST = 64


@dataclass(frozen=True)
class Half:
    """One side of a change: what was seen, its energy budget, and its position and force at ticks, shape (2, ticks)."""

    sight: Sight
    budget: dict[str, Any] | None
    traces: np.ndarray


class Changes:
    """Keeps the half second before every swap, set and taking back of a swap, which a history of full rows forgets."""

    def __init__(self, resolution_m: float, most_N: float = math.inf) -> None:
        self._limits = resolution_m, most_N
        self._before: dict[int, Half | None] = {}
        self._ticks: list[int] = []

    def since(self, end: int) -> int:
        """Returns the tick of the last change before tick ``end``; 0 without one."""
        return max((tick for tick in self._ticks if tick < end), default=0)

    def note(self, history: History, events: Sequence[tuple[int, Event]]) -> None:
        """Records the changes among these events, and keeps what was before those that the history has reached."""
        returned = (refused_change(event) for _, event in events if "restored" in event)
        self._ticks = sorted(
            {tick for tick, event in events if is_change(event)} | {back.tick for back in returned if back}
        )
        for tick in self._ticks[-_MOST:]:
            if tick and tick not in self._before and history.end_tick >= tick:
                self._before[tick] = self._half(history, self.since(tick), tick)
        for tick in list(self._before)[:-_MOST]:
            del self._before[tick]

    def _half(self, history: History, since: int, end: int) -> Half | None:
        first = max(since, end - window_ticks(history.time.control_rate))
        seen = see(history, since, end, *self._limits)
        if seen is None or first < history.steps.full_from_tick:
            return None
        n, traces = history.time.steps_per_tick, history.steps.rows(("x", "force"), first, end)
        newest = history.steps.rows(("x", "force"), max(first, history.steps.end_tick - 1), history.steps.end_tick)
        if np.isnan(traces[:, -1]).any() and np.isfinite(newest).all():
            return None  # not received: what is no number stays so to the end
        whole = end - 1 - _whole_periods(end - 1 - first, seen.frequency_Hz, history.time.control_rate)
        return Half(seen, budget(history, whole, end), traces[:, ::n])

    def sight(self, history: History) -> Sight | None:
        """Returns what the newest ticks show since the last change; None before there are any."""
        end = last_tick(history)
        return see(history, self.since(end), end, *self._limits)

    def pair(self, history: History) -> tuple[int, Half | None, Half | None] | None:
        """Returns the tick of the last change, and its two sides, each None if it is not held; None without a change.

        The side after it is the newest half second, or less if less has passed.
        """
        end = last_tick(history)
        if not (tick := self.since(end)):
            return None
        return tick, self._before.get(tick), self._half(history, tick, end)


def _whole_periods(ticks: int, frequency_Hz: float | None, rate: int) -> int:
    """Returns the most ticks that hold whole periods of a swing; all of them without one, or of less than one period.

    Over a part of a period the energy that goes to and fro hides what is fed and taken on the whole.
    """
    periods = int(ticks / rate * (frequency_Hz or 0.0))
    return round(periods / frequency_Hz * rate) if periods and frequency_Hz else ticks


def last_tick(history: History) -> int:
    """Returns the tick before which plant and controller are known."""
    ends = [history.steps.end_tick, history.ticks.end_tick]
    return min([*ends, history.stop_tick] if history.stop_tick is not None else ends)
