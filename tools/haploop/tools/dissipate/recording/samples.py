"""Samples of a recorded motion, notes on what was found, and a run's log as a recording."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from haploop.launch.runs.run_files import holds_readings, recorded_scene
from haploop.launch.scene.reading.delimited import Floats, RecordingError
from haploop.logger.log.recording import Table
from haploop.logger.log.stream import Batch, LogStream
from haploop.protocol.scene.effects import Actuator
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import DELAY, Timebase, TimebaseError

# Share of uneven periods above which they are reported before anything else.
UNEVEN_SHARE = 0.01


@dataclass(frozen=True)
class Samples:
    """Consecutive samples, one control period apart; arrays of shape (samples,).

    Attributes:
        x_m, true_x_m: position measured by the controller, and that of the device.
        v_m_s, a_m_s2: velocity and acceleration as recorded; None where they are to be estimated.
        between_x_m: position of the device when a delayed force changes, within the period after each sample; None for
            a straight line from sample to sample.
        begins: whether the piece is the first, or follows a gap.
        end_x_m: position a period after the last sample; None where it is in the next piece, or not known.
        force_N: recorded force on the device, along the position; None where it was not read.
        held_N: mean of the force held in the period after each sample, where that is known.
        taken_J: what the force took out of the device in the period after each sample, where that is known exactly.
        unknown: number of samples at its beginning whose velocity or acceleration would need those in the gap before:
            no element is taken to act there.
    """

    t_s: Floats
    x_m: Floats
    v_m_s: Floats | None
    a_m_s2: Floats | None
    true_x_m: Floats
    between_x_m: Floats | None
    begins: bool
    end_x_m: float | None = None
    unknown: int = 0
    force_N: Floats | None = None
    taken_J: Floats | None = None
    held_N: Floats | None = None


@dataclass
class Notes:
    """Counts of what was found in a recording.

    Attributes:
        gaps_s: begin and end of each gap, s; the first hundred.
        bridged: single missing samples, replaced by the mean of their neighbours.
        repeated: samples equal to the one before although the device moved by three counts or more before and after,
            where they come at even intervals.
        uneven: periods that are off the others by more than a tenth, and more than rounding causes.
        rounded_s: the step to which otherwise even times are rounded, s; 0 where no rounding is seen.
    """

    rows: int = 0
    unusable_rows: int = 0
    gaps_s: list[tuple[float, float]] = field(default_factory=list)
    gaps: int = 0
    missing_s: float = 0.0
    bridged: int = 0
    repeated: int = 0
    uneven: int = 0
    rounded_s: float = 0.0

    @property
    def is_uneven(self) -> bool:
        """Tells whether so many periods are uneven that energies may be wrong."""
        return self.uneven > UNEVEN_SHARE * self.rows

    remarks: list[str] = field(default_factory=list)

    def gap(self, from_s: float, to_s: float) -> None:
        self.gaps, self.missing_s = self.gaps + 1, self.missing_s + to_s - from_s
        if len(self.gaps_s) < 100:
            self.gaps_s.append((from_s, to_s))


# The columns of a log that are read, by channel.
_COLUMNS = {"/controller": ("timestamp", "x", "v", "a", "total"), "/plant": ("x", "force")}


def read_scene(path: Path) -> Scene:
    """Reads the resolved scene in a run's log; RecordingError where none is attached.

    Raises FileNotFoundError, LogError, SceneError where there is no log, or none that can be read.
    """
    log = LogStream(path, topics=())
    any("scene.toml" in log.attachments for _ in log)
    if (scene := recorded_scene(log.path.parent, log.attachments)) is None:
        raise RecordingError(f"The log {log.path} holds no scene, so its rates and estimates are not known.")
    return scene


class LogRecording:
    """Reads samples from a run's log, and the plant steps between them where these were logged.

    The force of tick k would have acted from step k n + d on, with n steps per tick and d the scene's delay or another
    one. The recorded force is the total commanded; its work is that of the force held at every plant step, where the
    steps were logged.

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
            remarks.append(
                "The true energies of the recorded force are those of the force that the actuator applied; all else, "
                "including sampled energies and the elements, uses the forces commanded."
            )

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
                force = {"force_N": rows["total"], "taken_J": rows.get("taken_J"), "held_N": rows.get("held_N")}
                yield Samples(rows["timestamp"], rows["x"], v, a, true, between, first, end, **force)
                first = False
        if self.notes.rows < 2:
            raise RecordingError(f"The log {log.path} holds fewer than two ticks of the controller.")
        if log.cut:
            self.notes.remarks.append(log.cut)


class _Waiting:
    """Holds rows of each channel until those of the other have come.

    Args:
        n, late: plant steps per tick, and the one among them at which a delayed force changes.
    """

    def __init__(self, n: int, late: int, of_steps: bool) -> None:
        self._n, self._late, self._of_steps = n, late, of_steps
        self._controller: dict[str, Floats] = {name: np.empty(0) for name in _COLUMNS["/controller"]}
        self._plant = np.empty((2, 0))

    def add(self, batch: Batch) -> None:
        rows, wanted = batch.rows, _COLUMNS[batch.topic]
        if not isinstance(rows, Table) or not rows.keys() >= set(wanted) or not np.isfinite(rows[wanted[0]]).all():
            raise RecordingError(f"The log is not that of a run: {', '.join(wanted)} were expected on {batch.topic}.")
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
            rows["held_N"] = force[:-1].reshape(ticks, n).mean(axis=1)
            self._plant = self._plant[:, ticks * n :]
        return rows
