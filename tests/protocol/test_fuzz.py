"""Rubbish at the sockets of a run: the run goes on, to the same bits."""

import hashlib
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zmq

import haploop.logger
from haploop.launch.clock.clock import Clock
from haploop.launch.clock.server import ClockServer
from haploop.protocol.ticks import Timebase
from helpers.live import attacks
from helpers.live.live_run import Going, going, undisturbed
from helpers.scenes.least import KINDS, scene

REFUSED, WELCOME, REPLY = 3, 2, 14


@pytest.fixture
def context() -> Iterator["zmq.Context[zmq.Socket[bytes]]"]:
    with zmq.Context() as made:
        yield made
        made.destroy(linger=0)


def assert_unharmed(run: Going, summary: dict[str, Any]) -> None:
    """The run came to its end as if nobody had been there, and its log holds all of it."""
    assert summary["ended"] == "done"
    assert summary["lost"]["telemetry_gaps"] == 0
    digest = undisturbed(run.prepared)["trajectory_sha256"]
    assert summary["trajectory_sha256"] == digest
    plant = haploop.logger.read(run.prepared.out)["/plant"]
    assert hashlib.sha256(np.stack([plant["x"], plant["v"]], axis=1).tobytes()).hexdigest() == digest


def test_what_is_no_message_and_what_is_out_of_place_is_refused_and_changes_nothing(
    tmp_path: Path, context: "zmq.Context[zmq.Socket[bytes]]"
) -> None:
    with going(tmp_path, "duration=0.6", pauses=(200,)) as run:
        run.stands_at(200)
        with attacks.Stranger(context, run.run_json.with_name("clock.sock")) as clock:
            for frame in attacks.junk():
                code, reason = clock.ask(frame)
                assert code == REFUSED
                assert 0 < len(reason) < 300
            for frame in attacks.out_of_place():
                assert clock.ask(frame)[0] == REFUSED
            for frame in attacks.false_joins():
                assert clock.ask(b"", b"more than one frame", frame)[0] == REFUSED
            assert {node["role"] for node in run.ask("status")[1]["nodes"]} == {"plant", "controller", "logger"}
        run.ask("resume")
        assert_unharmed(run, run.result())


def test_commands_that_cannot_be_carried_out_are_refused_and_change_nothing(
    tmp_path: Path, context: "zmq.Context[zmq.Socket[bytes]]"
) -> None:
    with going(tmp_path, "duration=0.6", pauses=(200,)) as run:
        run.stands_at(200)
        with attacks.Stranger(context, run.run_json.with_name("clock.sock")) as clock:
            for verb, arguments in attacks.impossible_commands():
                code, ok, text, _data = clock.ask(attacks.pack(1, 13, verb, arguments))
                assert (code, ok) == (REPLY, False), (verb, arguments)
                assert text
        run.ask("resume")
        assert_unharmed(run, run.result())
    noted = haploop.logger.read(run.prepared.out)["/events"]
    assert [set(event) & {"pause", "resume", "swap", "set", "stop"} for event in noted] == [{"pause"}, {"resume"}]


