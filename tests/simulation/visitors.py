"""Visitors of a run: people with commands, observers and second loggers, strangers and impostors."""

from __future__ import annotations

import contextlib
import os
import random
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import zmq

from haploop.launch.processes.run_directory import CommandRefused, LiveRun, RunNotFound, ask
from haploop.launch.spec import OutputError
from haploop.logger.books.buffers import TelemetryGap
from haploop.logger.node import LoggerNode
from haploop.protocol.transport.clock_client import Aborted, ClockClient, Refused
from haploop.protocol.transport.messages import PROCESSES
from haploop.protocol.transport.observer import Observer
from haploop.protocol.transport.wire import encode
from haploop.view.receive.run_session import RunSession
from helpers.live.attacks import false_joins, junk, out_of_place
from helpers.live.browsing import NoRuns
from simulation.computer.world import Process
from simulation.faults import Fault

if TYPE_CHECKING:
    from simulation.sim import Sim

_LOOK_S = 0.2
_STOPPED_S = {"stopped": 5.0, "held": 1.3}
_PYTHONS_WORDS = re.compile(r"\b[A-Z]\w*(Error|Exception)\b")
_NO_PID = 2**22 + 1
_JUNK = [*junk(), *out_of_place(), *false_joins(), *(encode("PROGRESS", tick, {}) for tick in range(0, 70, 5))]


class Live(LiveRun):
    """A simulated run as another terminal finds it: its launcher lives as long as the simulated one does."""

    def __init__(self, sim: Sim, process: Process) -> None:
        run = sim.run
        super().__init__(run.sockets.name, run.sockets, os.getpid(), run.clock, "", str(sim.out))
        object.__setattr__(self, "_visit", (sim, process))

    def __getattribute__(self, name: str) -> Any:
        if name == "pid" and not object.__getattribute__(self, "_visit")[0].run.launcher.alive:
            return _NO_PID
        return super().__getattribute__(name)

    def make_context(self) -> Any:
        sim, process = object.__getattribute__(self, "_visit")
        return sim.run.context(process)


@dataclass(frozen=True)
class Visit(Fault):
    """A process of its own that comes to the run; ``fate`` (what, after how many seconds) may befall it there.

    Fates: ``stays``, ``leaves``, ``killed``, ``stopped`` for 5 s, longer than the run's deadline, ``held`` for less.
    """

    fate: tuple[str, float]

    @property
    def lasts_s(self) -> float:
        return 12.0

    def happen(self, sim: Sim) -> None:
        if not sim.run.launcher.alive or not sim.run.clock:
            return
        name = f"{type(self).__name__.lower()} {len(sim.visitors)}"
        process = Process(sim.world, name, lambda: self.visit(sim, process))
        sim.visitors.append(process)
        what, after_s = self.fate
        if what == "killed":
            sim.world.after(after_s, process.kill)
        elif what in _STOPPED_S:
            sim.world.after(after_s, process.stop, _STOPPED_S[what])

    def time_to_leave(self, sim: Sim) -> Callable[[], bool]:
        leaves_at = sim.world.now + self.fate[1] if self.fate[0] == "leaves" else float("inf")
        return lambda: sim.world.now >= leaves_at

    def visit(self, sim: Sim, process: Process) -> None:
        raise NotImplementedError


@dataclass(frozen=True)
class Commands(Visit):
    """Commands one after another, each with a wait behind it, s; what stops time is followed by what lets it go on."""

    commands: tuple[tuple[str, dict[str, Any], float], ...]

    @property
    def lasts_s(self) -> float:
        return sum(5.5 + wait_s for _, _, wait_s in self.commands)

    def visit(self, sim: Sim, process: Process) -> None:
        live = Live(sim, process)
        for verb, arguments, wait_s in self.commands:
            try:
                text, _ = ask(live, verb, **arguments)
                sim.world.note(f"{verb}: {text}")
            except CommandRefused as error:
                sim.world.note(f"{verb} refused: {error}")
                if _PYTHONS_WORDS.search(str(error)):
                    sim.watch.fail(f"{verb} {arguments!r:.80} was refused in Python's words: {error}")
            except RunNotFound:
                if not sim.run.launcher.alive:
                    return
                if not sim.is_held_up("launcher"):
                    sim.watch.fail(f"the command {verb} was not answered within 5 s")
            process.sleep(wait_s)


