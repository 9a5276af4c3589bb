"""Ctrl-C and SIGTERM while a run goes on: counted here, heeded by the run."""

from __future__ import annotations

import contextlib
import signal
from collections.abc import Iterator
from typing import Any


@contextlib.contextmanager
def interrupts(usual_from: int) -> Iterator[list[int]]:
    """Collect SIGINT and SIGTERM in a list.

    Args:
        usual_from: the signal of this number, counted from 1, and later ones raise KeyboardInterrupt where they come.
    """
    received: list[int] = []

    def note(number: int, _frame: Any) -> None:
        received.append(number)
        if len(received) >= usual_from:
            raise KeyboardInterrupt

    try:
        before = {number: signal.signal(number, note) for number in (signal.SIGINT, signal.SIGTERM)}
    except ValueError:  # not in the main thread: signals are somebody else's business
        yield received
        return
    try:
        yield received
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
