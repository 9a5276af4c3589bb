"""Runs as a user starts them, each in its own process, and what a test sees of them from outside."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from haploop.launch.processes import private_directory, run_directory
from haploop.logger import read
from haploop.logger.log import LogError
from haploop.logger.log.recording import Recording
from haploop.protocol.transport.messages import PROCESSES
from helpers.live.system import alive, on_a_disk_of, processes, where
from helpers.live.waiting import PATIENCE_S, wait_for

SCENES = Path(__file__).parents[3] / "launch/scenes"
SCENE = SCENES / "fig6c.toml"
HAPLOOP = [sys.executable, "-m", "haploop.tools.cli"]
# No process is silent for so long, however busy the machine; the deadline of every run whose deadline is not tested.
PATIENT = "run.deadline=30"
# For a run with a process that stays silent: long enough that no other process is blamed on a busy machine.
BRIEF_S = 3
BRIEF = f"run.deadline={BRIEF_S}"
# So long that the run surely continues while a test does something to it.
LONG = ("duration=600",)
# The processes start, but the first tick does not come.
AT_REST = (*LONG, "event=[{at=0, pause=true}]")
PACE = ("--pace", "5")
ROLES = tuple(PROCESSES)


def log_so_far(directory: Path) -> Mapping[str, Any]:
    """Returns the channels that can be read of a log while it is written; none before its first bytes are there."""
    with contextlib.suppress(FileNotFoundError, LogError):
        return read(directory)
    return {}


def command(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Runs a haploop command to its end, as from another terminal."""
    return subprocess.run([*HAPLOOP, *arguments], capture_output=True, text=True, timeout=PATIENCE_S)


def same_bits(log: Recording, truth: Recording) -> int:
    """Asserts that every number of a log is the undisturbed run's, bit for bit; returns its ticks of the controller."""
    for topic, names in (("/plant", ("timestamp", "x", "v")), ("/controller", ("timestamp", "x", "v", "a", "total"))):
        for name in names if topic in log else ():
            shared = min(len(log[topic][name]), len(truth[topic][name]))
            assert log[topic][name][:shared].tobytes() == truth[topic][name][:shared].tobytes(), (topic, name)
    return len(log["/controller"]["x"]) if "/controller" in log else 0


class Launched:
    """``haploop`` with some arguments as a process.

    Attributes:
        out: the directory named by ``--out``, or None.
        took_s: wall time from the last ``signal`` or ``kill`` to the end, for people who read the output.
    """

    def __init__(self, *arguments: str, out: Path | None = None, disk_bytes: int | None = None) -> None:
        self.out = out
        command = [*HAPLOOP, *arguments, *(("--out", str(out)) if out else ())]
        self._said = tempfile.TemporaryFile()  # noqa: SIM115 (it goes with this object)
        command = on_a_disk_of(disk_bytes, command) if disk_bytes else command
        self._process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=self._said, text=True)
        self.pid = self._process.pid
        self.nodes: dict[str, int] = {}
        self._since = time.monotonic()

    @property
    def stderr(self) -> str:
        """Its standard error so far, including that of its nodes."""
        return os.pread(self._said.fileno(), 1_000_000, 0).decode()

    def says(self, words: str) -> None:
        """Waits until its standard error contains some words."""
        wait_for(words, lambda: words in self.stderr)

    def signal(self, number: signal.Signals) -> None:
        """Sends a signal to the process itself."""
        self._since = time.monotonic()
        self._process.send_signal(number)

    def stood_for(self, seconds: float) -> bool:
        """Tells whether that much time has passed since the last signal."""
        return time.monotonic() - self._since >= seconds

    def is_there(self) -> bool:
        """Tells whether the process has not ended yet."""
        return self._process.poll() is None

    @property
    def status(self) -> int | None:
        """Its exit status, None while it runs."""
        return self._process.poll()

    def end(self, status: int | None) -> str:
        """Waits for the end, which must come with this exit status; returns stdout."""
        try:
            stdout, _ = self._process.communicate(timeout=PATIENCE_S)
        except subprocess.TimeoutExpired:
            raise AssertionError(f"haploop has not ended; it said: {self.stderr}\n{where(self.pid)}") from None
        self.took_s = time.monotonic() - self._since
        print(f"ended {self.took_s:.2f} s later: {self.stderr[-400:]}")
        assert self._process.returncode == status, self.stderr
        return stdout

    def summary(self) -> dict[str, Any]:
        """Waits for the end, which must be exit status 0; returns the summary that ``--json`` prints."""
        return json.loads(self.end(0))

    def clear_away(self) -> None:
        """Leaves no process behind, however the test went."""
        for pid in (*self.nodes.values(), self.pid):
            if pid != self.pid or self._process.poll() is None:
                try:
                    os.kill(pid, signal.SIGKILL)
                except ProcessLookupError:
                    continue
        self._process.communicate()
        self._said.close()


