"""Burdens that no clock shows, since work takes no virtual time: calls made for a command, entries that are held."""

from __future__ import annotations

import sys
from collections import deque
from collections.abc import Iterable
from types import CellType, FrameType, FunctionType, MethodType, ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from simulation.computer.world import Process

# Calls that one command may take, some 60 ms of work; a change after 99 that wait takes 152 000, 36 ms.
MOST_CALLS = 250_000
# Between looks at what processes hold, and at how many looks at least growth can be told, s of virtual time.
LOOK_S, LEAST_LOOKS = 1.0, 10
# What may be held more of in the last fifth of the looks than in the second, and more for each event in between: after
# a swap the log has a channel more.
_SLACK, _AN_EVENT = 80, 250
_NOT_FOLLOWED = (str, bytes, bytearray, int, float, complex, type, ModuleType, np.ndarray, np.generic, type(None))
_EMPTY = CellType()
_OF_THE_SIMULATOR = ("simulation.", "random", "greenlet", "_pytest", "helpers.")


class Work:
    """Counts the calls, of Python and C, that a process makes between two of its looks at the network."""

    def __init__(self) -> None:
        self.calls = 0
        self._kept: Any = None
        self._counts = False

    def begin(self) -> None:
        self.calls, self._kept, self._counts = 0, sys.getprofile(), True
        sys.setprofile(self._count)

    def _count(self, _frame: FrameType, event: str, _what: object) -> None:
        self.calls += event in ("call", "c_call")

    def end(self) -> bool:
        """Ends the count; returns whether it is more than one command may take."""
        if not self._counts:
            return False
        sys.setprofile(self._kept)
        self._counts = False
        return self.calls > MOST_CALLS


class Holdings:
    """How many entries each process holds, look by look, beside the number of events that it may have kept."""

    def __init__(self) -> None:
        self._looks: dict[Process, list[tuple[int, int]]] = {}
        self._last: dict[Process, tuple[float, int]] = {}

    def look(self, process: Process, granted: int, events: int) -> None:
        """Counts what the process that runs now holds, if more was granted since the last look, some time ago."""
        when, tick = self._last.setdefault(process, (process.world.now, granted))
        if process.world.now >= when + LOOK_S and granted > tick:
            self._last[process] = process.world.now, granted
            self._looks.setdefault(process, []).append((entries_held(sys._getframe(1)), events))

    def growing(self) -> str:
        """Returns which process held more and more, "" for none: all late looks show more than any early one."""
        for process, looks in self._looks.items():
            if len(looks) < LEAST_LOOKS:
                continue
            fifth = len(looks) // 5
            early, late = looks[fifth : 2 * fifth], looks[-fifth:]
            before, after = max(held for held, _ in early), min(held for held, _ in late)
            if after > before + _SLACK + _AN_EVENT * (late[-1][1] - early[0][1]):
                return f"the {process.name} holds more and more: {before} entries, later {after}"
        return ""


def entries_held(frame: FrameType | None) -> int:
    """Returns the number of entries of all containers and attributes reached from a stack, without the simulator's."""
    seen: set[int] = set()
    left: list[Any] = []
    while frame:
        if frame.f_globals.get("__name__", "").startswith("haploop."):
            left += frame.f_locals.values()
        frame = frame.f_back
    count = 0
    while left:
        one = left.pop()
        if id(one) in seen or isinstance(one, _NOT_FOLLOWED):
            continue
        seen.add(id(one))
        inner = [*_inner(one)]
        count += len(inner)
        left += inner
    return count


def _inner(one: Any) -> Iterable[Any]:
    """The entries of a container, the attributes of an object, what a function or a method carries."""
    if isinstance(one, dict):
        return [*one.keys(), *one.values()]
    if isinstance(one, list | tuple | set | frozenset | deque):
        return one
    if isinstance(one, MethodType):
        return (one.__self__,)
    if isinstance(one, FunctionType):
        return [cell.cell_contents for cell in one.__closure__ or () if cell != _EMPTY]
    if type(one).__module__.startswith(_OF_THE_SIMULATOR):
        return ()
    slots = [getattr(one, name, None) for kind in type(one).__mro__ for name in getattr(kind, "__slots__", ())]
    return [*getattr(one, "__dict__", {}).values(), *slots]
