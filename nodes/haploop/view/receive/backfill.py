"""Backfill: what a run logged before the viewer joined it, read from its log while the run goes on."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from haploop.logger.log.stream import Batch, LogStream
from haploop.protocol.changes import Event, Span, changes_of, spans
from haploop.protocol.ticks import Timebase
from haploop.view.receive.ingest import elements_as_telemetry, wall_as_telemetry
from haploop.view.store.history import TRUE, History

_POSITIONS = ("x", "tip_x", "hand_x")


class Backfill:
    """Fills a history from the log of a run.

    Args:
        out: the run's directory.
        scene, time: the resolved scene and its integers.
        events: (tick, event) in order; may grow while the log does.

    Attributes:
        history: what was read so far.
    """

    def __init__(self, out: Path, scene: dict[str, Any], time: Timebase, events: Sequence[tuple[int, Event]]) -> None:
        self._out, self._scene, self._time, self._events = out, scene, time, events
        self._every_step = scene["run"]["log"] == "steps"
        self._log: LogStream | None = None
        self._known_events = -1
        self._at_work: list[Span] = []
        self.history = History(time, 0)

    def read(self) -> None:
        """Reads on, up to the present end of the log.

        Raises:
            FileNotFoundError, LogError: there is no log, or none that can be read.
        """
        self._log = self._log or LogStream(self._out, topics=("/plant", "/controller", "/energy"))
        for batch in self._log:
            self._take(batch)

    def _take(self, batch: Batch) -> None:
        rows = batch.rows
        if not isinstance(rows, dict) or not len(batch.log_times_ns):
            return
        if batch.topic == "/plant":
            self._plant(rows)
            return
        tick = round(float(rows["timestamp"][0]) * self._time.control_rate)
        if batch.topic == "/energy":
            self.history.append_energy(
                tick, {name: rows[name] for name in rows if name == "residual" or name.endswith(TRUE)}
            )
            return
        for first, end, span in self._spans(tick, tick + len(rows["timestamp"])):
            columns = {name: column[first - tick : end - tick] for name, column in rows.items()}
            elements = [
                element for i, element in enumerate(elements_as_telemetry(span.scene)) if f"dissipation.{i}" in rows
            ]
            self.history.append_ticks(first, columns, elements, wall_as_telemetry(span.scene))

    def _plant(self, rows: dict[str, np.ndarray]) -> None:
        """Takes the steps of whole ticks, after which the end state of the run may follow."""
        n = self._time.steps_per_tick
        columns = {name: rows[name] for name in _POSITIONS if name in rows}
        columns["force"] = rows["actuator"] if "actuator" in rows else rows["force"]
        tick = round(float(rows["t"][0]) * self._time.plant_rate) // n
        whole = len(rows["t"]) // n * n
        if whole:
            self.history.append_steps(tick, {name: column[:whole] for name, column in columns.items()})
        if whole < len(rows["t"]):
            self.history.end(tick + whole // n, {name: column[whole:] for name, column in columns.items()})

    def _spans(self, tick: int, end: int) -> Iterator[tuple[int, int, Span]]:
        """Yields the spans within some ticks: (from, to, span)."""
        if len(self._events) != self._known_events:
            self._known_events = len(self._events)
            self._at_work = spans(self._scene, changes_of(self._events))
        for span in self._at_work:
            first, last = max(tick, span.from_tick), int(min(end, span.to_tick))
            if first < last:
                yield first, last, span

    def reaches(self, live: History) -> bool:
        """Tells whether the log has been read up to where a live history begins and still holds every row."""
        pairs = zip(self.history.all_series, live.all_series, strict=True)
        logged = [(own, its) for own, its in pairs if self._every_step or own is not self.history.steps]
        return all(
            its.first_tick is not None and own.end_tick >= max(its.first_tick, its.full_from_tick)
            for own, its in logged
        )