def test_an_observer_that_talks_nonsense_harms_only_itself(
    tmp_path: Path, context: "zmq.Context[zmq.Socket[bytes]]"
) -> None:
    with going(tmp_path, "duration=0.6", pauses=(200,)) as run:
        run.stands_at(200)
        with attacks.Stranger(context, run.run_json.with_name("clock.sock")) as observer:
            join = attacks.pack(1, 1, "observer", "", -(2**63), {}, True, {})
            code, _run, _scene, _timebase, _endpoints, granted, about = observer.ask(join)
            assert (code, granted) == (WELCOME, 200)
            assert "secret" not in about
            assert observer.ask(join) == [REFUSED, "You have joined already."]
            for tick in (-1, 201, attacks.MAX_WHOLE, attacks.MIN_WHOLE):
                assert observer.ask(attacks.pack(1, 4, tick))[0] == REFUSED
                assert observer.ask(attacks.pack(1, 6, tick, {}))[0] == REFUSED
            for code in (2, 5, 11, 14, 20, 22, 30):
                (frame,) = [f for f in [*attacks.out_of_place(), attacks.pack(1, 14, True, "", {})] if f[2] == code]
                assert observer.ask(frame)[0] == REFUSED
            for status in ({"refused": 5}, {"refused": ["I refuse"]}, {1: {2: [None]}}, {"t_s": "x", "verdict": []}):
                observer.socket.send(attacks.pack(1, 6, 200, status))
            observer.socket.send(attacks.pack(1, 8, 0, "the plant has ended"))
            data = run.ask("status")[1]
            assert data["nodes"][-1]["role"] == "observer"
            observer.socket.send(attacks.pack(1, 10, 0, "I cannot go on"))
        run.ask("resume")
        assert_unharmed(run, run.result())
    events = haploop.logger.read(run.prepared.out)["/events"]
    assert "refuse" not in str(events)


def test_junk_on_every_socket_before_a_run_begins_and_while_it_runs_changes_nothing(
    tmp_path: Path, context: "zmq.Context[zmq.Socket[bytes]]"
) -> None:
    opened: list[zmq.Socket[bytes]] = []

    def attack(path: Path) -> None:
        """As soon as the socket is there: before its node has heard of its partners."""
        while not path.exists():
            threading.Event().wait(0.0005)
        opened.extend(attacks.send_unasked(context, path))

    threads: list[threading.Thread] = []

    def announced(sockets: Path) -> None:
        for name in attacks.SOCKETS:
            threads.append(threading.Thread(target=attack, args=(sockets / f"{name}.sock",)))
            threads[-1].start()
        threads[0].join()  # the clock has heard the strangers before any node

    with going(tmp_path, "duration=0.6", pauses=(200,), announced=announced) as run:
        for thread in threads:
            thread.join()
        run.stands_at(200)
        for name in attacks.SOCKETS:
            attack(run.run_json.with_name(f"{name}.sock"))
        run.ask("resume")
        assert_unharmed(run, run.result())
    for sender in opened:
        sender.close(0)
    assert len(opened) == 14


@pytest.mark.slow
def test_a_flood_of_junk_on_every_socket_cannot_hold_a_run_up(tmp_path: Path) -> None:
    with going(tmp_path, "duration=0.5", "run.deadline=60", pauses=(50,)) as run:
        run.stands_at(50)
        command = [sys.executable, attacks.__file__, str(run.live.sockets)]
        with subprocess.Popen(command, stdout=subprocess.PIPE) as flood:
            try:
                assert flood.stdout
                assert flood.stdout.readline() == b"flooding\n"
                run.ask("resume")
                summary = run.result()
            finally:
                flood.kill()
        assert_unharmed(run, summary)


def test_the_clock_grants_after_a_turns_worth_of_messages_however_many_wait(
    context: "zmq.Context[zmq.Socket[bytes]]",
) -> None:
    resolved = scene()
    time = Timebase.from_scene(resolved)
    with tempfile.TemporaryDirectory(prefix="hl", dir="/tmp") as sockets:
        clock = Clock(resolved, time, KINDS)
        nobody = "", {}, {}, {}
        server = ClockServer(context, Path(sockets), "", clock, nobody, lambda *_: (True, "", {}), lambda _: False)
        with attacks.Stranger(context, Path(sockets) / "clock.sock") as stranger:
            for _ in range(900):
                stranger.socket.send(b"junk")
            stranger.socket.send(attacks.pack(1, 13, "status", {}))
            turns = []
            while sum(turns) < 900:
                server.socket.poll()
                threading.Event().wait(0.02)  # let more of them come in
                before = server.unknown_peers
                server.serve()
                turns.append(server.unknown_peers - before)
        server.close()
    assert max(turns) <= 200
