"""The clock at its socket: who is let in, and what it does between two grants."""

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgpack
import pytest
import zmq

from haploop.launch.clock.roster import Node, Roster
from haploop.launch.clock.server import ClockServer
from haploop.launch.foreign import Program
from haploop.launch.processes.standstill import late_observers
from haploop.protocol.transport.messages import PROCESSES
from helpers.live.attacks import Stranger, pack
from helpers.runs.clocks import clock

SECRET = "s" * 32
JOIN, REFUSED, COMMAND, REPLY = 1, 3, 13, 14


class Served:
    """A clock's server, and those who speak to it."""

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="hl", dir="/tmp")
        self.sockets = Path(self._folder.name)
        self.context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        self.asked: list[str] = []
        self.server = ClockServer(
            self.context, self.sockets, SECRET, clock(), ("", {}, {}, {}), self._note, lambda _: True
        )

    def _note(self, verb: str, arguments: dict[str, Any]) -> tuple[bool, str, dict[str, Any]]:
        self.asked.append(verb)
        return True, verb, {}

    def answer(self, frame: bytes) -> list[Any]:
        """What comes back to somebody new."""
        with Stranger(self.context, self.sockets / "clock.sock") as stranger:
            stranger.socket.send(frame)
            self.server.socket.poll(60_000)
            self.server.serve()
            assert stranger.socket.poll(60_000)
            return msgpack.unpackb(stranger.socket.recv())[1:]

    def close(self) -> None:
        self.server.close()
        self.context.destroy(linger=0)
        self._folder.cleanup()


@pytest.fixture
def served() -> Iterator[Served]:
    made = Served()
    yield made
    made.close()


@pytest.mark.parametrize("role", PROCESSES)
def test_a_process_that_does_not_bring_the_sockets_its_role_must_bind_is_refused_with_their_names(
    role: str, served: Served
) -> None:
    for brought in ({}, {"loop ": "ipc://x"}, {"Telemetry": "ipc://x"}):
        code, reason = served.answer(pack(1, JOIN, role, SECRET, 1, brought, True, {}))
        assert code == REFUSED
        assert all(name in reason for name in PROCESSES[role].binds)
    assert served.server.roster.nodes == {}
    assert served.server.roster.refused == {role: reason}


@pytest.mark.parametrize("role", PROCESSES)
@pytest.mark.parametrize("program", [(), (None,), ({},)])
def test_a_process_that_does_not_say_what_it_is_may_take_part(role: str, program: tuple[Any, ...], served: Served):
    brought = dict.fromkeys(PROCESSES[role].binds, "ipc://x")
    with Stranger(served.context, served.sockets / "clock.sock") as stranger:
        stranger.socket.send(pack(1, JOIN, role, SECRET, 1, brought, True, *program))
        served.server.socket.poll(60_000)
        served.server.serve()
        node = served.server.roster.own(role)
    assert node
    assert node.program == {}


def test_a_wrong_secret_is_called_so_and_kept_by_the_role_it_came_with(served: Served) -> None:
    code, reason = served.answer(pack(1, JOIN, "plant", "0" * 32, 1, {"loop": "x", "telemetry": "y"}, True, {}))
    assert code == REFUSED
    assert reason == "JOIN as plant, a role of the run's own processes, came with a wrong secret; join as an observer."
    assert served.server.roster.refused == {"plant": reason}


def test_one_command_is_carried_out_between_two_grants_however_many_wait(served: Served) -> None:
    with Stranger(served.context, served.sockets / "clock.sock") as stranger:
        for number in range(5):
            stranger.socket.send(pack(1, COMMAND, str(number), {}))
        done = []
        while len(served.asked) < 5:
            assert served.server.socket.poll(60_000)
            before = len(served.asked)
            served.server.serve()
            done.append(len(served.asked) - before)
    assert done == [1] * 5
    assert served.asked == list("01234")


def test_a_frame_that_takes_long_to_read_is_refused_unread(served: Served) -> None:
    code, reason = served.answer(pack(1, COMMAND, "set", {"set": {f"wall.k{i}": 1.0 for i in range(10_000)}}))
    assert code == REFUSED
    assert reason.startswith("A frame must be at most 32768 bytes, but one of ")
    assert served.asked == []
    assert served.answer(pack(1, COMMAND, "x" * 30_000, {}))[0] == REPLY


def test_a_message_of_very_many_frames_is_taken_over_several_turns_with_grants_between(served: Served) -> None:
    with Stranger(served.context, served.sockets / "clock.sock") as stranger:
        stranger.socket.send_multipart([b""] * 999 + [pack(1, COMMAND, "pause", {})])
        assert served.server.socket.poll(60_000)
        turns = 0
        while not served.asked:
            served.server.serve()
            turns += 1
        assert turns == 5
        assert stranger.socket.poll(60_000)
        assert msgpack.unpackb(stranger.socket.recv())[1:3] == [REPLY, True]


def test_an_observer_that_holds_the_run_and_is_silent_or_never_ready_is_taken_off() -> None:
    roster = Roster()
    for number, (role, lossless, ready, heard) in enumerate(
        [
            ("logger", True, True, 0.0),
            ("mute", True, True, 10.0),
            ("slow", True, False, 29.0),
            ("loading", True, False, 0.0),
            ("view", False, False, 0.0),
        ]
    ):
        node = Node(bytes([number]), role, 1, lossless, {}, 0.0)
        node.ready, node.heard, roster.nodes[node.identity] = ready, heard, node
    assert [node.role for node, _ in late_observers(roster, 14.0, 5.0)] == []
    assert [node.role for node, _ in late_observers(roster, 16.0, 5.0)] == ["mute"], "what still loads may take longer"
    late = late_observers(roster, 30.0, 5.0)
    assert [(node.role, why.partition(";")[0]) for node, why in late] == [
        ("mute", "Nothing was heard from you for 5 s"),
        ("slow", "You were not ready within 20 s"),
        ("loading", "You were not ready within 20 s"),
    ]
    roster.discount_silence(20.0)
    assert late_observers(roster, 30.0, 5.0) == []


def test_of_a_run_that_has_ended_an_observer_is_kept_what_it_takes_but_not_what_it_only_speaks_of() -> None:
    roster = Roster()
    node = Node(b"1", "logger 2", 1, True, {}, 10.0, tick=50)
    roster.nodes[node.identity] = node
    assert roster.followers() == []
    node.ready, node.heard = True, 22.0
    node.reached(60)
    assert roster.followers() == [node]
    assert late_observers(roster, 26.0, 5.0, ended_at=20.0) == []
    node.heard = 27.5
    node.reached(60)
    assert [why for _, why in late_observers(roster, 27.5, 5.0, ended_at=20.0)] == [
        "You took nothing for 5 s after the end; the rest is no longer kept for you."
    ]
    assert late_observers(roster, 27.5, 5.0) == []


def test_a_pace_goes_by_the_controller_too_where_a_plant_of_anothers_reports_by_the_block() -> None:
    for programs, tick in (({}, 0), ({"plant": Program("plant")}, 90)):
        roster = Roster(programs)
        assert roster.loop_tick() is None
        for role, done in (("plant", 0), ("controller", 90)):
            roster.nodes[role.encode()] = Node(role.encode(), role, 1, True, {}, 0.0, tick=done)
        assert roster.loop_tick() == tick
