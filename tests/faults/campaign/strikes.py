"""Faults that strike a run of real processes: signals, strangers at its sockets, commands, visitors and a rival."""

from __future__ import annotations

import functools
import os
import random
import signal
import sys
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import zmq

from haploop.launch.processes import run_directory
from haploop.protocol.transport.messages import PROCESSES
from helpers.live import attacks
from helpers.live.launched import SCENE, Launched, Run, command
from helpers.live.system import processes
from helpers.live.waiting import wait_for

_CARRIED_OUT = (
    ("set", {"set": {"wall.stiffness": 120.0}}),
    ("set", {"set": {"wall.position": -0.04, "dissipation.0.mass": 0.005}}),
    ("swap", {"swap": {"kind": "damping", "damping": 0.5}}),
    *(("stop", {}), ("pause", {}), ("step", {"ticks": 50}), ("pace", {"pace": 5.0}), ("pace", {"pace": 50.0})),
)
_REFUSED = (*attacks.impossible_commands(), ("pace", {"pace": 1e305}), ("pace", {"pace": -1.0}))
_NOBODY = 2**22 + 1  # no process has this number


@dataclass
class Played:
    """One run, as what it may fail (``excuses``, patterns of sentences), and the kinds of faults that struck it.

    Attributes:
        took_s: wall time from the death of a node to the sentence that names it, and to the end of the run; None where
            none was killed.
    """

    run: Run
    deadline_s: float
    excuses: list[str]
    kinds: list[str] = field(default_factory=list)
    took_s: tuple[float, float] | None = None

    def live(self) -> run_directory.LiveRun | None:
        """The run as other terminals find it; None once it has ended."""
        found: list[run_directory.LiveRun] = []
        while self.run.is_there() and not found:
            found = [live for live in run_directory.live_runs() if live.pid == self.run.pid]
            time.sleep(0.03)
        return found[0] if found else None

    def draw_node(self, dice: random.Random) -> tuple[str, int]:
        """A role, and its process."""
        role = dice.choice(list(PROCESSES))
        own = (pid for pid, parent, _, at in processes() if parent == self.run.pid and PROCESSES[role].module in at)
        return role, next(own, _NOBODY)

    def ask(self, verb: str, arguments: Mapping[str, object]) -> str:
        """Why a command was refused, "" where it was carried out; one without an answer is excused by the end alone."""
        try:
            if live := self.live():
                run_directory.ask(live, verb, **arguments)
        except run_directory.CommandRefused as error:
            return str(error)
        except run_directory.RunNotFound:
            wait_for(f"the end of the run, which did not answer {verb},", lambda: not self.run.is_there())
        return ""


Strike = Callable[[Played, random.Random, run_directory.LiveRun], object]


def _signal(pid: int, number: signal.Signals) -> None:
    with suppress(ProcessLookupError):
        os.kill(pid, number)


def _stop(pid: int, seconds: float) -> None:
    _signal(pid, signal.SIGSTOP)
    time.sleep(seconds)
    _signal(pid, signal.SIGCONT)


def _kill_a_node(played: Played, dice: random.Random, live: run_directory.LiveRun) -> None:
    role, pid = played.draw_node(dice)
    sentence = f"The {role} was killed by SIGKILL; the last tick all nodes had done is "
    played.excuses.append(sentence)
    struck = time.monotonic()
    _signal(pid, signal.SIGKILL)
    wait_for("the end of the run", lambda: sentence in played.run.stderr or not played.run.is_there())
    if sentence in played.run.stderr:  # else it had ended before
        named_s = time.monotonic() - struck
        wait_for("the end of the run", lambda: not played.run.is_there())
        played.took_s = named_s, time.monotonic() - struck


def _stop_a_node(played: Played, dice: random.Random, live: run_directory.LiveRun) -> None:
    _, pid = played.draw_node(dice)
    _stop(pid, dice.uniform(0.1, 2.0))


def _interrupt(played: Played, dice: random.Random, live: run_directory.LiveRun) -> None:
    played.excuses.append("Interrupted")
    for _ in range(dice.choice((1, 1, 2))):
        _signal(played.run.pid, signal.SIGINT)
        time.sleep(dice.choice((0.0, 0.1)))


def _sockets(live: run_directory.LiveRun) -> Path:
    assert live.sockets
    return live.sockets


