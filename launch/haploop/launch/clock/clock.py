"""The one clock: how far every node may go, and at which tick a change takes effect. No sockets, no processes."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from haploop.launch.clock.pace import Pace
from haploop.launch.scene.check import resolve_event
from haploop.launch.scene.events import swapped_in, try_out
from haploop.launch.scene.mistakes import SceneError
from haploop.protocol.changes import Event, at_work, changes_of
from haploop.protocol.scene.scene import EventTable, Scene
from haploop.protocol.ticks import HELD_S, Timebase

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element

# The most grants, ``HELD_S`` apart, that the slowest lossless node has not worked through. Each may end in blocks of
# its own, however short; with those of the window they must stay below what telemetry keeps for a subscriber.
MOST_GRANTS = 70
# The most changes that may wait for their tick at a time: each new one is checked against all of them.
MOST_CHANGES = 100
# The longest that a run can last, s of simulated time.
LATEST_S = 1e9


class ClockError(Exception):
    """A command that cannot be carried out; the message says why, and what would be possible."""


class Clock:
    """Grants time to the nodes of one run.

    A tick may be worked on once it is granted; a change takes effect at a tick not yet granted, so every node learns
    of it in time. The grant is the least of: the end, the next pause, the target of a step, the pace, and the
    progress of the slowest lossless node plus the window. No more than ``MOST_GRANTS`` grants lie ahead of that node.

    ``in_leaps``: each grant covers at least a quarter of the window, for a plant that owns the time: many small grants
    would reach ``MOST_GRANTS`` long before they reach the window, and a device cannot wait.

    Attributes:
        newest: the event of the last requested change; {} if there was none.
    """

    def __init__(
        self,
        scene: Scene,
        time: Timebase,
        kinds: Mapping[str, type[Element]],
        pace: float = math.inf,
        in_leaps: bool = False,
    ) -> None:
        self._scene = scene
        self._time, self._kinds = time, kinds
        self._window = time.window_ticks(scene.run)
        self._leap = self._window // 4 if in_leaps else 1
        self.until = 0
        self.end = time.ticks
        self.paused = False
        self._step_target: int | None = None
        self.events: list[tuple[int, Event]] = []
        self._sent = self._settled = 0
        self.newest: Event = {}
        for event in scene.event:
            self._insert(time.first_tick_at(event.at), event.as_dict())
        self._most_changes = len(scene.event) + MOST_CHANGES
        self._pauses = [tick for tick, event in self.events if event.get("pause")]
        self.pace = Pace(time.control_rate, pace)
        self._held = True
        self._ahead: deque[int] = deque()
        self._ahead_from = 0.0

    # Time

    def grant(self, slowest: int, now: float, plant: int | None = None) -> int:
        """Returns the tick the nodes may go up to.

        Args:
            slowest: tick of the slowest lossless node.
            now: wall time, s.
            plant: tick of the plant; a pace grants no more beyond it than is made up for at once; None for any.
        """
        limit = min(self.end, slowest + self._window)
        if self._pauses and not self.paused and self.until >= self._pauses[0]:
            del self._pauses[0]
            self.paused = True
        if self.paused:
            limit = min(limit, self.until if self._step_target is None else self._step_target)
        elif self._pauses:
            limit = min(limit, self._pauses[0])
        while self._ahead and self._ahead[0] <= slowest:
            self._ahead.popleft()
        is_paced = not math.isinf(self.pace.rate)
        if is_paced and plant is not None:
            limit = min(limit, plant + self.pace.most_at_once)
        is_leap = limit >= min(self.end, self.until + self._leap)
        self._held = limit <= self.until or not is_leap or len(self._ahead) >= MOST_GRANTS
        if not self._held and is_paced:
            limit = self.pace.grant(self.until, limit, now)
        if limit > self.until and not self._held:
            self.until = limit
            if self._ahead and now - self._ahead_from < HELD_S:
                self._ahead[-1] = limit
            else:
                self._ahead.append(limit)
                self._ahead_from = now
        return self.until

    def wait_s(self, now: float) -> float | None:
        """Returns the time in s until the pace lets time continue; None if the run waits for something else."""
        return None if self._held or math.isinf(self.pace.rate) else self.pace.wait_s(self.until, now)

    @property
    def is_last(self) -> bool:
        """True once nothing will be granted beyond ``until``."""
        return self.until >= self.end

    # Changes

    def take_events(self) -> list[tuple[int, Event]]:
        """Returns the events up to ``until`` that have not been sent, in order; events after a stop never happen."""
        due = self._sent
        while due < len(self.events) and self.events[due][0] <= self.until:
            due += 1
        events, self._sent = self.events[self._sent : due], due
        return events

    def events_from(self, tick: int) -> list[tuple[int, Event]]:
        """Returns the events from ``tick`` on that have already been sent, for a node that joins late."""
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
            at_s: time of the change in simulated seconds; None for at once.
            extra: what else the event carries (a plugin to load).

        Raises:
            SceneError: the change does not fit the run; nothing happens.
            ElementError: the new element's own code does not take its parameters; nothing happens.
            ClockError: the time is past or after the end.
        """
        tick, event = self.resolved(change, at_s, self._kinds)
        try_out(swapped_in([event]), self._kinds)
        self._scene = replace(self._scene, event=(*self._scene.event, event))
        self.newest = event.as_dict() | extra
        self._insert(tick, self.newest)
        return tick

    def withdraw(self, asked: Event) -> bool:
        """Takes back an event that was once ``newest`` as if never asked for; False if nodes already know of it."""
        place = next((i for i in range(self._sent, len(self.events)) if self.events[i][1] is asked), None)
        if place is None:
            return False
        del self.events[place]
        waiting = list(self._scene.event)
        waiting.remove(next(event for event in reversed(waiting) if event.as_dict().items() <= asked.items()))
        self._scene = replace(self._scene, event=tuple(waiting))
        return True

    def resolved(self, change: Event, at_s: float | None, kinds: Mapping[str, type[Element]]) -> tuple[int, EventTable]:
        """Returns the tick of a change and the change itself, checked with these kinds; raises as ``change`` does."""
        tick = self.tick_at(at_s)
        self._check_ahead(tick)
        if len(self._scene.event) >= self._most_changes:
            raise ClockError(
                f"{MOST_CHANGES} changes are already waiting for their tick; let time continue, then ask again."
            )
        return tick, resolve_event({**change, "at": tick / self._time.control_rate}, self._scene, kinds)

    def prepare(self) -> None:
        """Does the one-time work of checking a change, and of a mistake in one, while nobody waits for it."""
        with suppress(SceneError):
            resolve_event({"swap": {"kind": ""}, "at": 0.0}, self._scene, self._kinds)

    def tick_at(self, at_s: float | None) -> int:
        """Returns the first tick at or after a time in s, the next for None; raises ClockError for an invalid time."""
        if at_s is None:
            return self.until
        if isinstance(at_s, bool) or not isinstance(at_s, int | float) or not 0.0 <= at_s <= LATEST_S:
            given = repr(at_s)[:40]
            raise ClockError(
                f"A change is made at a time from 0 to {LATEST_S:g} s, or at once, but {given} was asked for."
            )
        return self._time.first_tick_at(at_s)

    def _check_ahead(self, tick: int) -> None:
        rate = self._time.control_rate
        if tick < self.until:
            raise ClockError(
                f"Time {tick / rate:g} s is past; "
                f"the earliest tick that can still change is {self.until}, {self.until / rate:g} s."
            )
        if tick >= self.end:
            raise ClockError(
                f"The run ends at tick {self.end}, {self.end / rate:g} s; nothing can change from then on."
            )

    def note(self, event: Event) -> int:
        """Records an event that changes no bit (pause, resume, a refusal) at the present tick; returns that tick."""
        self._insert(self.until, event)
        return self.until

    def pause(self) -> int:
        """Stops time at the first tick not yet granted; returns that tick."""
        self.paused, self._step_target = True, None
        return self.until

    def resume(self) -> int:
        """Lets time continue; returns the tick."""
        self.paused, self._step_target = False, None
        self._pauses = [tick for tick in self._pauses if tick > self.until]  # others were stepped over in a pause
        self.pace.anew()
        return self.until

    def step(self, ticks: int) -> int:
        """Lets time continue for some ticks; returns the tick at which it will stop."""
        self.paused = True
        self._step_target = min(self.end, max(self.until, self._step_target or 0) + ticks)
        self.pace.anew()
        return self._step_target

    def run_at(self, pace: float) -> int:
        """Sets another pace, simulated seconds per wall second or infinite, from now on; returns the tick."""
        self.pace.set(pace)
        return self.until

    def scene_at(self, tick: int) -> Scene:
        """Returns the scene at a tick, with all changes up to there made."""
        unsettled = changes_of(self.events[self._settled :])
        return at_work(self._scene, [change for change in unsettled if change.tick <= tick])

    def settle(self, tick: int) -> None:
        """Takes the changes before ``tick`` as made: every refusal among them is on record."""
        end = self._settled
        while end < len(self.events) and self.events[end][0] < tick:
            end += 1
        if end > self._settled:
            changes = changes_of(self.events[self._settled :])
            made = [
                change for change in changes if (change.tick if change.on_record is None else change.on_record) < tick
            ]
            waiting = tuple(event for event in self._scene.event if self._time.first_tick_at(event.at) >= tick)
            self._scene, self._settled = replace(at_work(self._scene, made), event=waiting), end

    def present(self) -> Scene:
        """Returns the scene at the first tick not yet granted."""
        return self.scene_at(self.until)

    def stop(self) -> int:
        """Ends the run at the first tick not yet granted; returns the tick of its end."""
        self.end = min(self.end, self.until)
        self.paused = False
        return self.end

    def end_at(self, tick: int) -> None:
        """Ends the run at the tick at which the plant itself ended it."""
        self.end = min(self.end, tick)
