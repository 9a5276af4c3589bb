"""What the clock of a run answers: who waits for whom, what can be chosen, and what came of a command."""

from __future__ import annotations

import asyncio
from typing import Any

from haploop.view.receive.run_session import Followed
from haploop.view.receive.runs import CommandFailed, Runs

# How often the clock is asked for its status.
_ASK_S = 0.5
# Whatever changes what can be chosen.
_CHANGES = ("swap", "set", "refused")


class ClockAnswers:
    """The latest answers, kept up by asking now and then, aside of the loop that draws.

    Attributes:
        status: the answer to ``status``, {} before the first.
        options: the answer to ``options``, None before the first.
    """

    def __init__(self, runs: Runs) -> None:
        self._runs = runs
        self._ask_now = asyncio.Event()
        self.forget()

    def forget(self) -> None:
        """Another run is to be asked."""
        self.status: dict[str, Any] = {}
        self.options: dict[str, Any] | None = None
        self._changes = -1  # how many changes the options have seen

    async def keep_asking(self, followed: Followed) -> None:
        """Ask for good, at once after a command; to be cancelled."""
        while True:
            await self._ask(followed)
            self._ask_now.clear()
            try:
                await asyncio.wait_for(self._ask_now.wait(), _ASK_S)
            except TimeoutError:
                continue

    async def _ask(self, followed: Followed) -> None:
        changes = sum(any(kind in event for kind in _CHANGES) for _, event in followed.events)
        try:
            _, self.status = await asyncio.to_thread(self._runs.ask, followed.run, "status", {})
            if changes != self._changes:
                _, self.options = await asyncio.to_thread(self._runs.ask, followed.run, "options", {})
                self._changes = changes
        except CommandFailed:
            return  # it is about to end

    async def command(self, followed: Followed | None, verb: str, arguments: dict[str, Any]) -> str:
        """Have a run do something; returns its answer.

        Raises:
            CommandFailed: it did not.
        """
        if followed is None:
            raise CommandFailed("No run is live; start one with haploop run SCENE.")
        if followed.over:
            raise CommandFailed(f"Run {followed.run.id} is over; nothing about it can change any more.")
        text, _ = await asyncio.to_thread(self._runs.ask, followed.run, verb, arguments)
        self._ask_now.set()
        return text
