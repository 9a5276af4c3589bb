"""Answers of a run's clock: its status, the options that can be changed, and the replies to commands."""

from __future__ import annotations

import asyncio
from typing import Any

from haploop.view.receive.run_session import RunSession
from haploop.view.receive.runs import CommandFailed, Runs

# How often the clock is asked for its status.
_ASK_S = 0.5
# Kinds of events after which the options may be others.
_CHANGES = ("swap", "set", "refused")


class ClockAnswers:
    """Keeps the latest answers, asked for now and then beside the task that draws.

    Attributes:
        status: the answer to ``status``, {} before the first.
        options: the answer to ``options``, None before the first.
    """

    def __init__(self, runs: Runs) -> None:
        self._runs = runs
        self._ask_now = asyncio.Event()
        self.reset()

    def reset(self) -> None:
        """Forgets all answers, before another run is asked."""
        self.status: dict[str, Any] = {}
        self.options: dict[str, Any] | None = None
        self._changes = -1  # how many changes the options have seen

    async def keep_asking(self, session: RunSession) -> None:
        """Asks every 0.5 s and at once after a command, until it is cancelled."""
        while True:
            await self._ask(session)
            self._ask_now.clear()
            try:
                await asyncio.wait_for(self._ask_now.wait(), _ASK_S)
            except TimeoutError:
                continue

    async def _ask(self, session: RunSession) -> None:
        changes = sum(any(kind in event for kind in _CHANGES) for _, event in session.events)
        try:
            _, self.status = await asyncio.to_thread(self._runs.ask, session.run, "status", {})
            if changes != self._changes:
                _, self.options = await asyncio.to_thread(self._runs.ask, session.run, "options", {})
                self._changes = changes
        except CommandFailed:
            return  # it is about to end

    async def command(self, session: RunSession | None, verb: str, arguments: dict[str, Any]) -> str:
        """Sends a command to a run; returns its answer, a sentence.

        Raises:
            CommandFailed: the run refused it, is over, or there is none.
        """
        if session is None:
            raise CommandFailed("No run is live; start one with haploop run SCENE.")
        if session.outcome:
            raise CommandFailed(f"Run {session.run.id} is over; nothing about it can change any more.")
        text, _ = await asyncio.to_thread(self._runs.ask, session.run, verb, arguments)
        self._ask_now.set()
        return text
