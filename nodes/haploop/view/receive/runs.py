"""What a viewer needs of the place it runs in: live runs to follow, and a way to steer them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

from haploop.protocol.transport import SecureContext


class CommandFailed(Exception):
    """A run did not do what was asked; the message says why, for people."""


class Run(Protocol):
    """A live run as other processes find it."""

    @property
    def id(self) -> str:
        """Its name among live runs."""
        ...

    @property
    def clock(self) -> str:
        """The clock's address."""
        ...

    @property
    def title(self) -> str: ...

    @property
    def out(self) -> str:
        """Its directory."""
        ...

    def make_context(self) -> SecureContext:
        """A context whose sockets may connect to it."""
        ...


class Runs(Protocol):
    """All runs of this user."""

    def live(self) -> Sequence[Run]:
        """Those that live now, the oldest first."""
        ...

    def ask(self, run: Any, verb: str, arguments: dict[str, Any]) -> tuple[str, dict[str, Any]]:
        """Have a run carry out a command; returns its answer, a sentence and data.

        Raises:
            CommandFailed: it refused, or does not answer.
        """
        ...
