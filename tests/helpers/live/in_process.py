"""Commands in this process, through their ``main``, with a time limit and all their output."""

from __future__ import annotations

import contextlib
import io
import signal
import sys
import traceback
from collections.abc import Iterator
from dataclasses import dataclass
from types import FrameType

from haploop.tools.cli.main import main


class Hung(BaseException):
    """A command took longer than allowed."""


@dataclass(frozen=True)
class Answer:
    """The answer to a command: its exit status and texts; ``fault`` is the traceback of one without a status."""

    status: int
    stdout: str
    stderr: str
    fault: str

    def broken(self) -> str:
        """Returns what is wrong with an answer, whatever was asked; "" for a valid one."""
        if self.fault:
            return self.fault
        if "Traceback" in self.stderr:
            return self.stderr
        if self.status not in (0, 1, 2):
            return f"exit status {self.status}"
        said = (self.stderr + self.stdout).strip()
        return "it failed without a word" if self.status and not said else ""


# Wall time over the limit of computing time, beyond which a command hangs even if the machine is busy.
_WAITING = 10.0


@contextlib.contextmanager
def at_most(seconds: float) -> Iterator[None]:
    """Raises Hung after some seconds of computing, or ten times as long of wall time."""

    def end(_number: int, _frame: FrameType | None) -> None:
        raise Hung

    clocks = {signal.SIGPROF: (signal.ITIMER_PROF, 1.0), signal.SIGALRM: (signal.ITIMER_REAL, _WAITING)}
    before = {number: signal.signal(number, end) for number in clocks}
    try:
        for clock, factor in clocks.values():
            signal.setitimer(clock, factor * seconds)
        yield
    finally:
        for number, (clock, _) in clocks.items():
            signal.setitimer(clock, 0)
            signal.signal(number, before[number])


def ask(*words: str, seconds: float = 300.0) -> Answer:
    """Runs ``haploop WORDS`` to its end."""
    streams = io.BytesIO(), io.BytesIO()
    stdout, stderr = (io.TextIOWrapper(raw, "utf-8", write_through=True) for raw in streams)
    stderr.reconfigure(errors="backslashreplace")
    before, sys.argv = sys.argv, ["haploop", *words]
    status, fault = 0, ""
    try:
        with contextlib.redirect_stdout(stdout), contextlib.redirect_stderr(stderr), at_most(seconds):
            main()
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else 0 if end.code is None else 1
        if isinstance(end.code, str):
            stderr.write(end.code)
    except Hung:
        fault = f"hung for {seconds:g} s: " + traceback.format_exc(limit=-3)
    except BaseException:
        fault = traceback.format_exc()
    finally:
        sys.argv = before
    said, complained = (bytes(raw.getvalue()).decode(errors="replace") for raw in streams)
    return Answer(status, said, complained, fault)
