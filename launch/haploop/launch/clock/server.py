"""The clock on its socket: nodes join and report, grants go out, commands from other terminals are answered."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from pathlib import Path
from typing import Any

import zmq

from haploop.launch.clock.clock import Clock
from haploop.launch.clock.device_time import PLANT
from haploop.launch.clock.joining import what_joins, why_refused
from haploop.launch.clock.roster import Node, Roster
from haploop.launch.foreign import NO_PROGRAMS, Program
from haploop.launch.spec import RunFailed
from haploop.protocol.changes import REFUSALS, refusals_of
from haploop.protocol.transport.machine import machine_of
from haploop.protocol.transport.messages import PROCESSES
from haploop.protocol.transport.sockets import bind, has_message, open_socket, transport_of
from haploop.protocol.transport.wire import Frame, Message, WireError, decode, encode

Answer = tuple[bool, str, Message]
Command = Callable[[str, Message], Answer | Generator[None, None, Answer]]

# The most messages taken before grants go out, so that nobody can hold up time by flooding the clock.
_AT_ONCE = 200
# The largest frame taken from anybody but the run's own processes, bytes: a larger one takes ms to read.
_LARGEST_OF_STRANGERS = 32 * 1024
# An observer is told no more often than this, s, how far the others may go: it works on what it hears, and the queue to
# one that hangs has room for some 1000 messages.
_TOLD_S = 0.02


class ClockServer:
    """Speaks the clock's part of the protocol.

    Args:
        welcome: the fields run, scene, timebase and context of WELCOME.
        start_gate: given the pids of all that are ready, returns whether the first tick may be worked on.

    Attributes:
        untold: sentences on changes refused or taken back, which the leader of the run shows and removes.
    """

    def __init__(
        self,
        context: zmq.Context[zmq.Socket[bytes]],
        sockets: Path,
        secret: str,
        clock: Clock,
        welcome: tuple[str, Message, Message, Message],
        command: Command,
        start_gate: Callable[[set[int]], bool],
        programs: Mapping[str, Program] = NO_PROGRAMS,
    ) -> None:
        self.socket = open_socket(context, zmq.ROUTER)
        self._machine, self._keys = machine_of(context), transport_of(context).keys
        self.address = bind(self.socket, sockets, "clock")
        self._secret, self._clock, self._welcome, self._command = secret, clock, welcome, command
        self.roster = Roster(programs)
        self.results: dict[str, Message] = {}
        self.unknown_peers = 0
        self.untold: list[str] = []
        self._sender = b""  # of a message with frames still to be taken
        self._greeted, self._start_gate = False, start_gate
        self._granted, self._last_sent, self._told_due = -1, False, 0.0
        self._awaited: list[tuple[bytes, Generator[None, None, Answer]]] = []

    @property
    def is_stopped(self) -> bool:
        """True once the clock will grant no further tick."""
        return self._clock.is_last

    def close(self) -> None:
        """Stops listening; messages already sent still go out, and answers still being worked out are given up."""
        for _, steps in self._awaited:
            steps.close()
        self.socket.close(linger=200)

    def serve(self) -> None:
        """Takes the messages that are there, up to a limit, then grants what can be granted.

        Raises RunFailed if one of the run's own processes said that it cannot go on.
        """
        for _ in range(_AT_ONCE):
            if not has_message(self.socket) or not self._take_one():
                break  # that may have taken a millisecond, and the next may wait for the grant
        self._awaited, awaited = [], self._awaited
        for sender, steps in awaited:
            self._reply(sender, steps)
        if not self._greeted and self.roster.joined():
            self._greeted = True
            self._welcome = (*self._welcome[:3], self.roster.with_provenance(self._welcome[3]))
            for node in list(self.roster.nodes.values()):
                self._greet(node)
        if self.roster.all_own("ready"):
            has_begun = self._granted >= 0 or self._clock.is_last
            if has_begun or self._start_gate({node.pid for node in self.roster.nodes.values() if node.ready}):
                self.grant()

    def _take_one(self) -> bool:
        """Takes a message, or some frames of one with very many; tells whether that was quick and no command."""
        sender = self._sender or self.socket.recv()
        data, frames = b"", 0
        while self.socket.rcvmore:
            if frames == _AT_ONCE:
                self._sender = sender
                return False
            data, frames = self.socket.recv(), frames + 1
        self._sender = b""
        is_large = len(data) > _LARGEST_OF_STRANGERS
        try:
            if is_large and not ((node := self.roster.nodes.get(sender)) and node.is_own):
                raise WireError(f"A frame must be at most {_LARGEST_OF_STRANGERS} bytes, but one of {len(data)} came.")
            frame = decode(data)
            self._take(sender, frame)
        except WireError as error:
            self._refuse(sender, str(error))
            return not is_large
        return frame.name != "COMMAND"

    def grant(self) -> None:
        """Tells every node how far it may go and what changes on the way, if that is new.

        An observer gets only some of the grants that bring nothing else new.
        """
        clock, now = self._clock, self._machine.now()
        until = clock.grant(self.roster.slowest(), now, self.roster.loop_tick())
        events = clock.take_events()
        if until == self._granted and clock.is_last == self._last_sent and not events:
            return
        self._granted, self._last_sent = until, clock.is_last
        grant = encode("GRANT", until, clock.is_last, events)
        if tells_all := bool(events) or clock.is_last or now >= self._told_due:
            self._told_due = now + _TOLD_S
        for node in list(self.roster.nodes.values()):
            if node.ready and not node.done and (tells_all or node.is_own):
                self._send_frame(node.identity, grant)

    def probe(self, nodes: list[Node]) -> None:
        """Repeats the grant to nodes that the launcher did not start; one to which it cannot be sent is gone."""
        for node in nodes:
            if not node.is_own or self.roster.is_external(node.role):
                self._send(node.identity, "GRANT", self._clock.until, self._clock.is_last, [])

    def _send(self, identity: bytes, name: str, *fields: Any) -> None:
        self._send_frame(identity, encode(name, *fields))

    def _send_frame(self, identity: bytes, frame: bytes) -> None:
        try:
            self.socket.send_multipart([identity, frame], flags=zmq.DONTWAIT)
        except zmq.ZMQError as error:  # gone, or so far behind that its queue is full
            node = self.roster.nodes.get(identity)
            if node and not node.is_own:
                del self.roster.nodes[identity]
            elif node:
                node.is_gone = error.errno == zmq.EHOSTUNREACH

    def _reply(self, sender: bytes, answer: Answer | Generator[None, None, Answer]) -> None:
        """Sends an answer, or takes one more step towards it."""
        if not isinstance(answer, tuple):
            try:
                next(answer)
            except StopIteration as done:
                answer = done.value
            else:
                self._awaited.append((sender, answer))
                return
        self._send(sender, "REPLY", *answer)

    def _take(self, sender: bytes, frame: Frame) -> None:
        if frame.name == "JOIN":
            self._join(sender, frame.as_dict())
            return
        if frame.name == "COMMAND":
            self._reply(sender, self._command(*frame.fields))
            return
        node = self.roster.nodes.get(sender)
        if node is None:
            self._refuse(sender, f"{frame.name} came from somebody who has not joined; send JOIN first.")
            return
        if frame.name in ("READY", "PROGRESS") and not 0 <= frame.fields[0] <= self._clock.until:
            self._refuse(sender, f"{frame.name} must name a granted tick, from 0 to {self._clock.until}.")
            return
        node.heard = self._machine.now()
        node.waits_for = ""
        handler = getattr(self, f"_on_{frame.name.lower()}", None)
        if handler is None:
            self._refuse(sender, f"{frame.name} is not for the clock.")
        else:
            handler(node, *frame.fields)

    def _refuse(self, sender: bytes, reason: str) -> None:
        self.unknown_peers += 1
        self._send(sender, "REFUSED", reason)

    def _join(self, sender: bytes, request: Message) -> None:
        role = request["role"]
        known = role in PROCESSES
        program = what_joins(request)
        reason = why_refused(request, program, self._secret, self.roster, self._greeted)
        if sender in self.roster.nodes and not (known and reason):
            reason = "You have joined already."
        if reason:
            if known:
                self.roster.refused[role] = reason
            self._send(sender, "REFUSED", reason)
            return
        can_hold = role == "logger" or (not known and self._welcome[3].get("clock") != PLANT)  # no device waits
        lossless = request["lossless"] and can_hold
        node = Node(sender, role, request["pid"], lossless, request["endpoints"], self._machine.now(), program)
        node.tick = 0 if known else self._clock.until
        self.roster.nodes[sender] = node
        if not known:
            self._greet(node)

    def _greet(self, node: Node) -> None:
        run, scene, timebase, context = self._welcome
        secret = {"secret": self._secret} if node.is_own else {}
        endpoints = self.roster.endpoints()
        if self._keys:
            endpoints = {role: {**addresses, "key": self._keys.known[role]} for role, addresses in endpoints.items()}
        self._send(node.identity, "WELCOME", run, scene, timebase, endpoints, self._clock.until, secret | context)

    # What nodes say

    def _on_ready(self, node: Node, tick: int) -> None:
        node.ready, node.tick = True, tick
        if not node.is_own:
            self._send(node.identity, "GRANT", self._clock.until, self._clock.is_last, self._clock.events_from(tick))

    def _on_progress(self, node: Node, tick: int, status: Message) -> None:
        node.reached(tick)
        node.status = {key: told for key, told in status.items() if key not in REFUSALS} or node.status
        if node.role == "plant":
            self._clock.pace.done(tick, node.heard)
        elif node.is_own:
            for refusal in refusals_of(status, self._clock.events):
                self._clock.note(refusal)
                self.untold.append(str(refusal.get("refused") or refusal.get("restored")))
            if node.role == self.roster.witness:
                self._clock.settle(node.tick)

    def _on_waiting(self, node: Node, tick: int, on: str) -> None:
        node.waits_for = on

    def _on_ended(self, node: Node, tick: int, reason: str) -> None:
        if node.role == "plant":
            self._clock.end_at(tick)

    def _on_done(self, node: Node, tick: int, result: Message) -> None:
        node.done, node.tick = True, tick
        if node.is_own:
            self.results[node.role] = result
        else:
            del self.roster.nodes[node.identity]

    def _on_leave(self, node: Node, tick: int) -> None:
        if not node.is_own:
            del self.roster.nodes[node.identity]

    def _on_failed(self, node: Node, tick: int, reason: str) -> None:
        if node.is_own:
            raise RunFailed(f"The {self.roster.label(node.role)} failed: {reason}{self.roster.others_than(node.role)}")
        del self.roster.nodes[node.identity]

    def drop(self, node: Node, reason: str) -> None:
        """Removes an attached node and tells it why."""
        self._send(node.identity, "ABORT", reason)
        self.roster.nodes.pop(node.identity, None)

    def abort(self, reason: str, but: Node | None = None) -> None:
        """Tells every node, except perhaps one, to save what it has and leave."""
        for node in list(self.roster.nodes.values()):
            if not node.done and node is not but:
                self._send(node.identity, "ABORT", reason)
