"""The history of a run: motion, forces and energy over time, in bounded memory."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from haploop.logger.log.channels import motion_columns
from haploop.protocol.scene.scene import ElementTable, Wall
from haploop.protocol.ticks import Timebase
from haploop.protocol.transport.telemetry import Block
from haploop.view.store.lod_series import LodSeries

Columns = Mapping[str, np.ndarray]
# Ticks held in full; plant steps, which allow fewer ticks where a tick has very many; the fewest ticks.
_RECENT_TICKS, _RECENT_STEPS, _LEAST_TICKS = 16_384, 131_072, 512
# Number of books of elements that are kept, the newest: every change of a parameter opens one.
_MOST_BOOKS = 16
# Number of own columns of elements that are kept at once, so that they crowd out no force.
_MOST_OWN = 16
_NO_UNITS: Mapping[str, str] = MappingProxyType({})
TRUE, WALL_BOOK, EARLIER = ".true", "wall.true", "earlier.true"


class AtWork(NamedTuple):
    """The elements by place, and the wall, that are at work; none before anything is known."""

    elements: tuple[ElementTable, ...] = ()
    wall: Wall | None = None

    @classmethod
    def of_block(cls, block: Block) -> AtWork:
        elements = [
            ElementTable.from_dict({"kind": element["kind"], **element["parameters"]}) for element in block["elements"]
        ]
        now = dict(block["wall"])
        inward = now.pop("into_wall")
        wall = Wall.from_dict({**now, "occupies": "above" if inward > 0.0 else "below"})
        return cls(tuple(elements), wall if inward else None)

    @property
    def into_wall(self) -> float:
        """Returns the direction that leads into the wall, +1.0 or -1.0; 0.0 without one."""
        return 0.0 if self.wall is None else 1.0 if self.wall.occupies == "above" else -1.0


class History:
    """Keeps three series of columns of one run.

    Args:
        origin: no rows come from before this tick.

    Attributes:
        steps: at plant steps: x, tip_x and hand_x where there are such bodies, and the force on the device.
        ticks: at control ticks: x_measured, v, forces of the wall and of each element (``element.<place>.<kind>``),
            their total, the wall's position and stiffness (NaN without one), the mass of each virtual inertia while
            it is at work, else 0 (``mass.<place>.<kind>``), and own columns (``own.<place>.<kind>.<name>``).
        own: unit and label of each of these own columns of elements, by name.
        energy: at ticks: the true book of the wall and of each element (``<name>.true``; ``earlier.true`` is the sum of
            those not kept separately), the plant's books, those that split the wall's by cause, and the residual.
        opened: tick at which each column of ``energy`` began; None where it may have begun before what is known.
        at_work: at the newest ticks of the controller.
        stop_tick: tick at which the plant has ended; None before.
        version: changes with every row that is appended.
    """

    def __init__(self, time: Timebase, origin: int) -> None:
        self.time = time
        recent = max(_LEAST_TICKS, min(_RECENT_TICKS, _RECENT_STEPS // time.steps_per_tick))
        self.steps = LodSeries(time.steps_per_tick, recent, origin)
        self.ticks = LodSeries(1, _RECENT_TICKS, origin)
        self.energy = LodSeries(1, _RECENT_TICKS, origin)
        self.all_series = self.steps, self.ticks, self.energy
        self.at_work = AtWork()
        self.own: dict[str, tuple[str, str]] = {}
        self.opened: dict[str, int | None] = {}
        self.stop_tick: int | None = None
        self.version = 0
        self._end_state: dict[str, np.ndarray] = {}
        self._told: tuple[object, AtWork] = None, self.at_work

    def at_work_in(self, block: Block) -> AtWork:
        """Returns what was at work in a block of the controller; decoded once if successive blocks report the same."""
        told = block["elements"], block["wall"]
        if told != self._told[0]:
            self._told = told, AtWork.of_block(block)
        return self._told[1]

    @property
    def first_tick(self) -> int | None:
        """Returns the first tick of which anything is known; None before anything is."""
        return min((series.first_tick for series in self.all_series if series.first_tick is not None), default=None)

    @property
    def end_tick(self) -> int:
        """Returns the tick from which on nothing is known."""
        return max(self.first_tick or 0, *(series.end_tick for series in self.all_series))

    def _append(self, series: LodSeries, tick: int, columns: Columns) -> None:
        if tick + len(next(iter(columns.values()))) // series.rows_per_tick > series.end_tick:
            self.version += 1
            series.append(tick, columns)

    def append_plant_block(self, tick: int, columns: dict[str, np.ndarray]) -> None:
        """Appends telemetry of the plant: ``ticks * n + 1`` rows, the end state included."""
        motion = motion_columns(columns)
        kept = {name: motion[name] for name in ("x", "tip_x", "hand_x") if name in motion}
        kept["force"] = motion.get("actuator", motion["force"])
        self.append_steps(tick, {name: column[:-1] for name, column in kept.items()})
        self._end_state = {name: column[-1:] for name, column in kept.items()}

    def append_steps(self, tick: int, columns: Columns) -> None:
        """Appends x (tip_x, hand_x) and force at every step of some ticks."""
        self._append(self.steps, tick, columns)

    def end(self, tick: int, state: Columns | None = None) -> None:
        """Ends the plant's series at ``tick`` with this state, or with that of the last telemetry."""
        self.stop_tick = tick
        state = state or self._end_state
        if state and tick == self.steps.end_tick:
            beyond = np.full(self.time.steps_per_tick - 1, np.nan)
            self.append_steps(tick, {name: np.concatenate([value, beyond]) for name, value in state.items()})

    def append_ticks(self, tick: int, columns: Columns, at_work: AtWork, units: Mapping[str, str] = _NO_UNITS) -> None:
        """Appends rows of the controller, x, v, wall, total and ``dissipation.<place>``, all with this ``at_work``.

        An element without a column has not come yet. ``units`` has the units of ``dissipation.<place>.<name>``.
        """
        self.at_work, wall = at_work, at_work.wall
        kept = {"x_measured": columns["x"], "v": columns["v"], "wall": columns["wall"], "total": columns["total"]}
        for name, value in (("position", wall and wall.position), ("stiffness", wall and wall.stiffness)):
            kept[f"wall_{name}"] = np.full(len(columns["x"]), np.nan if value is None else value)
        for place, element in enumerate(at_work.elements):
            force = columns.get(f"dissipation.{place}")
            if force is None:
                continue
            kept[f"element.{place}.{element.name}"] = force
            if "inertia" in element.name and "mass" in element.parameters:
                kept[f"mass.{place}.{element.name}"] = np.where(force != 0.0, element.parameters["mass"], 0.0)
        for column in [name for name in units if np.isfinite(columns[name]).any()][:_MOST_OWN]:
            _, place, name = column.split(".", 2)
            if int(place) >= len(at_work.elements):
                continue
            kind = at_work.elements[int(place)].name
            kept[known := f"own.{place}.{kind}.{name}"] = columns[column]
            self.own[known] = units[column], f"element {place}: {kind}, {name}"
        self._append(self.ticks, tick, kept)

    def append_energy(self, tick: int, columns: Columns) -> None:
        """Appends running books, by name."""
        elements = [name for name in columns if name.endswith(TRUE) and name != WALL_BOOK]
        earlier = elements[:-_MOST_BOOKS]
        kept = {name: column for name, column in columns.items() if name not in earlier}
        if earlier:
            kept[EARLIER] = np.nansum([columns[name] for name in earlier], axis=0)
        for name in kept.keys() - self.opened.keys():
            known = int(np.isfinite(kept[name]).argmax())
            goes_on = bool(self.energy.names) and self.energy.end_tick == tick
            self.opened[name] = tick + known if known or goes_on or not tick else None
        self._append(self.energy, tick, kept)

    def extend_from(self, other: History) -> None:
        """Appends what another history of the same run has and this one has not reached."""
        for own, its in zip(self.all_series, other.all_series, strict=True):
            own.extend_from(its)
        if other.ticks.first_tick is not None:
            self.at_work, self.own = other.at_work, self.own | other.own
        self.opened = {**other.opened, **self.opened}
        self._end_state = other._end_state
        self.stop_tick = other.stop_tick if self.stop_tick is None else self.stop_tick
        self.version += other.version + 1
