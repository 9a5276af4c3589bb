"""Ctrl-C and SIGTERM while modules are imported: the program leaves at once, with a sentence. Itself it is light."""

from __future__ import annotations

import os
import signal

SENTENCE = "Interrupted before anything began."


def _leave(*_: object) -> None:
    os.write(2, f"{SENTENCE}\n".encode())
    os._exit(1)


class LeavingAtOnce:
    """Has the two signals end the program while nothing is begun yet; a context manager, for the main thread.

    An exception raised by a signal within an import may be lost, or be shown with Python's own words.
    """

    def __enter__(self) -> None:
        self._before = {}
        for number in (signal.SIGINT, signal.SIGTERM):
            try:
                self._before[number] = signal.signal(number, _leave)
            except ValueError:  # in another thread signals are somebody else's business
                return

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)