def _junk(played: Played, dice: random.Random, live: run_directory.LiveRun) -> None:
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    for name in dice.sample(attacks.SOCKETS, 2):
        attacks.send_unasked(context, _sockets(live) / f"{name}.sock")
    time.sleep(0.3)
    context.destroy(linger=0)


def _flood(played: Played, dice: random.Random, live: run_directory.LiveRun) -> None:
    flood = [sys.executable, attacks.__file__, str(live.sockets)]
    pid = os.posix_spawn(flood[0], flood, os.environ, file_actions=[(os.POSIX_SPAWN_CLOSE, 1)])
    time.sleep(dice.uniform(0.4, 1.0))
    _signal(pid, signal.SIGKILL)
    os.waitpid(pid, 0)


def _false_join(played: Played, dice: random.Random, live: run_directory.LiveRun) -> None:
    """A wrong secret, no endpoints, or an observer or second logger that is welcomed and then says no more."""
    half = [attacks.pack(1, 1, role, "", _NOBODY, {}, lossless, {}) for role, lossless in (("a", False), ("b", True))]
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    with attacks.Stranger(context, _sockets(live) / "clock.sock") as stranger:
        for frame in dice.sample([*attacks.false_joins(), *half], 4):
            stranger.socket.send(frame)
        time.sleep(dice.uniform(0.1, 1.0))
    context.destroy(linger=0)


def _commands(played: Played, dice: random.Random, live: run_directory.LiveRun) -> None:
    for verb, arguments in dice.choices(_CARRIED_OUT, k=dice.randint(1, 3)):
        played.ask(verb, arguments)
        time.sleep(dice.uniform(0, 0.2))
    played.ask("resume", {})


def _refused(played: Played, dice: random.Random, live: run_directory.LiveRun) -> None:
    for verb, arguments in dice.choices(_REFUSED, k=8):
        if isinstance(arguments, dict) and all(isinstance(key, str) for key in arguments):
            refused = played.ask(verb, arguments)
            assert refused or not played.run.is_there(), f"{verb} {arguments!r:.200} was carried out"


def _visit(what: str, played: Played, dice: random.Random, live: run_directory.LiveRun) -> None:
    out = played.run.out_directory.parent / what if what == "logger" else None
    visitor = Launched("attach", what, "--run", live.id, out=out)
    try:
        time.sleep(dice.uniform(0.3, 1.5))
        visitor.signal(dice.choice((signal.SIGCONT, signal.SIGINT, signal.SIGKILL, signal.SIGSTOP)))
        wait_for("the end of the run", lambda: not played.run.is_there())
        visitor.signal(signal.SIGCONT)
        wait_for("the end of the visitor", lambda: not visitor.is_there())
        # Before ``main`` is reached, Ctrl-C is told in Python's own words.
        assert not ("Traceback" in visitor.stderr and ", in main" in visitor.stderr), visitor.stderr
    finally:
        visitor.clear_away()


def _rival(played: Played, dice: random.Random, live: run_directory.LiveRun) -> None:
    done = command("run", str(SCENE), "--out", str(played.run.out))
    refused = done.returncode == 2 and "must be new or empty" in done.stderr
    assert refused or "nothing is left of it" in played.run.stderr, done.stderr


def _status(played: Played, dice: random.Random, live: run_directory.LiveRun) -> None:
    done = command("status", *dice.choice(((), ("--json",))))
    assert (done.returncode, "Traceback" in done.stderr) == (0, False), done.stderr


STRIKES: dict[str, Strike] = {
    "a node killed": _kill_a_node,
    "a node stopped, 0.1 to 2 s": _stop_a_node,
    "the launcher stopped, 0.1 to 2 s": lambda played, dice, _: _stop(played.run.pid, dice.uniform(0.1, 2.0)),
    "the launcher killed": lambda played, *_: _signal(played.run.pid, signal.SIGKILL),
    "Ctrl-C, once or twice": _interrupt,
    "junk at two sockets": _junk,
    "a flood at all sockets": _flood,
    "a JOIN that is false or half": _false_join,
    "commands carried out": _commands,
    "commands refused": _refused,
    "`attach print`, with a fate": functools.partial(_visit, "print"),
    "`attach logger`, with a fate": functools.partial(_visit, "logger"),
    "another run for the directory": _rival,
    "`haploop status`": _status,
}
