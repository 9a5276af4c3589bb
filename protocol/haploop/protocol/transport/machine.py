"""The machine that a node runs on: wall clock, waiting on several sockets, and files.

It comes with the context of the sockets, so that a simulation can replace everything that a node meets of the world.
"""

from __future__ import annotations

import select
import time
from io import RawIOBase
from pathlib import Path
from typing import Any, cast

import zmq


class Machine:
    """The machine of this process.

    Attributes:
        now: returns the wall clock, s, which never goes backwards.
    """

    now = staticmethod(time.monotonic)

    def poller(self) -> zmq.Poller:
        return zmq.Poller()

    def wait(self, poller: zmq.Poller, seconds: float) -> dict[Any, int]:
        """Waits at most ``seconds``, to a tenth of a ms although a poller counts whole ms; returns what is ready."""
        ready = poller.poll(int(seconds * 1000))
        if not ready and seconds < 0.001:
            try:
                select.select([what for what, _ in poller.sockets], [], [], seconds)
            except ValueError:  # a process with more than 1024 files open
                time.sleep(seconds)
            ready = poller.poll(0)
        return dict(ready)

    def create(self, path: Path) -> RawIOBase:
        """Opens a new file for writing, replacing any of that name; each write goes to the operating system at once."""
        return cast(RawIOBase, path.open("wb", buffering=0))

    def write(self, path: Path, data: bytes) -> None:
        path.write_bytes(data)

    def rename(self, path: Path, target: Path) -> None:
        path.replace(target)


MACHINE = Machine()


def machine_of(context: Any) -> Machine:
    """Returns the machine of a context: this process's own, unless the context brings another."""
    return getattr(context, "machine", MACHINE)
