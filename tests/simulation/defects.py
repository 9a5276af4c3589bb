"""Defects put back on purpose, one at a time, by which the simulator shows that it finds what it is for."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import msgpack

from haploop.launch import spec
from haploop.launch.clock import arguments
from haploop.launch.clock.clock import Clock
from haploop.launch.clock.roster import Roster
from haploop.launch.clock.server import ClockServer
from haploop.logger.log.mcap_file import McapFile
from haploop.logger.session import LogSession
from haploop.protocol.transport.clock_client import ClockClient
from haploop.protocol.transport.loop import LoopError, PlantEnd
from haploop.protocol.transport.messages import MESSAGES, PROCESSES, VERSION
from haploop.protocol.transport.telemetry import Publisher, Subscriber
from simulation.plan import draw
from simulation.play import play

Method = Callable[..., Any]


def _goes_back(kept: Method) -> Method:
    def grant(self: Any, slowest: int, *others: Any) -> int:
        self.until = min(kept(self, slowest, *others), slowest + self._window)
        return self.until

    return grant


def _from_strangers(kept: Method) -> Method:
    def take(self: Any, sender: bytes, frame: Any) -> None:
        logger = self.roster.own("logger")
        is_report = frame.name == "PROGRESS" and sender not in self.roster.nodes
        kept(self, logger.identity if is_report and logger else sender, frame)

    return take


def _without_endpoints(kept: Method) -> Method:
    def join(self: Any, sender: bytes, request: dict[str, Any]) -> None:
        asked = dict(request["endpoints"])
        binds = PROCESSES[request["role"]].binds if request["role"] in PROCESSES else {}
        kept(self, sender, {**request, "endpoints": {**dict.fromkeys(binds, "ipc://"), **asked}})
        if sender in self.roster.nodes:
            self.roster.nodes[sender].endpoints = asked

    return join


def _deadline_at_start(kept: Method) -> Method:
    return lambda self: max(kept(self), 1)


def _answered_twice(kept: Method) -> Method:
    def send(self: Any, identity: bytes, name: str, *fields: Any) -> None:
        for _ in range(2 if name == "REPLY" and fields[0] is False else 1):
            kept(self, identity, name, *fields)

    return send


def _never_answered(kept: Method) -> Method:
    def send(self: Any, identity: bytes, name: str, *fields: Any) -> None:
        if name != "REPLY" or not fields[1].startswith("stopping"):
            kept(self, identity, name, *fields)

    return send


def _unchecked_answer(kept: Method) -> Method:
    def exchange(self: Any, tick: int, samples: list[Any]) -> Any:
        self._send(self._pack((VERSION, MESSAGES["SAMPLES"].code, tick, samples)))
        sender, data = self._receive()
        while sender != self._partner:
            sender, data = self._receive()
        answer = msgpack.unpackb(data)
        if answer[:3] != [VERSION, MESSAGES["COMMANDS"].code, tick] or len(answer[3]) != len(samples):
            raise LoopError("In the loop, other commands were expected.")
        return answer[3]

    return exchange


def _end_is_lost(kept: Method) -> Method:
    def publish(self: Any, name: str, *fields: Any) -> None:
        if name != "END" or not fields[1]:
            kept(self, name, *fields)

    return publish


def _one_too_far(kept: Method) -> Method:
    def receive(self: Any) -> Any:
        frame = kept(self)
        if frame and frame.name == "GRANT" and not self.last and self.role == "plant":
            self.until = frame.fields[0] + 1
        return frame

    return receive


def _leaves_at_once(kept: Method) -> Method:
    def leave(self: Any, name: str, *fields: Any) -> None:
        kept_close, self.socket.close = self.socket.close, lambda linger=0: kept_close(0)
        kept(self, name, *fields)

    return leave


def _never_flushed(kept: Method) -> Method:
    return lambda self: None


def _short_write(kept: Method) -> Method:
    def append(self: Any, piece: bytes) -> None:
        if self._failure:
            raise self._failure
        try:
            self._file.write(memoryview(piece))
        except OSError as error:
            self._fail(error)
        self.size += len(piece)

    return append


def _forgets_changes(kept: Method) -> Method:
    def poll(self: Any) -> None:
        known = len(self.events)
        kept(self)
        if self.role == "controller":
            del self.events[known:]

    return poll


def _not_waited_for(kept: Method) -> Method:
    def slowest(self: Any) -> int:
        return min((node.tick for node in self.nodes.values() if node.is_own and node.lossless), default=0)

    return slowest


def _before_its_state(kept: Method) -> Method:
    def follows(self: Any, role: str, frame: Any) -> bool:
        if role not in self._next_tick and frame.name != "STATE":
            self._next_tick[role] = frame.fields[0]
        return kept(self, role, frame)

    return follows


def _not_exclusively(kept: Method) -> Method:
    def claimed(out: Path, first: str) -> bool:
        out.mkdir(parents=True, exist_ok=True)
        if any(out.iterdir()):
            return False
        (out / first).touch()
        return True

    return claimed


def _keeps_objects(kept: Method) -> Method:
    def append_chunk(self: Any, piece: bytes, index: Any) -> None:
        kept(self, piece, index)
        vars(self).setdefault("chunks", []).append(index)

    return append_chunk


def _observers_alone(kept: Method) -> Method:
    return lambda self: [node for node in kept(self) if not node.is_own]


# What the defect is -> the class or module, its method or constant, and what makes the defective one of it.
DEFECTS: dict[str, tuple[Any, str, Callable[[Any], Any]]] = {
    "a grant goes back when a slower node joins": (Clock, "grant", _goes_back),
    "PROGRESS is taken from somebody who has not joined": (ClockServer, "_take", _from_strangers),
    "a JOIN without endpoints is welcomed": (ClockServer, "_join", _without_endpoints),
    "the deadline of a running loop rules its start": (Roster, "common_tick", _deadline_at_start),
    "a refused command is answered twice": (ClockServer, "_send", _answered_twice),
    "stop is carried out, but not answered": (ClockServer, "_send", _never_answered),
    "what comes in place of a force is not checked": (PlantEnd, "exchange", _unchecked_answer),
    "END with a reason is not sent": (Publisher, "publish", _end_is_lost),
    "the plant works one tick beyond its grant": (ClockClient, "_receive", _one_too_far),
    "a node leaves before its last message has gone out": (ClockClient, "leave", _leaves_at_once),
    "the log is flushed at its end only": (LogSession, "flush_when_due", _never_flushed),
    "the rest of a short write is forgotten": (McapFile, "append", _short_write),
    "a change that comes while others are worked on is forgotten": (ClockClient, "poll", _forgets_changes),
    "a second lossless node is not waited for": (Roster, "slowest", _not_waited_for),
    "two runs that start at one instant take one directory": (spec, "_claimed", _not_exclusively),
    "blocks from before a STATE are taken": (Subscriber, "_follows", _before_its_state),
    "one command may carry any number of keys": (arguments, "_MOST_VALUES", lambda kept: 10**9),
    "the log keeps objects of every chunk": (McapFile, "append_chunk", _keeps_objects),
}
# Those that take too many seeds to find; the histories recorded of them find them.
RARE: dict[str, tuple[Any, str, Callable[[Any], Any]]] = {
    "who may miss nothing is not waited for at the end": (Roster, "followers", lambda kept: lambda self: []),
    "the logger is not waited for at the end": (Roster, "followers", _observers_alone),
    "a node at work on a block says nothing": (ClockClient, "keep_in_touch", lambda kept: lambda self, tick, on: None),
}


@contextlib.contextmanager
def put_back(defect: str) -> Iterator[None]:
    """Puts a defect back while it is entered."""
    owner, name, make = (DEFECTS | RARE)[defect]
    kept = getattr(owner, name)
    setattr(owner, name, make(kept))
    try:
        yield
    finally:
        setattr(owner, name, kept)


def seeds_needed(defect: str, most: int) -> tuple[int, str] | None:
    """Returns the first seed that finds a defect, and the promise it breaks; None where none of ``most`` does."""
    with put_back(defect):
        for seed in range(most):
            if broken := play(draw(seed)).broken:
                return seed, broken
    return None


if __name__ == "__main__":
    print("| defect put back | seeds | what it breaks |\n| --- | ---: | --- |")
    for defect in DEFECTS:
        seed, broken = seeds_needed(defect, 10_000) or ("none", "nothing")
        print(f"| {defect} | {seed} | {broken.strip().splitlines()[-1]} |", flush=True)
