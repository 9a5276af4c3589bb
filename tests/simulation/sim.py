"""One run in virtual time with all that happens to it, judged by what haploop promises."""

from __future__ import annotations

import json
import re
import traceback
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from haploop.launch.processes.supervisor import run_processes
from haploop.launch.spec import OutputError, RunFailed, RunSpec, make_output
from haploop.logger.log import LogError
from haploop.protocol.changes import Event
from haploop.protocol.ticks import Timebase
from helpers.scenes.least import KINDS
from simulation.computer.machine import Disk, SimRun
from simulation.computer.world import Process, Stuck, World
from simulation.faults import Fault, Kill, Signals
from simulation.plan import Plan
from simulation.plugins import Reload, broken_kept, with_plugin
from simulation.reference import DEADLINE_S, difference, logged_ticks, scene_of, second_difference
from simulation.watch import Watch

# What the start may take, and what a run may take to end after all that held it up.
_START_S, _PATIENCE_S = 20.0, 30.0
_NAMED_WITHIN_S, _HUNG_WITHIN_S, _ENDED_WITHIN_S = 1.05, 1.3, 3.5
# A logger that was killed leaves on disk what it had reported so long before: its log is flushed every 0.4 s, at the
# next turn, which comes after 0.2 s at most.
_FLUSHED_WITHIN_S = 0.65
_PYTHONS_WORDS = re.compile(
    r"failed: [A-Z]\w*(Error|Exception|Interrupt|Exit)\b|Traceback|unexpected keyword|object has no"
)