class Run(Launched):
    """``haploop run`` as a process, and its nodes.

    Attributes:
        nodes: pid by role, once ``nodes_started`` or ``reaches`` has returned.
    """

    def __init__(
        self,
        out: Path,
        *arguments: str,
        scene: Path = SCENE,
        sets: Sequence[str] = LONG,
        pace: Sequence[str] = PACE,
        **more: Any,
    ) -> None:
        sets = ("run.verdict=window", PATIENT, *sets)
        options = [word for assignment in sets for word in ("--set", assignment)]
        super().__init__("run", str(scene), *options, *pace, *arguments, "--json", out=out, **more)

    @property
    def out_directory(self) -> Path:
        assert self.out
        return self.out

    @property
    def live(self) -> run_directory.LiveRun:
        """The run as other terminals find it."""
        return wait_for("the run", lambda: next((r for r in run_directory.live_runs() if r.pid == self.pid), None))

    def nodes_started(self, *roles: str) -> None:
        """Waits until there is a process for each role, by its command line, whatever it is doing."""
        modules = {role: PROCESSES[role].module for role in roles or ROLES}

        def look() -> bool:
            for pid, parent, _, command in processes():
                for role, module in modules.items():
                    if parent == self.pid and module in command:
                        self.nodes[role] = pid
            return modules.keys() <= self.nodes.keys()

        wait_for(f"a process for {', '.join(modules)}", look)

    def ask(self, verb: str, **arguments: Any) -> dict[str, Any]:
        """Sends a command as from another terminal; returns the data of its answer."""
        return run_directory.ask(self.live, verb, **arguments)[1]

    def reaches(self, tick: int) -> int:
        """Waits until all nodes have done the ticks before ``tick``; returns how far they are."""

        def look() -> int:
            if self._process.poll() is not None:
                raise AssertionError(f"the run has ended: {self.stderr}")
            nodes = [node for node in self.ask("status")["nodes"] if node["role"] in PROCESSES]
            self.nodes = {node["role"]: node["pid"] for node in nodes}
            done = min((node["tick"] for node in nodes), default=0)
            return done if len(nodes) == len(PROCESSES) and done >= tick else 0

        return wait_for(f"tick {tick}", look)

    def has_logged(self, ticks: int) -> int:
        """Waits until ``ticks`` ticks can be read from the log while the run continues; returns how many."""
        self.reaches(ticks)

        def look() -> int:
            log = log_so_far(self.out_directory)
            return len(log["/controller"]["x"]) if "/controller" in log else 0

        return wait_for("a flushed log", lambda: found if (found := look()) >= ticks else 0)

    def log(self) -> Recording:
        """Its log as it is now."""
        return read(self.out_directory)

    def stands(self, at: int | None = None) -> int:
        """Waits until a paused run stands still, all nodes at the same tick (at ``at``, if given); returns it."""

        def look() -> int:
            data = self.ask("status")
            tick = data["granted"]
            still = data["paused"] and {node["tick"] for node in data["nodes"]} == {tick}
            return tick + 1 if still and at in (None, tick) else 0

        return wait_for("standstill", look) - 1

    def send(self, role: str, number: signal.Signals) -> None:
        """Sends a signal to a node."""
        self._since = time.monotonic()
        os.kill(self.nodes[role], number)

    def leaves_nothing(self) -> None:
        """Asserts that no process of the run is left, and none of its sockets."""
        pids = [self.pid, *self.nodes.values()]
        wait_for("the end of all processes", lambda: not alive(pids))
        assert list(private_directory.base_directory().iterdir()) == []
