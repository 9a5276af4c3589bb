"""The data of a run's figure, read from the run's directory as far as they are there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from haploop.launch.runs.run_files import recorded_log, recorded_scene, recorded_summary
from haploop.launch.spec import PLUGINS
from haploop.logger.summary import Summary
from haploop.protocol.changes import Event, Span, changes_of, happened_at, spans
from haploop.protocol.scene.scene import ElementTable, Scene, Wall
from haploop.tools.render.scene_units import declared_units, element_units

Floats = np.ndarray
# Longest time of the last contact that the close view shows, and of the first that the loops show, s.
_CLOSE_S, _EARLY_S = 0.2, 1.0
TOGETHER = "together"


class FigureError(Exception):
    """The figure cannot be drawn; the message says why and what to do."""


@dataclass(eq=False)
class ElementSpan:
    """An element with one set of parameters and the ticks it covers; it has one book of energy.

    Attributes:
        from_tick, to_tick: ticks covered, half-open; the end is infinite while it is at work.
        slots: (place in the list of elements, from_tick, to_tick): where its force is in the log.
        name: name of its book in the log: the kind, numbered from the second of a kind on.
    """

    element: ElementTable
    from_tick: int
    to_tick: float
    slots: list[tuple[int, float, float]]
    name: str = ""


class WallSpan(NamedTuple):
    from_tick: int
    wall: Wall


class History:
    """Follows wall and elements of a scene through the events that took effect.

    Attributes:
        elements: every element that was ever at work, in the order of their books.
        walls: the wall and its changes; empty without one.
        into_wall: direction that leads into the wall, +1.0 or -1.0.
    """

    def __init__(self, scene: Scene, events: list[Event]) -> None:
        self.walls: list[WallSpan] = []
        self.into_wall = 1.0 if scene.wall and scene.wall.occupies == "above" else -1.0
        self.elements: list[ElementSpan] = []
        changes = changes_of((int(event.get("tick", 0)), event) for event in events)
        for span in spans(scene, (single for change in changes for single in change.singly())):
            wall = span.scene.wall
            if wall and (not self.walls or self.walls[-1].wall != wall):
                self.walls.append(WallSpan(span.from_tick, wall))
            for place, element in enumerate(span.scene.dissipation):
                self._follow(element, place, span)
        # An element replaced in the tick in which it came has no book.
        self.elements = [span for span in self.elements if span.to_tick > span.from_tick]
        for number, span in enumerate(self.elements):
            kind = span.element.name
            same = sum(before.element.name == kind for before in self.elements[:number])
            span.name = f"{kind}-{same + 1}" if same else kind

    def _follow(self, element: ElementTable, place: int, span: Span) -> None:
        """Continues an element that was at work up to this span, at this place or another, or begins a new one."""
        goes_on = (known for known in self.elements if known.element is element and known.to_tick == span.from_tick)
        found = next(goes_on, None)
        if found is None:
            found = ElementSpan(element, span.from_tick, span.to_tick, [])
            self.elements.append(found)
        found.to_tick = span.to_tick
        same = found.slots[-1:] and found.slots[-1][0] == place
        first = found.slots.pop()[1] if same else span.from_tick
        found.slots.append((place, first, span.to_tick))


@dataclass
class Book:
    """One running energy: its curves over time."""

    name: str
    t_s: Floats
    true_J: Floats
    sampled_J: Floats

    @property
    def ends_J(self) -> tuple[float, float]:
        """True and sampled book at the end of the run."""
        return float(self.true_J[-1]), float(self.sampled_J[-1])


@dataclass
class RunData:
    """The scene, summary and log of a run.

    Attributes:
        controller, energy: columns at every tick, with ``timestamp``.
        t_s, x_m, v_m_s, force_N: the motion at every plant step and the force applied from there on; where the plant
            was not logged (``every_step`` is False), what the controller measured and commanded at every tick.
        bodies_m, plant_forces_N: positions of the bodies beyond x, and forces of the plant's own effects, by name, at
            the same times.
        cut: where the log ends if it was cut off, else "".
        units: of the parameters of elements, by kind and name (``damping.damping``).
    """

    scene: Scene
    summary: Summary
    history: History
    events: list[Event]
    controller: dict[str, Floats]
    energy: dict[str, Floats]
    t_s: Floats
    x_m: Floats
    v_m_s: Floats
    force_N: Floats
    bodies_m: dict[str, Floats]
    plant_forces_N: dict[str, Floats]
    every_step: bool
    cut: str
    units: Mapping[str, str]

    @classmethod
    def from_directory(cls, directory: Path) -> RunData:
        """Reads a run's directory.

        Raises:
            FigureError: there is nothing to be drawn.
            LogError, SceneError: a file of it cannot be read.
        """
        if not (directory / "log.mcap").exists():
            raise FigureError(_no_log(directory))
        log = recorded_log(directory)
        controller, energy = log.get("/controller", {}), log.get("/energy", {})
        if not len(controller.get("timestamp", ())):
            raise FigureError(f"The log in {directory} holds no tick, so there is nothing to draw. {log.cut}")
        if (scene := recorded_scene(directory, log.attachments)) is None:
            raise FigureError(f"There is neither a scene in the log in {directory} nor a scene.toml beside it.")
        plant = log.get("/plant")
        if plant and len(plant["t"]) < 2:  # the plant was killed before it reported a tick
            plant = None
        motion = plant or {**controller, "t": controller["timestamp"], "force": controller["total"]}
        forces = {name: motion[name] for name in ("actuator", "friction") if name in motion}
        if plant and scene.actuator:
            forces.setdefault("actuator", plant["force"])
        events = [_as_happened(event, scene.clock.control_rate) for event in log.get("/events", [])]
        plugins = [data.decode(errors="replace") for name, data in log.attachments.items() if name.startswith(PLUGINS)]
        return cls(
            scene=scene,
            summary=recorded_summary(directory) or {},
            history=History(scene, events),
            events=events,
            controller=controller,
            energy=energy,
            t_s=motion["t"],
            x_m=motion["x"],
            v_m_s=motion["v"],
            force_N=motion.get("actuator", motion["force"]),
            bodies_m={name: motion[f"{name}_x"] for name in ("tip", "hand") if f"{name}_x" in motion},
            plant_forces_N=forces,
            every_step=plant is not None,
            cut=log.cut,
            units=element_units() | declared_units("\n".join(plugins)),
        )

    @property
    def as_measured(self) -> str:
        """Returns " as measured" where positions are those that the controller read, "" where they are true."""
        return "" if self.every_step else " as measured"

    @property
    def ticks_s(self) -> Floats:
        return self.controller["timestamp"]

    @property
    def control_rate(self) -> int:
        return self.scene.clock.control_rate

    @property
    def span_s(self) -> tuple[float, float]:
        """Begin and end of the log, s; its last tick lasts as long as the others."""
        return float(self.t_s[0]), float(max(self.t_s[-1], self.ticks_s[-1] + 1 / self.control_rate))

    def contact_s(self) -> Floats:
        return self.ticks_s[self.controller["in_contact"] > 0]

    def close_s(self) -> tuple[float, float]:
        """Returns the time of the close view: the last contact, or the end of a run without any."""
        first, last = self.span_s
        # In a run that failed or was killed, the log of the controller may extend beyond that of the plant.
        moves_until = float(self.t_s.max(initial=first))
        contact = self.contact_s()
        contact = contact[contact <= moves_until]
        if not len(contact):
            last = min(last, moves_until + 1 / self.control_rate)
            return max(first, last - _CLOSE_S), last
        recent = contact[contact > contact[-1] - _CLOSE_S]
        margin = 0.05 * (recent[-1] - recent[0]) + 0.002
        return max(first, float(recent[0]) - margin), min(last, float(recent[-1]) + margin)

    def early_s(self, from_tick: int = 0) -> tuple[float, float]:
        """Returns the first second of contact from a tick on, or the first second of a run without any."""
        contact = self.contact_s()
        contact = contact[contact >= from_tick / self.control_rate]
        first = float(contact[0]) if len(contact) else self.span_s[0]
        return first, first + _EARLY_S

    def wall_table_at(self, t_s: float) -> Wall | None:
        """Returns the table of the wall as it was at a time, None without a wall."""
        walls = [span.wall for span in self.history.walls if span.from_tick / self.control_rate <= t_s]
        return walls[-1] if walls else None

    def wall_at(self, t_s: Floats) -> tuple[Floats, Floats]:
        """Returns position (m) and stiffness (N/m) of the wall at some times."""
        walls = self.history.walls
        index = np.searchsorted([span.from_tick / self.control_rate for span in walls], t_s, side="right") - 1
        stood = np.array([(span.wall.position, span.wall.stiffness) for span in walls])[np.maximum(index, 0)]
        return stood[:, 0], stood[:, 1]

    def element_force(self, span: ElementSpan) -> tuple[Floats, Floats]:
        """Returns times (s) and force (N) of an element at the ticks it covers."""
        ticks = np.rint(self.ticks_s * self.control_rate)
        times, forces = [np.empty(0)], [np.empty(0)]
        for slot, first, end in span.slots:
            inside = (ticks >= first) & (ticks < end)
            column = self.controller.get(f"dissipation.{slot}")
            if column is not None and inside.any():
                times.append(self.ticks_s[inside])
                forces.append(column[inside])
        return np.concatenate(times), np.concatenate(forces)

    def books(self) -> list[Book]:
        """Returns the books of the wall and of the elements, then their sum; each ends with the end state."""
        ended = {} if self.cut else self.summary.get("energy", {})
        accounts = [("wall", 0, ended.get("wall"))] if self.history.walls else []
        ends = [*ended.get("elements", []), *[None] * len(self.history.elements)]
        accounts += [(span.name, span.from_tick, end) for span, end in zip(self.history.elements, ends, strict=False)]
        books = [self._book(*account) for account in accounts if f"{account[0]}.true" in self.energy]
        # A log may end between an element's start and its first books.
        books = [book for book in books if len(book.t_s)]
        if len(books) < 2:
            return books
        # All end together, each counting from its first tick on.
        t_s = max((book.t_s for book in books), key=len)
        true, sampled = np.zeros(len(t_s)), np.zeros(len(t_s))
        for book in books:
            true[len(t_s) - len(book.t_s) :] += book.true_J
            sampled[len(t_s) - len(book.t_s) :] += book.sampled_J
        return [*books, Book(TOGETHER, t_s, true, sampled)]

    def _book(self, name: str, from_tick: int, end: dict[str, float | None] | None) -> Book:
        t = self.energy["timestamp"]
        curves = [t, self.energy[f"{name}.true"], self.energy[f"{name}.sampled"]]
        kept = (t >= from_tick / self.control_rate) & ~np.isnan(curves[1])
        curves = [curve[kept] for curve in curves]
        if end:
            last = [self.span_s[1], *(np.nan if end[side] is None else end[side] for side in ("true_J", "sampled_J"))]
            curves = [np.append(curve, value) for curve, value in zip(curves, last, strict=True)]
        return Book(name, *curves)


def _no_log(directory: Path) -> str:
    if not directory.exists():
        return f"There is no {directory}; give the directory of a run."
    scene = recorded_scene(directory, {})
    if scene and scene.run.log == "none":
        return f'The run in {directory} was made with run.log = "none" and kept no log; run it again with "steps".'
    drawn = directory / "figure.png"
    there = f" {drawn} is there already." if drawn.exists() else ""
    return f"The directory {directory} holds no log.mcap; it is not the directory of a logged run.{there}"


def _as_happened(event: Event, rate: int) -> Event:
    """Returns an event of a log with the time at which it took effect, s."""
    on_record = int(event.get("tick", 0))
    tick = happened_at(on_record, event)
    return event if tick == on_record else {**event, "timestamp": tick / rate}
