"""The session of one run: its telemetry and events from joining to the end of the run, then its summary."""

from __future__ import annotations

import contextlib
import math
import time as wall_clock
from collections import deque
from collections.abc import Sequence
from pathlib import Path

import zmq

from haploop.logger.log import LogError
from haploop.logger.summary import REPEATED_S, SUMMARY, Summary, awaits_verdict, read
from haploop.protocol.changes import Event, at_work, changes_of
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import DELAY, Timebase
from haploop.protocol.transport.clock_client import Aborted, Refused
from haploop.protocol.transport.observer import Observer
from haploop.protocol.transport.wire import Message
from haploop.view.look.compare import Changes
from haploop.view.receive.ingest import ingest
from haploop.view.receive.runs import ClockAnswers, Run, Runs, is_live
from haploop.view.store.history import AtWork, History

ROLE = "view"
_STREAMS = ("plant", "controller", "logger")
# Wall time over which the real-time factor is taken, at most and at least.
_FACTOR_S, _LEAST_FACTOR_S = 1.0, 0.3


class RunSession:
    """Joins a run, which may take a while, and keeps all that is received of it.

    Attributes:
        scene, time, out: the resolved scene, its timebase, the run's directory.
        history: telemetry received, and what was logged before once ``prepend`` has been called.
        status: newest status of the logger.
        changes: swaps and sets, with what was before them.
        outcome: "" while the run goes on, then "ended" or "failed"; ``why`` is a sentence, if there is one.
        given_up: whether nobody is left who could judge the run.

    Raises:
        Refused, Aborted: the run did not let this viewer in.
    """

    def __init__(self, runs: Runs, run: Run) -> None:
        self.run = run
        self._context = run.make_context()
        try:
            self._observer = Observer(self._context, ROLE, run.clock, _STREAMS, lambda: is_live(runs, run))
        except (Refused, Aborted):
            self._context.destroy(linger=0)
            raise
        welcome = self._observer.welcome
        time, scene = Timebase(**welcome["timebase"]), Scene.from_dict(welcome["scene"])
        history = History(time, max(0, welcome["granted"] - time.window_ticks(scene.run)))
        self._begin(scene, time, Path(welcome["context"]["out"]), history)
        self.clock = ClockAnswers(runs, run, self.events, self.scene)

    def _begin(self, scene: Scene, time: Timebase, out: Path, history: History) -> None:
        self.scene, self.time, self.out, self.history = scene, time, out, history
        self.status: Message = {}
        self.events: list[tuple[int, Event]] = []
        most_N = scene.actuator.saturation if scene.actuator else None
        self.changes = Changes(scene.count_m, math.inf if most_N is None else most_N)
        self.delay_s = scene.clock.round_trip_delay
        self.outcome = self.why = ""
        self.given_up = False
        self.summary: Summary | None = None
        self._seen: deque[tuple[float, int]] = deque()

    def poll(self) -> None:
        if self.outcome:
            return
        try:
            frames = self._observer.poll()
        except (Aborted, Refused) as error:
            self.end("failed", str(error))
            return
        self.status |= ingest(self.history, frames)
        self._note_events()
        if self.history.at_work == AtWork():
            now = at_work(self.scene, changes_of(self.events))
            self.history.at_work = AtWork(now.dissipation, now.wall)
        now = wall_clock.monotonic()
        if self.clock.status.get("paused"):  # the rate after a pause does not count the standstill either
            self._seen.clear()
        if self.history.first_tick is not None:
            self._seen.append((now, self.history.end_tick))
        while self._seen and now - self._seen[0][0] > _FACTOR_S:
            self._seen.popleft()
        if "logger" in self._observer.ended:
            self.end("ended", "")

    def _note_events(self) -> None:
        self._take(self._observer.take_events())

    def _take(self, events: Sequence[tuple[int, Event]]) -> None:
        self.events += events
        for _, event in events:
            self.delay_s = event.get("set", {}).get(DELAY, self.delay_s)

    @property
    def skipped_ticks(self) -> int:
        return sum(self._observer.skipped.values())

    @property
    def end_s(self) -> float:
        """Returns the simulated time up to which the run went, or is known, s."""
        return self.end_tick / self.time.control_rate

    @property
    def end_tick(self) -> int:
        """Returns the tick up to which the run went, or is known."""
        return self.history.end_tick if self.history.stop_tick is None else self.history.stop_tick

    @property
    def real_time_factor(self) -> float | None:
        """Returns simulated over wall time, taken over the last second; None when nothing moves."""
        if len(self._seen) < 2:
            return None
        (began, first), (now, last) = self._seen[0], self._seen[-1]
        moves = not self.outcome and last > first and now - began > _LEAST_FACTOR_S
        return (last - first) / self.time.control_rate / (now - began) if moves else None

    def end(self, how: str, why: str) -> None:
        """Ends the session: no more telemetry will come."""
        self._note_events()
        self.outcome, self.why = how, why
        self.read_summary()

    def end_without_launcher(self) -> None:
        """Ends the session after its launcher has gone: in order, its last messages perhaps lost, or because killed."""
        self.poll()
        if not self.outcome:
            self.end("ended", "")
            if self.summary is None:
                self.end("failed", f"The launcher of run {self.run.id} has ended without a message.")

    def close(self) -> None:
        """Leaves the run, which may go on, and closes its sockets."""
        with contextlib.suppress(zmq.ZMQError):  # closed already, where the clock did not let this viewer in again
            self._observer.leave()
        self._context.destroy(linger=200)

    def read_summary(self) -> None:
        """Reads the run's summary if it is on this machine; a run that failed may still be writing it."""
        if not self.run.is_here:
            return
        with contextlib.suppress(LogError):
            self.summary = summary = read(self.out / SUMMARY)
            self.outcome = "failed" if summary.get("ended") == "failed" else self.outcome
            self.why = self.why or summary.get("why", "")

    @property
    def verdict_is(self) -> str:
        """Returns the state of the verdict, in a word.

        ``seen`` in the last half second, ``judged`` once the run has ended, or if nothing can tell more; between the
        two ``awaited``, or ``abandoned`` if its launcher has gone; ``unjudged`` for a run that was too long,
        ``foreign`` for one whose plant or controller was not haploop's own; ``unknown`` if no summary can be read.
        """
        if not self.summary:
            return "unknown" if self.outcome == "ended" else "seen"
        if "programs" in self.summary:
            return "foreign"
        if awaits_verdict(self.scene, self.summary):
            return "abandoned" if self.given_up else "awaited"
        if "stability" in self.summary or self.summary["verdict"] == "undecided":
            return "judged"
        is_long = self.scene.run.verdict == "pushed" and self.summary["duration_s"] > REPEATED_S
        return "unjudged" if is_long else "seen"

    @property
    def version(self) -> tuple[object, ...]:
        """Returns a tuple that differs whenever something but the tick has changed."""
        status, at_work = self.clock.status, self.history.at_work
        return self.outcome, self.verdict_is, status.get("paused"), status.get("pace"), at_work, self.delay_s

    @property
    def is_complete(self) -> bool:
        """Tells whether every tick from the start on was certainly received."""
        begun = all(series.first_tick == 0 for series in self.history.all_series)
        return begun and not self.skipped_ticks and self.outcome != "failed"

    def prepend(self, logged: History) -> None:
        """Puts what was read from the log in front of what was received."""
        logged.extend_from(self.history)
        self.history = logged
