"""Ctrl-C and SIGTERM while modules are imported: the program exits at once, with a sentence. Imports little itself."""

from __future__ import annotations

import os
import signal
from collections.abc import Mapping

TYPE_CHECKING = False  # stands for that of typing, which takes longer to load than all else here
if TYPE_CHECKING:
    from haploop.launch.processes.early import Started

SENTENCE = "Interrupted before anything began."
_AT_ONCE = "Interrupted at once."
SIGNALS = signal.SIGINT, signal.SIGTERM


class LeavingAtOnce:
    """Makes the two signals end the program while nothing has begun yet; a context manager, for the main thread.

    An exception raised by a signal within an import may be lost, or be shown with Python's own words.

    Args:
        processes: processes that are ended with the program.
    """

    def __init__(self, processes: Mapping[str, Started] | None = None) -> None:
        self._processes = {} if processes is None else processes

    def _leave(self, *_: object, sentence: str = SENTENCE) -> None:
        os.write(2, f"{sentence}\n".encode())
        for started in self._processes.values():
            started.process.kill()
        os._exit(1)

    def __enter__(self) -> None:
        self._before = {}
        for number in SIGNALS:
            try:
                self._before[number] = signal.signal(number, self._leave)
            except ValueError:  # only the main thread may handle signals
                return

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def from_the_second_on(self) -> None:
        """Makes the first of the two signals raise KeyboardInterrupt from now on, and the next end the program.

        A second signal while the first is dealt with would show a traceback, or Python's own exit status.
        """

        def leave(*_: object) -> None:
            self._leave(sentence=_AT_ONCE)

        heeded = [number for number, handler in self._before.items() if handler != signal.SIG_IGN]

        def interrupt(*_: object) -> None:
            for number in heeded:
                signal.signal(number, leave)
            raise KeyboardInterrupt

        for number in heeded:
            signal.signal(number, interrupt)
