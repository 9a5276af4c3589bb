"""The session of a run that is over, made from its log: as if its telemetry had been received to the end."""

from __future__ import annotations

from types import SimpleNamespace

from haploop.logger.log.stream import LogStream
from haploop.protocol.changes import changes_of, spans
from haploop.protocol.ticks import Timebase
from haploop.view.receive.ingest import Backfill
from haploop.view.receive.run_session import RunSession
from haploop.view.receive.runs import PastRun, Run
from haploop.view.store.history import History


class PastSession(RunSession):
    """Reads a recorded run, which takes longer the longer its log is; ``run`` is what it was found as.

    Raises:
        OSError, LogError: its log cannot be read.
    """

    def __init__(self, run: PastRun) -> None:
        self.run: Run = run
        scene = run.scene()
        time = Timebase.from_scene(scene)
        self._begin(scene, time, run.out, History(time, 0))
        for batch in LogStream(run.out, topics=("/events",)):
            if isinstance(batch.rows, list):
                self._take([(int(event.get("tick", 0)), event) for event in batch.rows])
        keys = {key for _, event in self.events for key in event.get("set", {})}
        at_work = [span.scene for span in spans(scene, changes_of(self.events))]
        units = {key: unit for now in at_work for key, unit in run.units(now, keys).items()}
        self.clock = SimpleNamespace(status={}, options=None, limit=None, units=units)  # nobody is there to answer
        self.outcome, self.given_up = "ended", True
        backfill = Backfill(self.out, scene, time, self.events)
        backfill.read()
        self.history = backfill.history
        self.history.stop_tick = self.history.end_tick if self.history.stop_tick is None else self.history.stop_tick
        self.read_summary()

    @property
    def skipped_ticks(self) -> int:
        return 0
