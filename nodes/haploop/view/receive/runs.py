"""Live runs: the interfaces through which a viewer finds and steers them, and what their clock answers."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from haploop.logger.summary import finite
from haploop.protocol.changes import Event, at_work, changes_of
from haploop.protocol.scene.scene import Scene
from haploop.protocol.transport.sockets import SecureContext
from haploop.protocol.transport.wire import Message

# How often the clock is asked for its status.
_ASK_S = 0.5
# Kinds of events after which the options may have changed.
_CHANGES = ("swap", "set", "refused", "restored")


class CommandFailed(Exception):
    """Raised where a run did not carry out a command; the message tells people why."""


class Run(Protocol):
    """A live run as other processes find it.

    Attributes:
        id, title: identifier among live runs; title of its scene.
        clock: address of the clock.
        is_here: whether its files are on this machine.
    """

    @property
    def id(self) -> str: ...
    @property
    def title(self) -> str: ...
    @property
    def clock(self) -> str: ...
    @property
    def is_here(self) -> bool: ...

    def make_context(self) -> SecureContext:
        """Makes a context whose sockets may connect to the run; it is not called for a run that is over."""
        ...


class PastRun(Run, Protocol):
    """A recorded run that is over; ``out`` is its folder, ``told`` its result and time, in a few words."""

    @property
    def out(self) -> Path: ...
    @property
    def told(self) -> str: ...

    def scene(self) -> Scene:
        """Reads its resolved scene; raises OSError or LogError where there is none."""
        ...

    def units(self, scene: Scene, keys: Iterable[str]) -> Mapping[str, str]:
        """Returns the units of these keys of a scene, and by kind and parameter (``damping.damping``)."""
        ...


class Runs(Protocol):
    """All runs of this user; implemented by the program that starts a viewer."""

    def live(self) -> Sequence[Run]:
        """Returns the runs that are live now, the oldest first."""
        ...

    def past(self) -> Sequence[PastRun]:
        """Returns recorded runs that may be opened, the newest first."""
        ...

    def record_of(self, run: Any) -> PastRun | None:
        """Returns the record of a run that was live; None where it left none that can be read here."""
        ...

    def stiffness_limit(self, scene: Scene) -> float | str | None:
        """Returns the largest wall stiffness at which a loop is stable by its linear map, N/m, or why none is known."""
        ...

    def has_launcher(self, run: Any) -> bool:
        """Returns whether the launcher of a run is there; it judges the run after the processes have ended."""
        ...

    def ask(self, run: Any, verb: str, arguments: Message) -> tuple[str, Message]:
        """Sends a command to a run; returns its answer, a sentence and data, or raises CommandFailed."""
        ...


def is_live(runs: Runs, run: Run) -> bool:
    """Returns whether a run is among the live ones."""
    return run.id in [live.id for live in runs.live()]


class ClockAnswers:
    """Keeps the latest answers of a run's clock, which is asked now and then in parallel to the task that draws.

    Attributes:
        status: the answer to ``status``, {} before the first.
        options: what can be changed, fit for JSON; None before the first answer.
        limit: the largest stiffness that its wall may have in the loop as it is, N/m, or why none is known.
    """

    def __init__(self, runs: Runs, run: Run, events: Sequence[tuple[int, Event]], scene: Scene) -> None:
        self._runs, self._run, self._events, self._scene = runs, run, events, scene
        self.limit: float | str | None = None
        self._ask_now = asyncio.Event()
        self.status: Message = {}
        self.options: Message | None = None

    async def _ask(self, verb: str, arguments: Message) -> tuple[str, Message]:
        return await asyncio.to_thread(self._runs.ask, self._run, verb, arguments)

    async def keep_asking(self) -> None:
        """Asks every 0.5 s and at once after a command, until it is cancelled."""
        seen = -1
        while True:
            changes = sum(any(kind in event for kind in _CHANGES) for _, event in self._events)
            with contextlib.suppress(CommandFailed):  # the run is about to end
                _, self.status = await self._ask("status", {})
                if changes != seen:
                    self.options = finite((await self._ask("options", {}))[1])
                    seen = changes
                    now = at_work(self._scene, changes_of(self._events))
                    self.limit = await asyncio.to_thread(self._runs.stiffness_limit, now)
            self._ask_now.clear()
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._ask_now.wait(), _ASK_S)

    @property
    def units(self) -> Mapping[str, str]:
        """Returns the units of settable keys, and by kind and parameter; {} before the options are known."""
        kinds, keys = (self.options.get(name, {}) if self.options else {} for name in ("kinds", "settable"))
        units = {
            f"{kind}.{name}": p["unit"] for kind, about in kinds.items() for name, p in about["parameters"].items()
        }
        return units | {key: about["unit"] for key, about in keys.items()}

    async def command(self, verb: str, arguments: Message) -> str:
        """Sends a command to the run; returns its answer, a sentence, or raises CommandFailed."""
        text, _ = await self._ask(verb, arguments)
        self._ask_now.set()
        return text