@dataclass(frozen=True)
class Listener(Visit):
    """An observer that may miss something, or the viewer's session of a run."""

    is_viewer: bool
    every_s: float

    def visit(self, sim: Sim, process: Process) -> None:
        live, leave = Live(sim, process), self.time_to_leave(sim)
        while sim.run.launcher.alive and not leave():
            try:
                self._follow(sim, process, live, leave)
                return
            except (Refused, Aborted) as error:
                sim.world.note(f"{process.name}: {error}")
                process.sleep(_LOOK_S)

    def _follow(self, sim: Sim, process: Process, live: Live, leave: Callable[[], bool]) -> None:
        if self.is_viewer:
            session = RunSession(_Only(live), live)
            while not session.outcome and not leave():
                session.poll()
                process.sleep(self.every_s)
                if not sim.run.launcher.alive:
                    session.end_without_launcher()
            session.close()
            sim.shown.append((process.name, session.outcome))
            return
        context = live.make_context()
        try:
            observer = Observer(context, "print", live.clock, tuple(PROCESSES))
            while sim.run.launcher.alive and len(observer.ended) < len(PROCESSES) and not leave():
                observer.poll()
                observer.wait(int(1000 * self.every_s))
            sim.heard.append((process.name, observer.take_events()))
            observer.leave()
        finally:
            context.destroy(linger=200)


class _Only(NoRuns):
    """One live run, and nobody who steers it."""

    def __init__(self, run: LiveRun) -> None:
        super().__init__()
        self._run = run

    def live(self) -> list[Any]:
        return [self._run]


@dataclass(frozen=True)
class SecondLogger(Visit):
    """A second logger, lossless, with a directory of its own: nothing may escape it."""

    def visit(self, sim: Sim, process: Process) -> None:
        live, leave = Live(sim, process), self.time_to_leave(sim)
        out = Path(f"{sim.out}-{len(sim.visitors)}")
        out.mkdir()
        sim.watch.lossless.add(process)
        while sim.run.launcher.alive and not leave():
            context = live.make_context()
            client = ClockClient(context, "logger 2", live.clock, "")
            node = LoggerNode(client, context, None, lambda: self._why(sim, leave))
            try:
                node.start(client.join({}), out)
                tick, summary = node.run()
                client.leave("LEAVE", tick)
                is_owed_all = process in sim.watch.followed and self.fate[0] != "stopped" and not leave()
                sim.second_logs.append((out, summary, is_owed_all))
                return
            except Refused:
                process.sleep(_LOOK_S)
            except (Aborted, TelemetryGap) as error:
                node.save(str(error))
                if not leave() and self.fate[0] != "stopped" and not sim.may_fail and sim.run.launcher.alive:
                    sim.watch.fail(f"a second logger that kept up was sent away: {error}")
                return
            finally:
                context.destroy(linger=500)

    def _why(self, sim: Sim, leave: Callable[[], bool]) -> str | None:
        if leave():
            return ""
        return None if sim.run.launcher.alive else "The launcher has ended without a word."


@dataclass(frozen=True)
class Stranger(Visit):
    """Junk, messages out of place and false joins, to any socket of the run, at once or a flood of them."""

    socket: str
    count: int
    seed: int

    def visit(self, sim: Sim, process: Process) -> None:
        dice = random.Random(self.seed)
        sender = sim.run.context(process).socket(zmq.XSUB if self.socket in PROCESSES else zmq.DEALER)
        sender.connect(f"ipc://{sim.run.sockets / self.socket}.sock")
        process.sleep(0.001)
        for _ in range(self.count):
            many = dice.choices(_JUNK, k=dice.randint(1, 4)) if dice.random() < 0.1 else [dice.choice(_JUNK)]
            if next(iter(sender.pipes.values())).there.is_full:
                break
            sender.send_multipart(many)
            if self.count < 50:
                process.sleep(dice.random() * 1e-3)
        process.sleep(0.5)
        sender.close(0)


@dataclass(frozen=True)
class Rival(Fault):
    """Another launcher that wants the same directory at the same instant; only one may have it."""

    def happen(self, sim: Sim) -> None:
        sim.visitors.append(Process(sim.world, "rival", lambda: self._claim(sim)))

    def _claim(self, sim: Sim) -> None:
        with contextlib.suppress(OutputError):
            sim.claim("rival")


@dataclass(frozen=True)
class Impostor(Visit):
    """Knows the run's secret, and joins under the name of one of its own processes with nothing that one must bring."""

    role: str

    def visit(self, sim: Sim, process: Process) -> None:
        context = sim.run.context(process)
        sender = context.socket(zmq.DEALER)
        sender.connect(sim.run.clock)
        sender.send(encode("JOIN", self.role, sim.run.secret, 1, {}, True, {}))
        process.sleep(1.0)
        context.destroy(linger=0)
