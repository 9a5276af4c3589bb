"""A run across two hosts: the bits of one, however late and lossy the network; cut for good, it ends on both sides."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from haploop.protocol.transport.keys import make_keys
from helpers.live.launched import HAPLOOP, PATIENT, SCENE
from helpers.live.system import alive
from helpers.live.two_hosts import A6, A, Wire, on, two_hosts, why_not
from helpers.live.waiting import PATIENCE_S, wait_for

pytestmark = pytest.mark.slow
FAR_AND_LOSSY = {"delay_s": 0.01, "loss": 0.01}
PORT = 5550


class Hosts:
    """Two hosts: ``a`` has the run and all keys, ``b`` the two files that a client is given."""

    def __init__(self, wire: Wire, directory: Path, address: str) -> None:
        self.wire, self.directory = wire, directory
        host = f"[{address}]" if ":" in address else address
        self.at = ("--at", f"{host}:{PORT}", "--keys", str(directory / "copy"))
        self._tcp = ("--tcp", f"{host}:{PORT}", "--keys", str(directory / "keys"))
        self.begun: list[subprocess.Popen[str]] = []
        make_keys(directory / "keys")
        (directory / "copy").mkdir(mode=0o700)
        for name in ("clock.key", "client.key_secret"):
            (directory / "copy" / name).write_bytes((directory / "keys" / name).read_bytes())
            (directory / "copy" / name).chmod(0o600)

    def begin(self, host: str, *words: str) -> subprocess.Popen[str]:
        pipe = subprocess.PIPE
        process = subprocess.Popen(on(host, list(words)), stdout=pipe, stderr=pipe, text=True)
        self.begun.append(process)
        return process

    def run(self, *words: str, sets: tuple[str, ...] = ()) -> subprocess.Popen[str]:
        """Begins a run on host a."""
        settings = [word for assignment in ("run.verdict=window", PATIENT, *sets) for word in ("--set", assignment)]
        out = ("--out", str(self.directory / "out"), "--json")
        return self.begin("a", *HAPLOOP, "run", str(SCENE), *settings, *self._tcp, *out, *words)

    def command(self, *words: str) -> subprocess.CompletedProcess[str]:
        """A command from host b, to its end."""
        return subprocess.run(on("b", [*HAPLOOP, *words, *self.at]), capture_output=True, text=True, timeout=PATIENCE_S)

    def answers(self) -> bool:
        return self.command("status").returncode == 0


@pytest.fixture
def hosts(request, tmp_path, live_runs_here, record_property) -> Iterator[Hosts]:
    if why := why_not():
        pytest.skip(f"no two hosts here: {why}")
    asked = {"address": A, **getattr(request, "param", {})}
    address = asked.pop("address")
    with two_hosts(**asked) as wire:
        record_property("wire", wire.by)
        print(f"Packets are delayed and lost by {wire.by}.")
        made = Hosts(wire, tmp_path, address)
        try:
            yield made
        finally:
            for process in made.begun:
                if process.poll() is None:
                    process.kill()
                process.communicate()


def bits_of(*sets: str, directory: Path, event: str = "") -> str:
    """The trajectory hash of the same scene in one process."""
    scene = directory / "alone.toml"
    scene.write_text(f'extends = "{SCENE}"\n{event}\n')
    settings = [word for assignment in ("run.verdict=window", PATIENT, *sets) for word in ("--set", assignment)]
    words = [*HAPLOOP, "run", str(scene), *settings, "--in-process", "--json", "--out", str(directory / "alone")]
    return json.loads(subprocess.run(words, capture_output=True, check=True).stdout)["trajectory_sha256"]


def join_from(hosts: Hosts, role: str, base: Path) -> subprocess.Popen[str]:
    """Takes part from host b in the run on host a that waits, by a copy of the file it wrote."""
    file = wait_for("the file", lambda: next(iter(base.glob(f"haploop/*/external-{role}.json")), None))
    wait_for("what it says", file.read_text)
    copy = hosts.directory / "copy" / file.name
    copy.write_bytes(file.read_bytes())
    return hosts.begin("b", *HAPLOOP, "join", str(copy))


@pytest.mark.parametrize("role", ["controller", "plant"])
@pytest.mark.parametrize("hosts", [FAR_AND_LOSSY], indirect=True)
def test_half_of_the_loop_on_another_host_gives_the_same_bits_behind_delay_and_loss(
    hosts, role, tmp_path, live_runs_here
):
    run = hosts.run("--external", role, sets=("duration=0.6",))
    node = join_from(hosts, role, live_runs_here)
    said, complaint = run.communicate(timeout=4 * PATIENCE_S)
    assert run.returncode == 0, complaint
    assert json.loads(said)["trajectory_sha256"] == bits_of("duration=0.6", directory=tmp_path)
    assert node.wait(PATIENCE_S) == 0
    assert hosts.wire.lost > 0


@pytest.mark.parametrize("role", ["controller", "plant"])
def test_a_network_that_is_cut_for_good_ends_the_run_on_both_sides_and_leaves_nothing(hosts, role, live_runs_here):
    run = hosts.run("--external", role, "--pace", "1", sets=("duration=600", "run.deadline=5"))
    node = join_from(hosts, role, live_runs_here)
    wait_for("the run to go on", lambda: "3.0" in hosts.command("status", "--json").stdout or hosts.answers())
    hosts.wire.is_cut = True
    said, complaint = run.communicate(timeout=PATIENCE_S)
    assert run.returncode == 1, said
    assert f"The {role} (external)" in complaint, complaint
    print(complaint)
    assert (hosts.directory / "out/log.mcap").exists()
    _, why = node.communicate(timeout=PATIENCE_S)
    assert node.returncode == 1
    assert "Nothing has come from the run at" in why
    wait_for("the end of all processes", lambda: not alive([run.pid, node.pid]))
    assert list((live_runs_here / "haploop").iterdir()) == []


@pytest.mark.parametrize(
    "hosts", [FAR_AND_LOSSY, {"address": A6}, {"delay_s": 0.2}], indirect=True, ids=["lossy", "ipv6", "far"]
)
def test_a_run_is_steered_and_logged_from_another_host_and_keeps_its_bits(hosts, tmp_path):
    run = hosts.run(sets=("duration=12", "event=[{at=0.5, pause=true}]"))
    wait_for("an answer", hosts.answers)
    changed = hosts.command("set", "wall.stiffness=140", "--at", "11.5")
    assert (changed.returncode, changed.stderr) == (0, ""), changed.stderr
    logger = hosts.begin("b", *HAPLOOP, "attach", "logger", "--out", str(tmp_path / "attached"), *hosts.at)
    wait_for("its log", (tmp_path / "attached/log.mcap").exists)
    assert hosts.command("resume").returncode == 0
    summary = json.loads(run.communicate(timeout=4 * PATIENCE_S)[0])
    _, complaint = logger.communicate(timeout=PATIENCE_S)
    assert logger.returncode == 0, complaint
    attached = json.loads((tmp_path / "attached/summary.json").read_text())
    assert (attached["from_tick"] + attached["ticks"], attached["ended"]) == (12000, "done")
    assert attached["final"] == summary["final"]
    event = '[[event]]\nat = 11.5\nset = { "wall.stiffness" = 140.0 }'
    assert summary["trajectory_sha256"] == bits_of("duration=12", directory=tmp_path, event=event)


def test_who_watches_from_another_host_is_told_that_the_network_was_cut_and_the_run_goes_on(hosts, tmp_path):
    run = hosts.run("--pace", "1", sets=("duration=600",))
    wait_for("an answer", hosts.answers)
    watching = hosts.begin("b", *HAPLOOP, "attach", "print", *hosts.at)
    logging = hosts.begin("b", *HAPLOOP, "attach", "logger", "--out", str(tmp_path / "attached"), *hosts.at)
    wait_for("its log", (tmp_path / "attached/log.mcap").exists)
    assert watching.stdout
    assert watching.stdout.readline()
    hosts.wire.is_cut = True
    for process in (watching, logging):
        _, complaint = process.communicate(timeout=PATIENCE_S)
        assert process.returncode == 1, complaint
        assert "Nothing has come from the run at" in complaint
    refused = hosts.command("status")
    assert (refused.returncode, refused.stdout) == (2, "")
    assert "Nothing comes back from" in refused.stderr
    stopped = subprocess.run(on("a", [*HAPLOOP, "stop"]), capture_output=True, text=True, env=dict(os.environ))
    assert stopped.returncode == 0
    assert json.loads(run.communicate(timeout=PATIENCE_S)[0])["ended"] == "stopped"
