"""TCP is there when asked for, in the open only with keys, and changes no bit."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest
import zmq

from haploop.launch.processes import run_directory
from haploop.launch.processes.run_directory import ask
from haploop.launch.runs.start import prepare, run
from haploop.protocol.transport.sockets import SecureContext, Transport, TransportError, open_socket
from haploop.protocol.transport.wire import encode

SCENE = Path(__file__).parents[2] / "launch" / "scenes" / "fig6c.toml"


@pytest.mark.parametrize(
    ("host", "keys", "why"),
    [
        ("0.0.0.0", None, "directory of keys"),
        ("192.0.2.7", None, "directory of keys"),
        ("example", None, "numeric address"),
        (None, "somewhere", "Keys guard TCP"),
    ],
)
def test_a_loop_others_could_steer_is_refused(host, keys, why):
    with pytest.raises(TransportError, match=why):
        Transport.from_options(host, keys and Path(keys))


def test_keys_are_made_once_private_and_kept(tmp_path):
    keys = tmp_path / "keys"
    Transport.from_options("127.0.0.1", keys)
    secret = (keys / "server.key_secret").read_bytes()
    for private in (keys, keys / "server.key_secret", keys / "client.key_secret"):
        assert private.stat().st_mode & 0o077 == 0
    Transport.from_options("127.0.0.1", keys)
    assert (keys / "server.key_secret").read_bytes() == secret


@pytest.mark.parametrize("with_keys", [False, True])
def test_a_run_over_tcp_gives_the_bits_of_one_process_and_answers_whoever_may_ask(tmp_path, with_keys):
    transport = Transport.from_options("127.0.0.1", tmp_path / "keys" if with_keys else None)
    settings = ["duration=1.5", "run.pin=false"]
    alone = run(prepare(SCENE, settings, out=tmp_path / "alone"), in_process=True)
    results, identities = [], []
    prepared = prepare(SCENE, settings, out=tmp_path / "out")
    thread = threading.Thread(
        target=lambda: results.append(run(prepared, transport=transport, pace=1.0, on_started=identities.append))
    )
    thread.start()
    while not identities:
        thread.join(0.01)
    identity, _, address = identities[0].partition(" at ")
    assert address.startswith("tcp://127.0.0.1:")
    live = run_directory.find(identity)
    assert ask(live, "status")[1]["end"] == 1500
    if with_keys:
        assert not answers(address, Transport()), "a client without keys was answered"
        Transport.from_options("127.0.0.1", tmp_path / "other")
        assert not answers(address, stranger(tmp_path, tmp_path / "other")), "a stranger's key was let in"
    thread.join(60)
    assert results[0]["trajectory_sha256"] == alone["trajectory_sha256"]


def stranger(tmp_path: Path, other: Path) -> Transport:
    """Somebody who knows the server's public key but has a key of his own that nobody let in."""
    (other / "server.key").write_bytes((tmp_path / "keys" / "server.key").read_bytes())
    return Transport(keys=other)


def answers(address: str, transport: Transport) -> bool:
    """Whether the clock at ``address`` answers a status command."""
    context = SecureContext.from_transport(transport)
    socket = open_socket(context, zmq.DEALER)
    socket.connect(address)
    socket.send(encode("COMMAND", "status", {}))
    answered = bool(socket.poll(300))
    context.destroy(linger=0)
    return answered
