"""TCP is there when asked for, in the open only with keys, and changes no bit."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest

from haploop.launch.processes import run_directory
from haploop.launch.processes.run_directory import Elsewhere, RunNotFound, ask, find
from haploop.launch.runs.start import prepare, run
from haploop.protocol.transport.addresses import TransportError
from haploop.protocol.transport.keys import make_keys
from haploop.protocol.transport.messages import PROCESSES
from haploop.protocol.transport.sockets import Transport
from helpers.live.launched import PATIENT
from helpers.live.waiting import PATIENCE_S, wait_for
from helpers.slowly import first_and_slowly

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


def test_a_program_that_somebody_else_starts_binds_beyond_this_host_only_with_keys(tmp_path):
    assert Transport.from_options("127.0.0.1", None).of("controller", elsewhere=True).host == "127.0.0.1"
    assert Transport.from_options("::1", None).of("controller", elsewhere=True).host == "::1"
    make_keys(tmp_path)
    guarded = Transport.from_options("127.0.0.1", tmp_path)
    assert guarded.of("controller", elsewhere=True).host == "0.0.0.0"
    assert guarded.of("controller").host == "127.0.0.1"


@pytest.mark.parametrize("with_keys", first_and_slowly(True, False))
def test_a_run_over_tcp_gives_the_bits_of_one_process_and_answers_whoever_may_ask(tmp_path, with_keys):
    keys = tmp_path / "keys" if with_keys else None
    if keys:
        make_keys(keys)
    transport = Transport.from_options("127.0.0.1", keys)
    settings = ["duration=1.5", "run.pin=false", PATIENT, "event=[{at=0.5, pause=true}]"]  # until all have asked
    alone = run(prepare(SCENE, settings, out=tmp_path / "alone"), in_process=True)
    results, identities = [], []
    prepared = prepare(SCENE, settings, out=tmp_path / "out")
    thread = threading.Thread(
        target=lambda: results.append(run(prepared, transport=transport, on_started=identities.append))
    )
    thread.start()
    while not identities:
        thread.join(0.01)
    identity, _, address = identities[0].partition(" at ")
    assert address.startswith("tcp://127.0.0.1:")
    live = run_directory.find(identity)
    assert ask(live, "status")[1]["end"] == 1500
    assert find(Elsewhere(address, keys)).title == live.title
    if keys:
        with pytest.raises(RunNotFound, match="is guarded by keys"):
            find(Elsewhere(address, None))
        make_keys(tmp_path / "other")
        with pytest.raises(RunNotFound, match=r"refuses this key"):
            find(Elsewhere(address, stranger(keys, tmp_path / "other")))
    else:
        make_keys(tmp_path / "other")
        with pytest.raises(RunNotFound, match="has no keys"):
            find(Elsewhere(address, tmp_path / "other"))
    wait_for("standstill", lambda: ask(live, "status")[1]["paused"])
    ask(live, "resume")
    thread.join(PATIENCE_S)
    assert results[0]["trajectory_sha256"] == alone["trajectory_sha256"]


def stranger(keys: Path, other: Path) -> Path:
    """Somebody who knows the clock's public key but has a key of his own that nobody let in."""
    (other / "clock.key").write_bytes((keys / "clock.key").read_bytes())
    return other


def test_each_process_is_given_its_own_certificate_and_no_other(tmp_path):
    make_keys(tmp_path / "keys")
    launcher = Transport.from_options("127.0.0.1", tmp_path / "keys")
    told = {role: str(launcher.of(role).as_dict()) for role in PROCESSES}
    holders = {**{role: launcher.of(role).keys for role in PROCESSES}, "clock": launcher.keys}
    secrets = {holder: keys.secret for holder, keys in holders.items() if keys}
    assert len(set(secrets.values())) == 4
    for role, text in told.items():
        assert [holder for holder, secret in secrets.items() if secret in text] == [role]
    assert all(Transport.from_dict(launcher.of(role).as_dict()) == launcher.of(role) for role in PROCESSES)
