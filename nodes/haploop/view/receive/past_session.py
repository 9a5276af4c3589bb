"""The session of a run that is over, made of its log: as if its telemetry had been received to the end."""

from __future__ import annotations

from collections import deque

from haploop.logger.log.stream import LogStream
from haploop.protocol.changes import Event
from haploop.protocol.ticks import DELAY, Timebase
from haploop.protocol.transport.wire import Message
from haploop.view.look.compare import Changes
from haploop.view.receive.ingest import Backfill
from haploop.view.receive.run_session import RunSession
from haploop.view.receive.runs import PastRun


class _NoClock:
    """The answers of a clock that is not there any more."""

    def __init__(self) -> None:
        self.status: Message = {}
        self.options: Message | None = None
        self.limit_N_m: float | None = None


class PastSession(RunSession):
    """Reads a recorded run, which takes as long as its log is; ``run`` is what it was found as.

    Raises:
        OSError, LogError: its log cannot be read.
    """

    def __init__(self, run: PastRun) -> None:
        self.run = run
        self.out, self.scene = run.out, run.scene()
        self.time = Timebase.from_scene(self.scene)
        self.status = {}
        self.events = _events(run)
        self.changes = Changes(self.scene.encoder.resolution if self.scene.encoder else 0.0)
        self.clock = _NoClock()
        self.delay_s = self.scene.clock.round_trip_delay
        for _, event in self.events:
            self.delay_s = event.get("set", {}).get(DELAY, self.delay_s)
        self.outcome, self.why, self.summary = "ended", "", None
        self.given_up = True
        self._seen: deque[tuple[float, int]] = deque()
        backfill = Backfill(self.out, self.scene, self.time, self.events)
        backfill.read()
        self.history = backfill.history
        self.read_summary()

    @property
    def skipped_ticks(self) -> int:
        return 0


def _events(run: PastRun) -> list[tuple[int, Event]]:
    """Returns the events of a log with their ticks."""
    found = []
    for batch in LogStream(run.out, topics=("/events",)):
        if isinstance(batch.rows, list):
            found += [(int(event.get("tick", 0)), event) for event in batch.rows]
    return found