class Sim:
    """A run in virtual time with all that happens to it.

    Attributes:
        out: the run's directory.
        visitors: processes that came to the run.
        owners: who was given the directory.
        heard: (observer, events) of those that took part to the end.
        shown: (viewer, outcome) likewise.
        second_logs: directory and summary of second loggers that ended in order, and whether each was owed all of it.
        killed_at, stopped_at: role -> time at which its process was killed, or last stopped.
        may_fail: whether anything has happened that may end the run.
    """

    def __init__(self, plan: Plan, directory: Path) -> None:
        self.plan = plan
        self.scene = scene_of(plan.scene)
        self.out = directory / "out"
        self.owners: list[str] = []
        self.heard: list[tuple[str, list[tuple[int, Event]]]] = []
        self.shown: list[tuple[str, str]] = []
        self.second_logs: list[tuple[Path, dict[str, Any], bool]] = []
        self.world = World(plan.seed, plan.jumpiness, plan.latency_s)
        self.watch = Watch(Timebase.from_scene(self.scene).window_ticks(self.scene.run))
        self.run = SimRun(self.world, self.watch, Disk(), dict(plan.starts_s))
        self.visitors: list[Process] = []
        self.killed_at: dict[str, float] = {}
        self.stopped_at: dict[str, float] = {}
        self.happened: list[Fault] = []
        self._busy_until = self.world.now
        for fault in plan.faults:
            fault.prepare(self)
            if fault.when.tick < 0:
                self._busy_until = max(self._busy_until, self.world.now + fault.when.delay_s + fault.lasts_s)

    def let_happen(self, fault: Fault) -> None:
        self.world.note(str(fault))
        self._busy_until = max(self._busy_until, self.world.now + fault.lasts_s)
        self.happened.append(fault)
        fault.happen(self)

    def process(self, role: str) -> Process:
        return self.run.launcher if role == "launcher" else self.run.nodes[role]

    def is_held_up(self, role: str) -> bool:
        return self.silence(role) > 1.0

    def silence(self, role: str) -> float:
        return sum(fault.silences(role) for fault in self.plan.faults)

    @property
    def may_fail(self) -> bool:
        return any(self._excuses())

    @property
    def was_in_order(self) -> bool:
        return self.run.launcher.error is None and self.run.launcher.status == 0

    @property
    def failing(self) -> bool:
        return self.run.named_at is not None

    def _excuses(self) -> Iterator[str]:
        yield from (fault.excuse for fault in self.plan.faults if fault.excuse)
        if sum(fault.count for fault in self.plan.faults if isinstance(fault, Signals)) > 1:
            yield "KeyboardInterrupt"
        for role in self.run.nodes:
            silence_s = self.silence(role)
            if silence_s > 0.6 * DEADLINE_S:
                yield f"The {role} has not answered for {DEADLINE_S:g} s and was ended"
            if silence_s > 0.6 * _START_S or self.run.starts_s[role] > 0.9 * _START_S:
                yield f"The {role} (has not answered for|did not join within) {_START_S:g} s"

    def claim(self, who: str) -> None:
        """Takes the run's directory; raises OutputError where it is taken."""
        make_output(self.out, Path("scene.toml"))
        self.owners.append(who)

    def launch(self, run: SimRun) -> Any:
        self.claim("launcher")
        spec = RunSpec(self.scene, dict(KINDS), self.out, pace=self.plan.pace)
        if any(isinstance(fault, Reload) for fault in self.plan.faults):
            with_plugin(spec)
        return run_processes(spec, run.make_context, run.start_nodes, run.interrupts)

    def play(self) -> None:
        """Runs to the end of the run and of all who came to it, or to the first broken promise."""
        launcher = self.run.launch(self.launch)
        try:
            self.world.run(lambda: bool(self.watch.broken) or not launcher.alive, self._until)
            self.over_at = self.world.now
            left = [*self.visitors, *self.run.nodes.values()]
            if not self.watch.broken:
                self._busy_until = self.world.now
                self.world.run(lambda: bool(self.watch.broken) or not any(p.alive for p in left), self._until)
        except Stuck as error:
            self.watch.fail(f"the run does not end: {error}")

    def _until(self) -> float:
        return self._busy_until + _PATIENCE_S

    def judge(self, reads_log: bool) -> str:
        """Returns the first promise that was broken, "" for none."""
        growing = self.watch.holdings.growing
        for check in (self._how_it_ended, self._when_it_ended, self._what_is_left, self._visitors_went_well, growing):
            if not self.watch.broken and (broken := check()):
                self.watch.fail(broken)
        if not self.watch.broken and (broken := self._files(reads_log)):
            self.watch.fail(broken)
        return self.watch.broken

    def _how_it_ended(self) -> str:
        if len(self.owners) > 1:
            return "two runs have one directory"
        error = self.run.launcher.error
        if error is None:  # in order, or killed, which nothing but a fault does
            return ""
        if isinstance(error, OutputError) and self.owners == ["rival"]:
            return ""
        said = "KeyboardInterrupt" if isinstance(error, KeyboardInterrupt) else str(error)
        if not isinstance(error, RunFailed | LogError | KeyboardInterrupt):
            return "the launcher ended with a traceback:\n" + "".join(traceback.format_exception(error))
        if _PYTHONS_WORDS.search(said):
            return f"the run ended with Python's words: {said}"
        if not any(re.match(pattern, said) for pattern in self._excuses()):
            return f"the run failed, though nothing happened that excuses it: {said}"
        return ""

    def _when_it_ended(self) -> str:
        spare_s = self.run.launcher.stopped_s + self.silence("launcher")
        for role, at in self.killed_at.items():
            if self.run.launcher.error is None:
                continue
            if self.run.named_at is None or self.run.named_at > at + _NAMED_WITHIN_S + spare_s:
                return f"the {role} was killed, and not named within {_NAMED_WITHIN_S:g} s"
            if self.over_at > at + _ENDED_WITHIN_S + spare_s:
                return f"the {role} was killed, and the run went on for {self.over_at - at:.1f} s"
        for role, at in self.stopped_at.items():
            late_s = (self.run.named_at or at) - at - DEADLINE_S
            named = re.match(f"The {role} has not answered for {DEADLINE_S:g} s", str(self.run.launcher.error))
            alone = sum(fault.silences(role) > 0.0 for fault in self.plan.faults) == 1
            if named and alone and late_s > _HUNG_WITHIN_S + spare_s:
                return f"the {role} was stopped, and named {late_s:.2f} s after the deadline"
        return ""

    def _what_is_left(self) -> str:
        if any(process.alive or process.sockets for process in self.run.nodes.values()):
            return "a node outlives its run"
        if self.run.launcher.sockets:
            return "the launcher left a socket"
        if self.run.launcher.status < 0:  # the next ``haploop status`` clears up
            return ""
        return f"{self.run.sockets} is still there" if self.run.sockets.exists() and self.run.clock else ""

    def _visitors_went_well(self) -> str:
        for process in self.visitors:
            if process.error is not None:
                return f"{process.name} ended with a traceback:\n" + "".join(traceback.format_exception(process.error))
        if self.was_in_order:
            events = self.run.launcher.result[1]
            for name, heard in self.heard:
                if heard != events[: len(heard)]:
                    return f"{name} heard of other events than there were: {heard}"
            wrong = [name for name, outcome in self.shown if outcome not in ("", "ended")]
            return f"{wrong[0]} shows a run that ended in order as failed" if wrong else ""
        return ""

    def _files(self, reads_log: bool) -> str:
        summary = self.run.launcher.result[0] if self.was_in_order else None
        if summary is not None:
            events = self.run.launcher.result[1]
            written = json.loads((self.out / "summary.json").read_text(encoding="utf-8"))
            if written["trajectory_sha256"] != summary["trajectory_sha256"]:
                return "summary.json is another than the run's"
            if summary["lost"]["telemetry_gaps"]:
                return "the run's own logger has gaps"
        else:
            events, reads_log = self.watch.events, True
        log = self.out / "log.mcap" if reads_log and self.scene.run.log != "none" else None
        for out, of_second, is_owed_all in self.second_logs:
            reached = of_second["from_tick"] + of_second["ticks"]
            if summary and is_owed_all and (reached, of_second["ended"]) != (summary["ticks"], summary["ended"]):
                return f"a second logger that kept up has {reached} of {summary['ticks']} ticks, {of_second['ended']}"
            if summary and (broken := second_difference(self.plan.scene, events, of_second, out / "log.mcap")):
                return broken
        if taken := broken_kept(self.out):
            return taken
        broken = difference(self.plan.scene, events, summary, log, self.watch.granted)
        if broken or log is None or not log.exists():
            return broken[0] if broken else ""
        return self._is_flushed(log)

    def _is_flushed(self, log: Path) -> str:
        """A killed logger's log holds what it had reported well before."""
        at = self.killed_at.get("logger")
        if at is None or any(not isinstance(fault, Kill) and fault.silences("logger") for fault in self.plan.faults):
            return ""
        due = max((tick for when, tick in self.watch.reports if when < at - _FLUSHED_WITHIN_S), default=0)
        held = logged_ticks(log)
        return (
            f"the log holds {held} ticks of a killed logger, which had reported {due} long before" if held < due else ""
        )
