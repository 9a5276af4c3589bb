"""Follows one run after another: waits for one, hears it to its end, keeps it on show until the next one starts."""

from __future__ import annotations

import asyncio
import time as wall_clock
from typing import Any

from haploop.logger.log.error import LogError
from haploop.protocol.clock_client import Aborted, Refused
from haploop.view.draw.state import WAITING, state
from haploop.view.receive.backfill import Past
from haploop.view.receive.clock_answers import ClockAnswers
from haploop.view.receive.event_lines import event_lines
from haploop.view.receive.run_session import Followed
from haploop.view.receive.runs import Run, Runs

# Turns a second: so often is telemetry taken in and shown.
TURNS_HZ = 31.5
# How often a run is looked for; and a turn while there is nothing but what pages watch to change.
_LOOK_S, _IDLE_TURN_S = 0.2, 0.05
# So often a summary is looked for that a failed run may still be writing.
_LOOKS = 10
# The log is written at least so often; what was heard before that has been written then.
_LOGGED_S = 0.6


class Viewer:
    """What all pages look at.

    Args:
        runs: where runs are found and asked.
        first: id of the run to follow first; the newest there is when None.
        from_start: whether what was logged before joining is shown as well.

    Attributes:
        followed: the run on show; None before the first.
    """

    def __init__(self, runs: Runs, first: str | None, from_start: bool) -> None:
        self._runs, self._first, self._from_start = runs, first, from_start
        self._clock = ClockAnswers(runs)
        self._known: set[str] = set()
        self._turned = asyncio.Event()
        self.followed: Followed | None = None

    async def next_turn(self) -> None:
        """Wait until what there is to show may have changed."""
        await self._turned.wait()

    def _turn_is_over(self) -> None:
        turned, self._turned = self._turned, asyncio.Event()
        turned.set()

    # Following

    async def follow(self) -> None:
        """Follow runs for good; to be cancelled."""
        while True:
            followed = await self._join(await self._next_run())
            if followed is None:
                continue
            self.followed = followed
            self._clock.forget()
            tasks = [asyncio.create_task(self._clock.keep_asking(followed))]
            if self._from_start:
                tasks.append(asyncio.create_task(self._recall(followed)))
            try:
                await self._hear(followed)
            finally:
                for task in tasks:
                    task.cancel()
                await asyncio.to_thread(followed.close)
            await self._look_back(followed)

    async def _next_run(self) -> Run:
        """The run asked for first, or the newest of those that were not there when the last one was chosen."""
        while True:
            live = self._runs.live()
            fresh = [run for run in live if run.id not in self._known]
            asked_for = [run for run in fresh if self._first and run.id.startswith(self._first)]
            if fresh:
                self._known, self._first = {run.id for run in live}, None
                return [*fresh, *asked_for][-1]
            await self._idle(_LOOK_S)

    async def _idle(self, seconds: float) -> None:
        """Let pages turn while nothing comes: one may have changed what it watches."""
        until = wall_clock.monotonic() + seconds
        while wall_clock.monotonic() < until:
            self._turn_is_over()
            await asyncio.sleep(_IDLE_TURN_S)

    async def _join(self, run: Run) -> Followed | None:
        """Join a run as soon as it has begun; None if it is gone by then."""
        while run.id in [live.id for live in self._runs.live()]:
            try:
                return await asyncio.to_thread(Followed, run)
            except (Refused, Aborted):
                await self._idle(_LOOK_S)
        return None

    async def _hear(self, followed: Followed) -> None:
        """Turn after turn until the run is over."""
        due = gone_due = wall_clock.monotonic()
        while not followed.over:
            followed.poll()
            self._turn_is_over()
            now = wall_clock.monotonic()
            if now >= gone_due:
                gone_due = now + 1.0
                if followed.run.id not in [run.id for run in self._runs.live()]:
                    self._vanished(followed)
            due = max(due + 1.0 / TURNS_HZ, now)
            await asyncio.sleep(due - now)
        self._turn_is_over()

    @staticmethod
    def _vanished(followed: Followed) -> None:
        """The launcher has gone: in order, with its last words still to be heard or lost, or killed."""
        followed.poll()
        if not followed.over:
            followed.end("ended", "")
            if followed.summary is None:
                followed.end("failed", f"The launcher of run {followed.run.id} has ended without a word.")

    async def _look_back(self, followed: Followed) -> None:
        """What can be known of a run only when it is over: its summary, and whatever was not heard."""
        for _ in range(_LOOKS):
            if followed.summary:
                break
            await self._idle(_LOOK_S)
            followed.read_summary()
        if self._from_start and not followed.is_complete:
            await self._recall(followed)

    async def _recall(self, followed: Followed) -> None:
        """Put what was logged before joining in front of what was heard."""
        past = Past(followed.out, followed.scene, followed.time, followed.events)
        while True:
            over = bool(followed.over)
            if not over:
                await asyncio.sleep(_LOGGED_S)
            try:
                await asyncio.to_thread(past.read)
            except (OSError, LogError):
                return  # no log, or none that this process may read: what is heard is all there is
            if over or past.meets(followed.history):
                followed.recall(past.history)
                return

    async def command(self, verb: str, arguments: dict[str, Any]) -> str:
        """Have the run on show do something; returns its answer.

        Raises:
            CommandFailed: it did not.
        """
        return await self._clock.command(self.followed, verb, arguments)

    # Telling

    def state(self) -> dict[str, Any]:
        """The state message for pages."""
        return state(self.followed, self._clock.status, self._clock.options) if self.followed else WAITING

    def events(self) -> dict[str, Any]:
        """The events message for pages."""
        followed = self.followed
        lines = event_lines(followed.events, followed.time.control_rate, self._clock.options) if followed else []
        return {"type": "events", "events": lines}

    @property
    def signs_of_state(self) -> tuple[object, ...]:
        """Something else whenever the state is news."""
        followed, status = self.followed, self._clock.status
        if followed is None:
            return (None,)
        at_work = (list(followed.history.elements), dict(followed.history.wall), followed.delay_s)
        return (followed, followed.over, followed.summary is None, status.get("paused"), status.get("pace"), at_work)

    @property
    def signs_of_events(self) -> tuple[object, ...]:
        """Something else whenever the events are news."""
        return (self.followed, len(self.followed.events) if self.followed else 0, self._clock.options is None)
