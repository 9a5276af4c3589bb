"""The nodes that take part in a run, the tick each has reached, and those that keep the others waiting."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from haploop.launch.processes.foreign import NO_PROGRAMS, Program
from haploop.protocol.transport.messages import PROCESSES
from haploop.protocol.transport.wire import Message


@dataclass
class Node:
    """A node as the clock knows it.

    Attributes:
        role, pid, lossless: as it said when it joined; a lossless node holds the clock back.
        tick: every tick before it is done.
        heard: wall time of its last message, s.
        program: name, version and command of what it is, as it said; each a text that may be missing.
    """

    identity: bytes
    role: str
    pid: int
    lossless: bool
    endpoints: dict[str, str]
    heard: float
    program: dict[str, str] = field(default_factory=dict[str, str])
    tick: int = 0
    ready: bool = False
    done: bool = False
    waits_for: str = ""
    status: Message = field(default_factory=dict)

    @property
    def is_own(self) -> bool:
        """True for one of the run's own processes, false for an attached one."""
        return self.role in PROCESSES


class Roster:
    """The nodes of a run by their identity on the clock's socket.

    Args:
        programs: programs of others that take the place of the run's own processes, by role.

    Attributes:
        refused: role -> why the last that asked to join as one was not let in; others than the run's are observers.
    """

    def __init__(self, programs: Mapping[str, Program] = NO_PROGRAMS) -> None:
        self._programs = programs
        self.nodes: dict[bytes, Node] = {}
        self.refused: dict[str, str] = {}

    def own(self, role: str) -> Node | None:
        """Returns the run's own process of this role, None before it has joined."""
        return next((node for node in self.nodes.values() if node.role == role), None)

    def label(self, role: str) -> str:
        """Returns how people are told of a role: by its program, too, where that is somebody else's."""
        return self._programs[role].label if role in self._programs else role

    def all_own(self, what: str) -> bool:
        """Tells whether all the run's own processes have joined and ``what`` ("ready", "done") holds for each."""
        return all((node := self.own(role)) is not None and getattr(node, what) for role in PROCESSES)

    def joined(self) -> bool:
        return all(self.own(role) for role in PROCESSES)

    def endpoints(self) -> dict[str, dict[str, str]]:
        return {node.role: node.endpoints for node in self.nodes.values() if node.is_own}

    def slowest(self) -> int:
        """The tick of the slowest lossless node but plant and controller; it bounds what is in flight."""
        return min((node.tick for node in self.nodes.values() if node.lossless and not node.done), default=0)

    def common_tick(self) -> int:
        """Returns the last tick that all own processes have done."""
        return min((node.tick for node in self.nodes.values() if node.is_own), default=0)

    def silent(self, now: float, deadline_s: float) -> list[Node]:
        """Nodes not heard of for longer than the deadline, the longest silent first."""
        silent = [node for node in self.nodes.values() if not node.done and now - node.heard > deadline_s]
        return sorted(silent, key=lambda node: node.heard)

    def discount_silence(self, seconds: float) -> None:
        """Leaves some time out of the silence of every node."""
        for node in self.nodes.values():
            node.heard += seconds

    def table(self) -> list[Message]:
        """Returns role, pid, tick, lag behind the first, whom it waits for and skipped ticks of every node."""
        first = max((node.tick for node in self.nodes.values()), default=0)
        return [
            {
                "role": node.role,
                "pid": node.pid,
                "tick": node.tick,
                "behind_ticks": first - node.tick,
                "waits_for": node.waits_for,
                "lossless": node.lossless or node.is_own,
                "skipped_ticks": node.status.get("skipped_ticks", 0),
            }
            for node in self.nodes.values()
        ]
