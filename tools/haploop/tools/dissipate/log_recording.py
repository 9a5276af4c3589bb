"""Recordings from a run's log: the controller's measurement at every tick, the plant's position at every step."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np

from haploop.logger.log.recording import Table
from haploop.logger.log.stream import Batch, LogStream
from haploop.protocol.scene.effects import Actuator
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import DELAY, Timebase, TimebaseError
from haploop.tools.dissipate.samples import Floats, Notes, RecordingError, Samples

_COLUMNS = {"/controller": ("timestamp", "x", "v", "a", "total"), "/plant": ("x", "force")}


def read_scene(path: Path) -> Scene:
    """Reads the resolved scene in a run's log; RecordingError where none is attached.

    Raises FileNotFoundError, LogError where there is no log, or none that can be read.
    """
    log = LogStream(path, topics=())
    for _ in log:
        if "scene.toml" in log.attachments:
            break
    beside = log.path.with_name("scene.toml")
    if "scene.toml" not in log.attachments and not beside.exists():
        raise RecordingError(f"The log {log.path} holds no scene, so its rates and estimates are not known.")
    text = log.attachments.get("scene.toml")
    return Scene.from_dict(tomllib.loads(text.decode() if text else beside.read_text(encoding="utf-8")))


def holds_readings(scene: Scene) -> bool:
    """Tells whether the accelerations in a run's log are readings of an accelerometer, unfiltered."""
    table = scene.acceleration
    return table is not None and table.source == "accelerometer" and table.cutoff is None


class LogRecording:
    """Reads samples from a run's log; in between, the plant's own steps where they were logged.

    The force of tick k would have acted from step k n + d on, n steps a tick, d the scene's delay or another one. The
    recorded force is that commanded in all; its work is that of the force held at every plant step, where they were
    logged.

    Args:
        delay_s: delay of the forces; that of the scene when None.
        estimated: which of "velocity" and "acceleration" are to be estimated again, not taken from the run.
    """

    has_force = True

    def __init__(self, path: Path, scene: Scene, delay_s: float | None, estimated: frozenset[str]) -> None:
        self._path, self.name = path, scene.title
        delay_s = scene.clock.round_trip_delay if delay_s is None else delay_s
        try:
            time = Timebase.from_clock(replace(scene.clock, round_trip_delay=delay_s), scene.duration)
        except TimebaseError as error:
            raise RecordingError(f"The {error}") from error
        self.period_s, self.delay_s, self.notes = time.period_s, delay_s, Notes()
        self._readings = holds_readings(scene)
        self._n, self._late = time.steps_per_tick, time.delay_steps % time.steps_per_tick
        self.recorded = frozenset({"velocity", "acceleration"}) - estimated
        self.between = "plant steps" if scene.run.log == "steps" else "straight lines"
        self._remark(scene)

    def _remark(self, scene: Scene) -> None:
        remarks = self.notes.remarks
        if uncertain := [f"[{table}]" for table in ("jitter", "loss") if getattr(scene, table) is not None]:
            remarks.append(f"The forces are taken to arrive after the delay alone, without {' and '.join(uncertain)}.")
        if any(DELAY in (event.set or {}) for event in scene.event):
            remarks.append("The delay changed during the run; the forces are taken to arrive after that of the scene.")
        if scene.actuator not in (None, Actuator()):
            remarks.append("The forces are those commanded, without what the actuator would have made of them.")

    def samples(self) -> Iterator[Samples]:
        """Yields all samples, a chunk of the log at a time."""
        log = LogStream(self._path, _COLUMNS, {name for names in _COLUMNS.values() for name in names})
        waiting, first = _Waiting(self._n, self._late, self.between == "plant steps"), True
        for batch in log:
            waiting.add(batch)
            rows = waiting.whole()
            if len(rows["x"]):
                self.notes.rows += len(rows["x"])
                v = rows["v"] if "velocity" in self.recorded else None
                a = rows["a"] if "acceleration" in self.recorded or self._readings else None
                end = float(rows["end"][-1]) if "end" in rows else None
                true, between = rows.get("true", rows["x"]), rows.get("between")
                force = {"force_N": rows["total"], "taken_J": rows.get("taken_J")}
                yield Samples(rows["timestamp"], rows["x"], v, a, true, between, first, end, **force)
                first = False
        if self.notes.rows < 2:
            raise RecordingError(f"The log {log.path} holds fewer than two ticks of the controller.")
        if log.cut:
            self.notes.remarks.append(log.cut)


class _Waiting:
    """Holds rows of both channels until those of the other have come.

    Args:
        n, late: plant steps a tick, and the one of them at which a delayed force changes.
    """

    def __init__(self, n: int, late: int, of_steps: bool) -> None:
        self._n, self._late, self._of_steps = n, late, of_steps
        self._controller: dict[str, Floats] = {name: np.empty(0) for name in _COLUMNS["/controller"]}
        self._plant = np.empty((2, 0))

    def add(self, batch: Batch) -> None:
        rows = cast(Table, batch.rows)
        if batch.topic == "/plant":
            self._plant = np.hstack([self._plant, [rows[name] for name in _COLUMNS["/plant"]]])
        else:
            self._controller = {name: np.concatenate([kept, rows[name]]) for name, kept in self._controller.items()}

    def whole(self) -> dict[str, Floats]:
        """Returns the columns of all ticks whose period has ended, with the plant's positions at and within them."""
        n, ticks = self._n, len(self._controller["x"])
        if self._of_steps:
            ticks = min(ticks, max(0, self._plant.shape[1] - 1) // n)
        rows = {name: column[:ticks] for name, column in self._controller.items()}
        self._controller = {name: column[ticks:] for name, column in self._controller.items()}
        if self._of_steps:
            x, force = self._plant[:, : ticks * n + 1]
            steps, work = x[:-1].reshape(ticks, n), (force[:-1] * np.diff(x)).reshape(ticks, n)
            rows |= {"true": steps[:, 0], "between": steps[:, self._late], "end": x[n::n], "taken_J": -work.sum(axis=1)}
            self._plant = self._plant[:, ticks * n :]
        return rows
