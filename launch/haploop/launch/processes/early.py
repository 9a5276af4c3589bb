"""Start of a run's processes, possibly before the run is known: they load in parallel with the launcher until told.

The module itself is light to import.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Mapping, MutableMapping, Sequence
from typing import NamedTuple

from haploop.launch.one_thread import ask_for_one_thread
from haploop.launch.processes.open_files import ask_for_many
from haploop.protocol.transport.messages import PROCESSES

# A word that begins with one of these asks for no such processes, or for others as well.
_OTHERS = ("--in-process", "--help", "--node", "--external", "--clock")


class Started(NamedTuple):
    """A process that has been started and ends at the end of its stdin.

    Attributes:
        died: a file descriptor that becomes readable, without polling, when it has ended.
    """

    process: subprocess.Popen[bytes]
    died: int

    def end(self) -> None:
        """Ends the process at once, and reaps it."""
        if self.process.stdin:
            self.process.stdin.close()
        self.process.kill()
        self.process.wait()
        os.close(self.died)


def start_process(words: Sequence[str], environment: Mapping[str, str], prints: int | None, group: int) -> Started:
    """Starts a process in a process group, 0 for a new group of its own.

    Args:
        prints: where its output goes; None for the launcher's stderr, or nowhere if that is closed.

    Raises OSError if it cannot be started.
    """
    # Where the kernel has no process descriptors: a pipe that is open as long as the process lives.
    died, alive = (-1, -1) if _has_pidfd() else os.pipe()
    try:
        process = subprocess.Popen(
            words,
            stdin=subprocess.PIPE,
            stdout=_terminal() if prints is None else prints,
            stderr=prints,
            pass_fds=() if alive < 0 else (alive,),
            # A group of its own, since Ctrl-C is for the launcher, which ends the run in order; but the same
            # session: the kernel schedules sessions as groups, and two preempt each other at every message.
            process_group=group,
            env=environment,
        )
    except OSError:
        if died >= 0:
            os.close(died)
        raise
    finally:
        if alive >= 0:
            os.close(alive)
    return Started(process, os.pidfd_open(process.pid) if died < 0 else died)


def start_node(role: str) -> Started:
    """Starts the run's own process of a role; raises OSError if it cannot be started."""
    environment = {**os.environ}
    ask_for_one_thread(environment)
    return start_process((sys.executable, "-m", PROCESSES[role].module), environment, None, 0)


def start_early(words: Sequence[str], early: MutableMapping[str, Started]) -> None:
    """Starts the processes of the run that a command line asks for, by role; none if it may need others."""
    if any(word.startswith(_OTHERS) for word in words):
        return
    ask_for_many()
    for role in PROCESSES:
        try:
            early[role] = start_node(role)
        except OSError:  # reported when it is started again
            return


def _has_pidfd() -> bool:
    """Tells whether a process can be watched by a descriptor of its own (Linux 5.3)."""
    try:
        os.close(os.pidfd_open(os.getpid()))
    except (AttributeError, OSError):
        return False
    return True


def _terminal() -> int:
    """Returns the launcher's stderr, or nowhere if that is closed."""
    try:
        os.fstat(2)
    except OSError:
        return subprocess.DEVNULL
    return 2
