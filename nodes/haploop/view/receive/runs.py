"""Interfaces through which a viewer finds and steers live runs; implemented by whoever starts it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

from haploop.protocol.transport import SecureContext


class CommandFailed(Exception):
    """Raised where a run did not carry out a command; the message says why, for people."""


class Run(Protocol):
    """A live run as other processes find it."""

    @property
    def id(self) -> str:
        """Identifier among live runs."""
        ...

    @property
    def clock(self) -> str:
        """Address of the clock."""
        ...

    @property
    def title(self) -> str:
        """Title of the scene."""
        ...

    @property
    def out(self) -> str:
        """Directory of the run's log and summary."""
        ...

    def make_context(self) -> SecureContext:
        """Makes a context whose sockets may connect to the run."""
        ...


class Runs(Protocol):
    """All runs of this user."""

    def live(self) -> Sequence[Run]:
        """Returns the runs that live now, the oldest first."""
        ...

    def ask(self, run: Any, verb: str, arguments: dict[str, Any]) -> tuple[str, dict[str, Any]]:
        """Sends a command to a run; returns its answer, a sentence and data.

        Raises:
            CommandFailed: the run refused, or does not answer.
        """
        ...
