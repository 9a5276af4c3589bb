"""What was heard of a run: motion, forces and energy over time, in bounded memory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from haploop.logger.log.columns import motion_columns
from haploop.protocol.ticks import Timebase
from haploop.view.store.lod_series import Track

Columns = Mapping[str, np.ndarray]
# Ticks held in full, and plant steps, of which fewer are held where a tick has very many.
_RECENT_TICKS, _RECENT_STEPS, _LEAST_TICKS = 16_384, 131_072, 512
# Books of elements that are kept: every change of a parameter opens one.
_MOST_BOOKS = 16
TRUE, WALL_BOOK = ".true", "wall.true"


class History:
    """Three tracks of one run.

    Args:
        time: the integers of the run.
        origin: no rows come from before this tick.

    Attributes:
        steps: at plant steps: x, tip_x and hand_x where there are such bodies, and the force on the device.
        ticks: at control ticks: x_measured, v, forces of the wall and of each element (``element.<place>.<kind>``),
            their total, the wall's position and stiffness (NaN without one), and the mass of each virtual inertia while
            it is at work, else 0 (``mass.<place>.<kind>``).
        energy: at ticks: the true book of the wall and of each element (``<name>.true``), and the residual.
        elements, wall: as they stood in the last ticks of the controller.
        into_wall: direction that leads into the wall, +1.0 or -1.0; 0.0 without one.
        over_tick: where the plant has ended; None before.
        version: another number whenever anything has come.
    """

    def __init__(self, time: Timebase, origin: int) -> None:
        self.time = time
        recent = max(_LEAST_TICKS, min(_RECENT_TICKS, _RECENT_STEPS // time.steps_per_tick))
        self.steps = Track(time.steps_per_tick, recent, origin)
        self.ticks = Track(1, _RECENT_TICKS, origin)
        self.energy = Track(1, _RECENT_TICKS, origin)
        self.elements: Sequence[Mapping[str, Any]] = ()
        self.wall: Mapping[str, float] = {}
        self.into_wall = 0.0
        self.over_tick: int | None = None
        self.version = 0
        self._end_state: dict[str, np.ndarray] = {}

    @property
    def tracks(self) -> tuple[Track, Track, Track]:
        """All three."""
        return self.steps, self.ticks, self.energy

    @property
    def first_tick(self) -> int | None:
        """The first tick of which anything is known; None before the first."""
        return min((track.first_tick for track in self.tracks if track.first_tick is not None), default=None)

    @property
    def end_tick(self) -> int:
        """Nothing is known from here on."""
        return max(self.first_tick or 0, *(track.end_tick for track in self.tracks))

    def begin(self, role: str, tick: int) -> None:
        """What a node publishes from ``tick`` on is to come."""
        {"plant": self.steps, "controller": self.ticks, "logger": self.energy}[role].begin(tick)

    def _append(self, track: Track, tick: int, columns: Columns) -> None:
        if tick + len(next(iter(columns.values()))) // track.rows_per_tick > track.end_tick:
            self.version += 1
            track.append(tick, columns)

    def plant(self, tick: int, columns: Columns) -> None:
        """Take telemetry of the plant: ``ticks * n + 1`` rows, the end state included."""
        motion = motion_columns(dict(columns))
        kept = {name: motion[name] for name in ("x", "tip_x", "hand_x") if name in motion}
        kept["force"] = motion.get("actuator", motion["force"])
        self.moved(tick, {name: column[:-1] for name, column in kept.items()})
        self._end_state = {name: column[-1:] for name, column in kept.items()}

    def moved(self, tick: int, columns: Columns) -> None:
        """Take x (tip_x, hand_x) and force at every step of some ticks."""
        self._append(self.steps, tick, columns)

    def ended(self, tick: int, state: Columns | None = None) -> None:
        """The plant has ended at ``tick`` in this state, or in that of the last telemetry."""
        self.over_tick = tick
        state = state or self._end_state
        if state and tick == self.steps.end_tick:
            beyond = np.full(self.time.steps_per_tick - 1, np.nan)
            self.moved(tick, {name: np.concatenate([value, beyond]) for name, value in state.items()})

    def controlled(
        self, tick: int, columns: Columns, elements: Sequence[Mapping[str, Any]], wall: Mapping[str, float]
    ) -> None:
        """Take rows of the controller during which the elements and the wall stayed the same.

        Args:
            tick: the first of them.
            columns: x, v, wall, total and ``dissipation.<place>``.
            elements: kind and parameters by place.
            wall: position, stiffness and into_wall, which is 0 without one.
        """
        rows = len(columns["x"])
        kept = {"x_measured": columns["x"], "v": columns["v"], "wall": columns["wall"], "total": columns["total"]}
        for name in ("position", "stiffness"):
            kept[f"wall_{name}"] = np.full(rows, wall[name] if wall["into_wall"] else np.nan)
        for place, element in enumerate(elements):
            force = columns[f"dissipation.{place}"]
            kept[f"element.{place}.{element['kind']}"] = force
            if "inertia" in element["kind"] and "mass" in element["parameters"]:
                mass = element["parameters"]["mass"]
                kept[f"mass.{place}.{element['kind']}"] = np.where(force != 0.0, mass, 0.0)
        self.works(elements, wall)
        self._append(self.ticks, tick, kept)

    def works(self, elements: Sequence[Mapping[str, Any]], wall: Mapping[str, float]) -> None:
        """Take note of the elements and the wall that are at work now."""
        self.elements, self.wall, self.into_wall = elements, wall, wall["into_wall"]

    def booked(self, tick: int, columns: Columns) -> None:
        """Take running books, by name."""
        elements = [name for name in columns if name.endswith(TRUE) and name != WALL_BOOK]
        kept = ["residual", WALL_BOOK, *elements[-_MOST_BOOKS:]]
        self._append(self.energy, tick, {name: columns[name] for name in kept if name in columns})

    def continue_with(self, other: History) -> None:
        """Take from another history of the same run what this one has not reached."""
        for own, its in zip(self.tracks, other.tracks, strict=True):
            own.continue_with(its)
        if other.wall:
            self.works(other.elements, other.wall)
        self._end_state = other._end_state
        self.over_tick = other.over_tick if self.over_tick is None else self.over_tick
        self.version += other.version + 1
