"""Ingestion into a history: telemetry as it comes, and the log of what came before, read while the run goes on."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np

from haploop.logger.log.recording import Table
from haploop.logger.log.stream import Batch, LogStream
from haploop.protocol.changes import Event, Span, changes_of, spans
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
from haploop.protocol.transport.telemetry import Block
from haploop.protocol.transport.wire import Frame, Message
from haploop.view.store.history import AtWork, History

# Columns from which positions and forces of the plant are made, and those of the controller that are shown.
_OF_PLANT = ("x", "v", "force", "actuator", "cable.stretch", "cable.rate", "grip.stretch", "grip.rate")
_OF_CONTROLLER = ("x", "v", "wall", "total")
_LOGGED_POSITIONS = ("x", "tip_x", "hand_x")
_STATE_BYTES = 8
_OWN = re.compile(r"dissipation\.\d+\.")
# Columns of the energy that no page shows.
_NOT_SHOWN, _SAMPLED = ("timestamp", "moved"), ".sampled"


def ingest(history: History, frames: Sequence[tuple[str, Frame]]) -> Message:
    """Appends the blocks of these messages to a history; returns the newest status of the logger, {} for none.

    Blocks without a gap between them are taken together.
    """
    blocks: dict[str, list[Block]] = {}
    status: Message = {}
    for role, frame in frames:
        if frame.name == "STATE":
            tick, now = frame.fields
            {"plant": history.steps, "controller": history.ticks, "logger": history.energy}[role].begin(tick)
            if role == "controller" and now["history"]:  # all there is of a run that stands still
                history.at_work = history.at_work_in(now["history"][-1])
            status = now if role == "logger" and now else status
        elif frame.name.endswith("_BLOCK"):
            blocks.setdefault(frame.name, []).append(block := frame.as_dict())
            status = block.get("status") or status
    for name, take in (("PLANT_BLOCK", _plant), ("CONTROLLER_BLOCK", _controller), ("ENERGY_BLOCK", _energy)):
        for run in _contiguous(blocks.get(name, [])):
            take(history, run)
    for role, frame in frames:
        if (role, frame.name) == ("plant", "END"):
            history.end(frame.fields[0])
    return status


def _contiguous(blocks: Iterable[Block]) -> list[list[Block]]:
    """Groups blocks that follow each other without a gap and have the same columns, elements and wall."""
    runs: list[list[Block]] = []
    for block in blocks:
        if runs and _follows(runs[-1][-1], block):
            runs[-1].append(block)
        else:
            runs.append([block])
    return runs


def _follows(one: Block, other: Block) -> bool:
    alike = one["columns"].keys() == other["columns"].keys() and all(
        one.get(name) == other.get(name) for name in ("elements", "wall")
    )
    return alike and other["from_tick"] == one["from_tick"] + one["ticks"]


def _joined(run: list[Block], names: Iterable[str], shared: int = 0) -> dict[str, np.ndarray]:
    """Joins columns of blocks, without the last ``shared`` bytes of all but the last block: the next one has them."""
    wanted, until = list(names), -shared or None
    *earlier, last = [block["columns"] for block in run]
    parts = [part for name in wanted for part in (*[columns[name][:until] for columns in earlier], last[name])]
    return dict(zip(wanted, np.frombuffer(b"".join(parts), "<f8").reshape(len(wanted), -1), strict=True))


def _plant(history: History, run: list[Block]) -> None:
    names = [name for name in _OF_PLANT if name in run[0]["columns"]]
    history.append_plant_block(run[0]["from_tick"], _joined(run, names, shared=_STATE_BYTES))


def _controller(history: History, run: list[Block]) -> None:
    elements = run[0]["elements"]
    units = {
        f"dissipation.{place}.{name}": unit
        for place, element in enumerate(elements)
        for name, unit in element.get("columns", {}).items()
    }
    names = [*_OF_CONTROLLER, *(f"dissipation.{place}" for place in range(len(elements))), *units]
    history.append_ticks(run[0]["from_tick"], _joined(run, names), history.at_work_in(run[0]), units)


def _energy(history: History, run: list[Block]) -> None:
    history.append_energy(run[0]["from_tick"], _joined(run, filter(_is_shown, run[0]["columns"])))


def _is_shown(book: str) -> bool:
    return book not in _NOT_SHOWN and not book.endswith(_SAMPLED)


class Backfill:
    """Fills a history from the log in a run's directory; ``events``, (tick, event), may grow while the log does."""

    def __init__(self, out: Path, scene: Scene, time: Timebase, events: Sequence[tuple[int, Event]]) -> None:
        self._out, self._scene, self._time, self._events = out, scene, time, events
        self._log: LogStream | None = None
        self._known_events = -1
        self._at_work: list[Span] = []
        self.history = History(time, 0)

    def read(self) -> None:
        """Reads on, up to the present end of the log; raises OSError or LogError where no log can be read."""
        self._log = self._log or LogStream(self._out, topics=("/plant", "/controller", "/energy"))
        for batch in self._log:
            self._take(batch)

    def _take(self, batch: Batch) -> None:
        rows = batch.rows
        if not isinstance(rows, Table) or not len(batch.log_times_ns):
            return
        if batch.topic == "/plant":
            self._plant(rows)
            return
        tick = round(float(rows["timestamp"][0]) * self._time.control_rate)
        if batch.topic == "/energy":
            self.history.append_energy(tick, {name: rows[name] for name in filter(_is_shown, rows)})
            return
        own = {name: unit for name, unit in rows.units.items() if _OWN.match(name)}
        for first, end, scene in self._spans(tick, tick + len(rows["timestamp"])):
            columns = {name: column[first - tick : end - tick] for name, column in rows.items()}
            self.history.append_ticks(first, columns, AtWork(scene.dissipation, scene.wall), own)

    def _plant(self, rows: Table) -> None:
        """Takes the steps of whole ticks, after which the end state of the run may follow."""
        n = self._time.steps_per_tick
        columns = {name: rows[name] for name in _LOGGED_POSITIONS if name in rows}
        columns["force"] = rows["actuator" if "actuator" in rows else "force"]
        tick = round(float(rows["t"][0]) * self._time.plant_rate) // n
        whole = len(rows["t"]) // n * n
        if whole:
            self.history.append_steps(tick, {name: column[:whole] for name, column in columns.items()})
        if whole < len(rows["t"]):
            self.history.end(tick + whole // n, {name: column[whole:] for name, column in columns.items()})

    def _spans(self, tick: int, end: int) -> Iterator[tuple[int, int, Scene]]:
        if len(self._events) != self._known_events:
            self._known_events = len(self._events)
            self._at_work = spans(self._scene, changes_of(self._events))
        for span in self._at_work:
            first, last = max(tick, span.from_tick), int(min(end, span.to_tick))
            if first < last:
                yield first, last, span.scene

    def reaches(self, live: History) -> bool:
        """Tells whether the log has been read up to where a live history begins."""
        pairs = zip(self.history.all_series, live.all_series, strict=True)
        every_step = self._scene.run.log == "steps"
        return all(
            its.first_tick is not None and own.end_tick >= its.first_tick
            for own, its in pairs
            if every_step or own is not self.history.steps
        )
