"""The nodes that take part in a run, the tick each has reached, and those that keep the others waiting."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field

from haploop.launch.foreign import NO_PROGRAMS, ROLES, Program
from haploop.launch.spec import PROGRAMS
from haploop.protocol.transport.messages import PROCESSES
from haploop.protocol.transport.wire import Message


@dataclass
class Node:
    """The clock's record of a node.

    Attributes:
        role, pid, lossless: as stated when it joined; a lossless node holds the clock back.
        tick: every tick before this one is done.
        joined, heard, moved: wall time of its JOIN, of its last message, and of the last that reported more ticks, s.
        is_gone: whether a message could not be sent to it because its connection has ended.
        program: name, version and command of its program, as it stated them; each a text that may be missing.
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
    is_gone: bool = False
    waits_for: str = ""
    status: Message = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.joined = self.moved = self.heard

    def reached(self, tick: int) -> None:
        """Records that the node has completed every tick before this one."""
        if tick > self.tick:
            self.tick, self.moved = tick, self.heard

    @property
    def is_own(self) -> bool:
        """True for one of the run's own processes, false for an attached one."""
        return self.role in PROCESSES


class Roster:
    """The nodes of a run by their identity on the clock's socket.

    Args:
        programs: foreign programs that take the place of the run's own processes, by role.

    Attributes:
        refused: role -> why the last node that asked to join in this role of the run was refused; any other role is an
            observer's.
    """

    def __init__(self, programs: Mapping[str, Program] = NO_PROGRAMS) -> None:
        self._programs = programs
        self.nodes: dict[bytes, Node] = {}
        self.refused: dict[str, str] = {}

    def own(self, role: str) -> Node | None:
        """Returns the run's own process of this role, None before it has joined."""
        return next((node for node in self.nodes.values() if node.role == role), None)

    def label(self, role: str) -> str:
        """Returns the name of a role for messages; includes the program's name if it is a foreign program."""
        return self._programs[role].label if role in self._programs else role

    @property
    def witness(self) -> str:
        """The role whose progress shows that changes were made; the logger sees what foreign programs make of them."""
        return "logger" if self._programs else "controller"

    def others_than(self, role: str) -> str:
        """Returns a sentence that names the foreign programs in other roles; "" if there are none."""
        labels = [program.label for program in self._programs.values() if program.role != role]
        return f" Not haploop's own in this run: the {' and the '.join(labels)}." if labels else ""

    def is_external(self, role: str) -> bool:
        """Tells whether a program that the launcher does not start takes this role."""
        return role in self._programs and self._programs[role].is_external

    def provenance(self) -> dict[str, Message]:
        """Returns which programs plant and controller are, by role, if one of them is not haploop's own; else nothing.

        Each has ``name``, ``version`` and ``command``, "" where unknown, and ``own``: whether it is haploop's.
        """
        if not self._programs:
            return {}
        from importlib.metadata import version

        found = {}
        for role in ROLES:
            said, foreign = (node.program if (node := self.own(role)) else {}), self._programs.get(role)
            own = {"name": "haploop", "version": version("haploop"), "command": f"python -m {PROCESSES[role].module}"}
            found[role] = {key: said.get(key, "") for key in own} if foreign else own
            if foreign and foreign.command:
                found[role]["command"] = foreign.command
            found[role]["own"] = not foreign
        return found

    def with_provenance(self, context: Message) -> Message:
        """Returns the context of WELCOME extended by ``provenance``, for the log too; unchanged if both are own."""
        programs = self.provenance()
        if not programs:
            return context
        attachments = context.get("attachments", {}) | {PROGRAMS: json.dumps(programs, indent=1)}
        return context | {"programs": programs, "attachments": attachments}

    def all_own(self, what: str) -> bool:
        """Tells whether all the run's own processes have joined and ``what`` ("ready", "done") holds for each."""
        return all((node := self.own(role)) is not None and getattr(node, what) for role in PROCESSES)

    def joined(self) -> bool:
        return all(self.own(role) for role in PROCESSES)

    def endpoints(self) -> dict[str, dict[str, str]]:
        return {node.role: node.endpoints for node in self.nodes.values() if node.is_own}

    def slowest(self) -> int:
        """Returns the tick of the slowest lossless node except plant and controller; it bounds what is in flight."""
        return min((node.tick for node in self.nodes.values() if node.lossless and not node.done), default=0)

    def followers(self) -> list[Node]:
        """Returns the logger, until it is done, and the observers that may miss nothing and have begun to follow."""
        return [node for node in self.nodes.values() if node.lossless and node.ready and not node.done]

    def loop_tick(self) -> int | None:
        """Returns the tick up to which a pace takes the loop as done: the plant's; None before it has joined.

        A foreign plant may report in blocks, long after the controller has answered its samples.
        """
        plant, controller = self.own("plant"), self.own("controller")
        if plant and controller and "plant" in self._programs:
            return max(plant.tick, controller.tick)
        return plant and plant.tick

    def common_tick(self) -> int:
        """Returns the last tick that all own processes have done."""
        return min((node.tick for node in self.nodes.values() if node.is_own), default=0)

    def silent(self, now: float, deadline_s: float) -> list[Node]:
        """Returns the nodes that have been silent for longer than the deadline, the longest silent first."""
        silent = [node for node in self.nodes.values() if not node.done and now - node.heard > deadline_s]
        return sorted(silent, key=lambda node: node.heard)

    def discount_silence(self, seconds: float) -> None:
        """Excludes some time, s, from the silence of every node."""
        for node in self.nodes.values():
            node.heard += seconds
            node.joined += seconds
            node.moved += seconds

    def table(self) -> list[Message]:
        """Returns role, pid, tick, lag behind the foremost, whom it waits for and skipped ticks of every node.

        A foreign program also has its ``program``, as in ``provenance``.
        """
        programs = self.provenance()
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
                **({"program": programs[node.role]} if not programs.get(node.role, {"own": True})["own"] else {}),
            }
            for node in self.nodes.values()
        ]
