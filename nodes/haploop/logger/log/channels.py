"""The channels of a run's log: which columns they have, in which units, and how blocks become messages."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from haploop.logger.books.buffers import as_float64
from haploop.logger.log.table import Floats
from haploop.protocol.changes import Event
from haploop.protocol.ticks import Timebase
from haploop.protocol.transport.telemetry import Block


class Column(NamedTuple):
    """A column of the log: its unit, "" for a pure number, and what it means."""

    unit: str
    meaning: str


TIME = Column("s", "simulated time of the tick, since the start of the run")
# Positions, velocities and forces count along one axis, that of the scene.
PLANT: Mapping[str, Column] = {
    "timestamp": Column("s", "simulated time of the plant step, since the start of the run"),
    "t": Column("s", "the same number"),
    "x": Column("m", "true position of the device, or of the motor if there is a cable"),
    "v": Column("m/s", "true velocity of the same body"),
    "tip_x": Column("m", "true position of the device's tip behind the cable"),
    "tip_v": Column("m/s", "true velocity of the tip"),
    "hand_x": Column("m", "true position of the hand's mass behind the grip"),
    "hand_v": Column("m/s", "true velocity of the hand's mass"),
    "force": Column(
        "N", "force of the actuator from this step on: the command in effect, rounded and limited as the actuator does"
    ),
    "actuator": Column("N", "force that the device feels at this step, if a bandwidth makes it lag behind `force`"),
    "friction": Column(
        "N", "dry friction on the device, or the motor, from this step on; opposes the motion, 0 while stuck"
    ),
}
CONTROLLER: Mapping[str, Column] = {
    "timestamp": TIME,
    "x": Column("m", "measured position, with noise and in whole counts: the sample that the tick answers"),
    "v": Column("m/s", "velocity that the scene's estimator computes from the measured positions"),
    "a": Column("m/s^2", "acceleration, estimated, or the accelerometer's reading"),
    "wall": Column("N", "force of the wall that the controller computed at this tick; 0 out of contact"),
    "total": Column("N", "the command: forces of the wall and of all elements; it takes effect later, by the delay"),
    "in_contact": Column("", "1 where the measured position lies strictly inside the wall, else 0"),
    "dissipation.N": Column("N", "force of element N in the list; 0 out of contact unless it acts always"),
}
# What an element shows besides its force is declared in its class, with its unit.
OWN = Column("", "what element N shows of its memory, in the unit that its class declares")
# Each link in the telemetry leads to the body that the log names.
_FAR_END = {"cable": "tip", "grip": "hand"}


class Sink(Protocol):
    """Sink of channels: ``haploop.logger.log.writer.Log``, or an object that takes the same without a file."""

    def channel(
        self, topic: str, columns: Mapping[str, str], *, samples_per_message: int | None = None, title: str
    ) -> int: ...

    def write(self, channel: int, log_times_ns: NDArray[np.int64], values: Floats) -> None: ...

    def message(self, channel: int, log_time_ns: int, obj: Event) -> None: ...


class Channels:
    """Writes telemetry to a log: /plant (unless only ticks are wanted), /controller, /energy and /events."""

    def __init__(self, log: Sink, time: Timebase, every_step: bool) -> None:
        self._log, self._time, self._every_step = log, time, every_step
        self._events = log.channel("/events", {}, title="what changed the run, at its tick")

    def _log_times_ns(self, first: int, ticks: int) -> NDArray[np.int64]:
        seconds, rest = np.divmod(np.arange(first, first + ticks, dtype=np.int64), self._time.control_rate)
        return seconds * 1_000_000_000 + rest * 1_000_000_000 // self._time.control_rate

    def plant(self, first: int, ticks: int, columns: dict[str, np.ndarray]) -> None:
        """Writes one message per tick, an array of its steps; ``columns`` are ``motion_columns`` of whole intervals."""
        if self._every_step and ticks:
            steps = self._time.steps_per_tick
            self._plant_messages(first, ticks, steps, {name: column[:-1] for name, column in columns.items()})

    def plant_end(self, tick: int, state: dict[str, np.ndarray]) -> None:
        """Writes the end state of the run, a message of one sample; its force is the last one held."""
        if self._every_step:
            self._plant_messages(tick, 1, 1, state)

    def _plant_messages(self, first: int, ticks: int, samples: int, columns: dict[str, np.ndarray]) -> None:
        units = {name: PLANT[name].unit for name in ("timestamp", "t", *columns)}
        channel = self._log.channel(
            "/plant", units, samples_per_message=samples, title="the plant at every step; force acts from that step on"
        )
        start = first * self._time.steps_per_tick
        t = np.arange(start, start + ticks * samples) / self._time.plant_rate
        values = np.stack([t, t, *columns.values()], axis=1)
        self._log.write(channel, self._log_times_ns(first, ticks), values.reshape(ticks, samples, len(units)))

    def controller(self, block: Block, since: int) -> None:
        """Writes one message per tick from ``since`` on: estimates, forces of wall and elements, and their total."""
        first = max(since, block["from_tick"])
        columns = {name: as_float64(data)[first - block["from_tick"] :] for name, data in block["columns"].items()}
        kinds = ", ".join(f"dissipation.{i} is {e['kind']}" for i, e in enumerate(block["elements"])) or "no element"
        own = [(i, each.get("columns", {})) for i, each in enumerate(block["elements"])]
        shows = {f"dissipation.{i}.{name}": shown[name] for i, shown in own for name in shown}
        known = {name: column.unit for name, column in CONTROLLER.items()} | shows
        units = {name: known.get(name, "N") for name in columns}
        self._ticks("/controller", f"the controller at every tick; {kinds}", units, first, columns)

    def energy(self, first: int, columns: dict[str, np.ndarray]) -> None:
        """Writes one message per tick: the totals of the books so far."""
        self._ticks("/energy", "the energy books at every tick", dict.fromkeys(columns, "J"), first, columns)

    def _ticks(self, topic: str, title: str, units: dict[str, str], first: int, columns: dict[str, np.ndarray]) -> None:
        channel = self._log.channel(topic, {"timestamp": TIME.unit} | units, title=title)
        ticks = len(next(iter(columns.values())))
        if not ticks:
            return
        stamps = np.arange(first, first + ticks) / self._time.control_rate
        self._log.write(channel, self._log_times_ns(first, ticks), np.stack([stamps, *columns.values()], axis=1))

    def event(self, tick: int, event: Event) -> None:
        """Writes one message: the tick, its time in s, and the event as it was given."""
        entry = {"timestamp": tick / self._time.control_rate, "tick": tick, **event}
        self._log.message(self._events, self._time.tick_ns(tick), entry)


def motion_columns(plant: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Returns columns of ``PLANT`` from telemetry: positions and velocities of all bodies against ground, forces."""
    x, v = plant["x"], plant["v"]
    columns = {"x": x, "v": v, "force": plant["force"]}
    for link, body in _FAR_END.items():
        if f"{link}.stretch" in plant:
            x, v = x + plant[f"{link}.stretch"], v + plant[f"{link}.rate"]
            columns |= {f"{body}_x": x, f"{body}_v": v}
    return columns | {name: plant[name] for name in ("actuator", "friction") if name in plant}
