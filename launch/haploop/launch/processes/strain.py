"""Strain on a machine, which may be why a process on it is silent: what the system reports about such a process."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

_STATES = {
    "T": " It is stopped, by a signal or a debugger.",
    "t": " It is stopped, by a signal or a debugger.",
    "D": " It is waiting for a disk or another device.",
}
_STARVED = " It was ready to run, but got almost no processor time."
_AT_WORK = " It was working the whole time."
_BUSY = " The machine was busy: load average {:.0f} on {} cores."
# Shares of the time for which a process had a processor: with less than the first it was kept waiting for one, with
# more than the second it was working.
_LITTLE, _MUCH = 0.1, 0.5
# In place of the pid of a process on another host.
NOBODY = -1


class Strain:
    """What silent processes were doing, as far as the system reports it, which it does where there is /proc.

    ``look`` takes a pid and returns the state of that process, a letter, and the processor time that it has used, s.
    """

    def __init__(self, look: Callable[[int], tuple[str, float]] | None = None) -> None:
        self._look = look or _state
        self._first: dict[int, tuple[float, float, float]] = {}

    def note(self, pid: int, heard: float, now: float) -> None:
        """Records that a process is silent at wall time ``now`` and was last heard from at ``heard``, s."""
        if self._first.get(pid, (0.0,))[0] != heard:
            self._first[pid] = heard, now, self._look(pid)[1]

    def told(self, pid: int, now: float) -> str:
        """Returns sentences on what may have kept a process noted before from answering; "" if there is nothing."""
        state, used_s = self._look(pid)
        _, since, used_then_s = self._first[pid]
        share = (used_s - used_then_s) / max(now - since, 1e-3)
        why = _STATES.get(state, "")
        if state == "R":
            why = _STARVED if share < _LITTLE else _AT_WORK if share > _MUCH else ""
        load, cores = os.getloadavg()[0], os.cpu_count() or 1
        return why + (_BUSY.format(load, cores) if load > 3 * cores else "")


def _state(pid: int) -> tuple[str, float]:
    """Returns the state of a process, a letter, and the processor time it has used, s; ("", 0) if unknown."""
    try:
        words = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace").rpartition(")")[2].split()
    except OSError:
        return "", 0.0
    return words[0], (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")
