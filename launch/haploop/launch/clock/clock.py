"""The one clock: how far every node may go, and at which tick a change takes effect. No sockets, no processes."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from haploop.launch.scene.check import resolve_event
from haploop.launch.scene.events import swapped_in, try_out
from haploop.protocol.changes import Event, at_work, changes_of
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element

# At a given pace, time is granted this far ahead of the wall clock.
AHEAD_S = 0.02
# Grants that the slowest lossless node has not worked through. Each may end in a block of its own, however short; with
# those of the window they must stay below what telemetry keeps for a subscriber.
MOST_GRANTS = 100


class ClockError(Exception):
    """A command that cannot be carried out; the message says why and what could be."""


class Clock:
    """Grants time to the nodes of one run.

    A tick may be worked on once it is granted; a change takes effect at a tick not yet granted, so every node knows
    of it in time. The grant is the least of: the end, the next pause, the target of a step, the pace, and the
    progress of the slowest lossless node plus the window; and no more than ``MOST_GRANTS`` lie ahead of that node.

    Attributes:
        pace: simulated seconds per wall second.
    """

    def __init__(
        self, scene: Scene, time: Timebase, kinds: Mapping[str, type[Element]], pace: float = math.inf
    ) -> None:
        self._scene = scene
        self._time, self._kinds = time, kinds
        self._window = scene.run.window_blocks * scene.run.block_ticks
        self.until = 0
        self.end = time.ticks
        self.paused = False
        self._step_target: int | None = None
        self.events: list[tuple[int, Event]] = []
        self._sent = 0
        for event in scene.event:
            self._insert(time.first_tick_at(event.at), event.as_dict())
        self._pauses = [tick for tick, event in self.events if event.get("pause")]
        self._pace_from: float | None = None  # the first grant starts the pace
        self._pace_tick = 0
        self._set_pace(pace)
        self._ahead: deque[int] = deque()

    def _set_pace(self, pace: float) -> None:
        self.pace = pace
        # Less than this is not worth a message.
        self._least_ticks = 0 if math.isinf(pace) else math.floor(pace * AHEAD_S / 4 * self._time.control_rate)

    def _pace_anew(self, now: float) -> None:
        """Counts the pace from wall time ``now`` (s) and the present tick on; time spent waiting is not made up for."""
        self._pace_from, self._pace_tick = now, self.until

    # Time

    def grant(self, slowest: int, now: float) -> int:
        """Returns the tick the nodes may go up to, given the slowest lossless node's tick and the wall time in s."""
        limit = min(self.end, slowest + self._window, self._paced(now))
        if self._pauses and not self.paused and self.until >= self._pauses[0]:
            del self._pauses[0]
            self.paused = True
        if self.paused:
            limit = min(limit, self.until if self._step_target is None else self._step_target)
        elif self._pauses:
            limit = min(limit, self._pauses[0])
        while self._ahead and self._ahead[0] <= slowest:
            self._ahead.popleft()
        if limit > self.until and len(self._ahead) < MOST_GRANTS:
            self.until = limit
            self._ahead.append(limit)
        return self.until

    def _paced(self, now: float) -> int:
        if math.isinf(self.pace):
            return self.end
        if self._pace_from is None:
            self._pace_from = now
        ahead = (now - self._pace_from) * self.pace + AHEAD_S * min(self.pace, 1.0)
        allowed = self._pace_tick + max(1, math.floor(ahead * self._time.control_rate))
        return allowed if allowed >= self.until + self._least_ticks else self.until

    def wait_s(self, now: float) -> float | None:
        """Returns the time in s until the pace lets time go on; None when the run waits for something else."""
        if math.isinf(self.pace) or self.paused or self.until >= self.end:
            return None
        return AHEAD_S / 4

    @property
    def is_last(self) -> bool:
        """True once nothing will be granted beyond ``until``."""
        return self.until >= self.end

    # Changes

    def take_events(self) -> list[tuple[int, Event]]:
        """Events up to ``until`` that have not been sent, in order; after a stop, what lies behind it never happens."""
        due = self._sent
        while due < len(self.events) and self.events[due][0] <= self.until:
            due += 1
        events, self._sent = self.events[self._sent : due], due
        return events

    def events_from(self, tick: int) -> list[tuple[int, Event]]:
        """Events from ``tick`` on that have been sent already, for a node that joins late."""
        return [(at, event) for at, event in self.events[: self._sent] if at >= tick]

    def _insert(self, tick: int, event: Event) -> None:
        index = len(self.events)
        while index and self.events[index - 1][0] > tick:
            index -= 1
        self.events.insert(index, (tick, event))
        if event.get("stop"):
            self.end = min(self.end, max(tick, self.until))

    def change(self, change: Event, at_s: float | None = None, **extra: Any) -> int:
        """Schedules a swap or a set; returns its tick.

        Args:
            change: ``{"swap": {...}, "element": i}`` or ``{"set": {...}}`` as in ``[[event]]``, not yet checked.
            at_s: when, in simulated seconds; at once when None.
            extra: what the event carries beside (a plugin to load).

        Raises:
            SceneError: the change does not fit the run; nothing happens.
            ElementError: the new element's own code does not take its parameters; nothing happens.
            ClockError: the time is past or after the end.
        """
        tick = self.until if at_s is None else self._time.first_tick_at(at_s)
        self._check_ahead(tick)
        event = resolve_event({**change, "at": tick / self._time.control_rate}, self._scene, self._kinds)
        try_out(swapped_in([event]), self._kinds)
        self._scene = replace(self._scene, event=(*self._scene.event, event))
        self._insert(tick, event.as_dict() | extra)
        return tick

    def _check_ahead(self, tick: int) -> None:
        rate = self._time.control_rate
        if tick < self.until:
            raise ClockError(
                f"Time {tick / rate:g} s is past; "
                f"the earliest tick that can still change is {self.until}, {self.until / rate:g} s."
            )
        if tick >= self.end:
            raise ClockError(
                f"The run ends at tick {self.end}, {self.end / rate:g} s; nothing can change from there on."
            )

    def note(self, event: Event) -> int:
        """Puts an event that changes no bit (pause, resume, a refusal) on record at the present tick; returns it."""
        self._insert(self.until, event)
        return self.until

    def pause(self) -> int:
        """Stops time at the first tick not yet granted; returns it."""
        self.paused, self._step_target = True, None
        return self.until

    def resume(self, now: float) -> int:
        """Lets time go on; returns the tick."""
        self.paused, self._step_target = False, None
        self._pauses = [tick for tick in self._pauses if tick > self.until]  # stepped over while standing still
        self._pace_anew(now)
        return self.until

    def step(self, ticks: int, now: float) -> int:
        """Lets time go on for some ticks; returns the tick at which it will stop."""
        self.paused = True
        self._step_target = min(self.end, max(self.until, self._step_target or 0) + ticks)
        self._pace_anew(now)
        return self._step_target

    def run_at(self, pace: float, now: float) -> int:
        """Sets another pace, simulated seconds per wall second, above 0, from ``now`` on; returns the tick."""
        if not pace > 0.0:
            raise ClockError(f"A pace is a number above 0, or free, but {pace:g} was asked for.")
        self._set_pace(pace)
        self._pace_anew(now)
        return self.until

    def present(self) -> Scene:
        """Returns the scene as it stands at the first tick not yet granted, all changes up to there made."""
        return at_work(self._scene, [change for change in changes_of(self.events) if change.tick <= self.until])

    def stop(self) -> int:
        """Ends the run at the first tick not yet granted; returns it."""
        self.end = min(self.end, self.until)
        self.paused = False
        return self.end

    def end_at(self, tick: int) -> None:
        """Ends the run where the plant has ended it by itself."""
        self.end = min(self.end, tick)
