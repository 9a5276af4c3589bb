"""Why a run elsewhere cannot be reached is told in one sentence that fits, soon, and by whoever asks."""

from __future__ import annotations

import contextlib
import socket
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
import zmq

from haploop.launch.processes import run_directory
from haploop.launch.processes.run_directory import Elsewhere, RunNotFound, find
from haploop.protocol.transport import clock_client, connection
from haploop.protocol.transport.clock_client import ClockClient, Refused
from haploop.protocol.transport.keys import CLIENT, CLOCK, make_keys, read_keys
from haploop.protocol.transport.sockets import SecureContext, Transport, connect, open_socket


@pytest.fixture
def impatient(monkeypatch) -> None:
    """What may pass is told sooner; silence is not, since on a busy machine others need their time to speak."""
    monkeypatch.setattr(connection, "_TOLD_AFTER_S", 0.6)
    monkeypatch.setattr(connection, "_SILENCE_AFTER_S", 4.0)


@pytest.fixture
def keys(tmp_path) -> Path:
    make_keys(tmp_path / "keys")
    return tmp_path / "keys"


@contextlib.contextmanager
def listening(keys: Path | None) -> Iterator[str]:
    """The address of a ROUTER as that of a clock."""
    context = SecureContext.from_transport(Transport("127.0.0.1", keys=keys and read_keys(keys, CLOCK)))
    router = open_socket(context, zmq.ROUTER)
    port = router.bind_to_random_port("tcp://127.0.0.1")
    try:
        yield f"tcp://127.0.0.1:{port}"
    finally:
        context.destroy(linger=0)


def are_told(words: str, address: str, keys: Path | None) -> None:
    """Asserts that a command says why, and a node does, too."""
    with pytest.raises(RunNotFound) as found:
        find(Elsewhere(address, keys))
    context = SecureContext.from_transport(Transport(keys=keys and read_keys(keys, CLIENT)))
    client = ClockClient(context, "observer", address, "")
    try:
        with pytest.raises(Refused) as refused:
            client.join({})
    finally:
        context.destroy(linger=0)
    assert words in str(found.value)
    assert words in str(refused.value)


@pytest.mark.slow
def test_a_key_that_the_run_does_not_know_is_told_so(keys, tmp_path):
    make_keys(tmp_path / "mine")
    (tmp_path / "mine/clock.key").write_bytes((keys / "clock.key").read_bytes())
    with listening(keys) as address:
        are_told("refuses this key", address, tmp_path / "mine")


@pytest.mark.slow
def test_whoever_comes_without_keys_is_told_that_the_run_has_some(keys):
    with listening(keys) as address:
        are_told("is guarded by keys", address, None)


@pytest.mark.slow
def test_whoever_is_turned_away_before_a_first_word_can_be_said_is_told_why_and_does_not_wait_for_ever(
    keys, monkeypatch
):
    """A socket that has come to another's keys is connected to nothing from then on."""

    def connect_and_be_turned_away(socket, address):
        connect(socket, address)
        while socket.getsockopt(zmq.EVENTS) & zmq.POLLOUT:
            socket.poll(10, zmq.POLLIN)

    for module in (run_directory, clock_client):
        monkeypatch.setattr(module, "connect", connect_and_be_turned_away)
    with listening(keys) as address:
        are_told("is guarded by keys", address, None)


@pytest.mark.slow
def test_whoever_comes_with_keys_to_a_run_without_is_told_so(keys, monkeypatch):
    """On a busy machine a handshake that is broken off may come before the one that tells why."""
    monkeypatch.setattr(connection, "_TOLD_AFTER_S", 60.0)
    with listening(None) as address:
        are_told("has no keys", address, keys)


@pytest.mark.slow  # what may pass is told after some time
def test_the_keys_of_another_run_are_told_from_a_key_that_is_not_known(keys, tmp_path, impatient):
    make_keys(tmp_path / "other")
    with listening(keys) as address:
        are_told("clock.key does not belong to its keys", address, tmp_path / "other")


@pytest.mark.slow
@pytest.mark.parametrize("with_keys", [True, False])
@pytest.mark.parametrize(
    ("says", "words"),
    [(b"HTTP/1.0 400\r\n\r\n", "is not a run of haploop"), (b"", "does not answer"), (None, "Nobody listens")],
)
def test_what_is_no_run_at_all_is_told_so(keys, says, words, with_keys, impatient):
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))  # where nobody listens, nobody else may come to listen
        address = f"tcp://127.0.0.1:{other.getsockname()[1]}"
        if says is not None:
            other.listen()
        if says:
            threading.Thread(target=answer_all, args=(other, says), daemon=True).start()
        are_told(words, address, keys if with_keys else None)


def answer_all(server: socket.socket, says: bytes) -> None:
    with contextlib.suppress(OSError):
        while True:
            peer, _ = server.accept()
            with peer:
                peer.sendall(says)


def test_a_client_may_connect_to_what_a_node_binds_and_a_stranger_may_not(keys, tmp_path):
    """With the key of the one whose socket it is, as WELCOME brings it; a node has a pair of its own."""
    make_keys(tmp_path / "other")
    launcher = Transport("127.0.0.1", keys=read_keys(keys, CLOCK), directory=keys)
    node = SecureContext.from_transport(launcher.of("plant"))
    known = SecureContext.from_transport(Transport(keys=read_keys(keys, CLIENT)))
    stranger = SecureContext.from_transport(Transport(keys=read_keys(tmp_path / "other", CLIENT)))
    try:
        assert launcher.keys
        publisher = open_socket(node, zmq.XPUB)
        address = f"tcp://127.0.0.1:{publisher.bind_to_random_port('tcp://127.0.0.1')}"
        subscribers = [open_socket(context, zmq.SUB) for context in (known, stranger)]
        for subscriber in subscribers:
            connect(subscriber, address, launcher.keys.known["plant"])
            subscriber.subscribe(b"plant")
        assert publisher.poll(60_000)
        assert publisher.recv() == b"\x01plant"
        publisher.send_multipart([b"plant", b"block"])
        assert subscribers[0].poll(60_000)
        assert not publisher.poll(200), "a stranger's subscription came through"
        assert not subscribers[1].poll(0)
    finally:
        for context in (known, stranger, node):
            context.destroy(linger=0)
