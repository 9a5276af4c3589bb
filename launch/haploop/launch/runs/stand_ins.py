"""Stand-ins for what a run took from packages and files that are not here: they hold its numbers, nothing else."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import make_dataclass
from typing import Annotated, Any, ClassVar

from haploop.controller.dissipation import Element, registry
from haploop.controller.dissipation.element import hint_of
from haploop.controller.estimators.base import Estimator
from haploop.controller.estimators.choose import estimator_class
from haploop.protocol.installed import all_brought, bring, take_back
from haploop.protocol.quantity import Quantity
from haploop.protocol.register import UnknownKind
from haploop.protocol.scene.hand_force import FORCES, HandForce, UnknownForce
from haploop.protocol.scene.scene import NO_ELEMENT
from haploop.protocol.scene.table import Tables
from haploop.protocol.walls.registry import wall_class
from haploop.protocol.walls.wall import Wall

_OF_WALL, _OF_ESTIMATE = {"kind", "position", "stiffness", "occupies"}, {"estimator", "source", "cutoff"}


@contextmanager
def standing_in(tables: Tables) -> Iterator[None]:
    """Makes a scene readable whose wall, estimators and hand force are not available, with its own numbers."""
    known = all_brought()
    if (name := _missing(wall_class, wall := _table(tables, "wall"), "kind")) is not None:
        body = {"kind": name, "keys": _numbers(wall, _OF_WALL)}
        fields = [(key, Any, None) for key in body["keys"]]
        bring({Wall.group: {name: make_dataclass("StandIn", fields, bases=(_Wall,), namespace=body, frozen=True)}})
    for of in ("velocity", "acceleration"):
        if (name := _missing(estimator_class, table := _table(tables, of), "estimator")) is not None:
            body = {"name": name, "keys": _numbers(table, _OF_ESTIMATE), "takes": tuple(table)}
            bring({Estimator.group: {name: type("StandIn", (_Estimator,), body)}})
    if (name := _missing(FORCES.find, force := _table(_table(tables, "hand"), "force"), "kind")) is not None:
        hints = {key: Annotated[float, quantity] for key, quantity in _numbers(force, {"kind"}).items()}
        body = {"kind": name, "__annotations__": hints, "__module__": __name__}
        bring({HandForce.group: {name: type("StandIn", (UnknownForce,), body)}})
    try:
        yield
    finally:
        take_back(known)


def _table(tables: Tables, key: str) -> Tables:
    table = tables.get(key)
    return table if isinstance(table, dict) else {}


def _missing(find: Callable[[str], object], table: Tables, key: str) -> str | None:
    """Returns the name at a key of a table if nothing available has this name; else None."""
    name = table.get(key)
    try:
        if isinstance(name, str):
            find(name)
    except UnknownKind:
        return name
    return None


def _numbers(table: Tables, apart: set[str]) -> dict[str, Quantity]:
    return {key: Quantity("") for key in table if key not in apart and key.isidentifier()}


class _Wall(Wall):
    """Stands in for an unknown wall: its force is NaN."""

    def push(self, depth: Any, speed: Any) -> Any:
        return depth * float("nan")

    def stored(self, depth: Any) -> Any:
        return depth * float("nan")


class _Estimator(Estimator):
    """Stands in for an unknown estimator: it estimates nothing."""

    does: ClassVar[str] = "that of a kind which is not installed here"

    @classmethod
    def from_scene(cls, scene: Any, of: str, period_s: float) -> Any:
        raise UnknownKind(f"The estimator {cls.name} is not installed here.")

    def start(self, u: Any, sample: Any) -> Any:
        raise UnknownKind(f"The estimator {self.name} is not installed here.")

    def step(self, memory: Any, u: Any, sample: Any) -> Any:
        raise UnknownKind(f"The estimator {self.name} is not installed here.")


def elements_for(tables: Tables) -> dict[str, type[Element]]:
    """Makes an element for each kind that a scene names but that is not installed, with the values that it gives."""
    given: dict[str, dict[str, list[Any]]] = {}
    for table in _elements(tables):
        values = given.setdefault(table["kind"], {})
        for name in table:
            if name.isidentifier() and name not in ("kind", "acts"):
                values.setdefault(name, []).append(table[name])
    events = tables.get("event")
    sets = [event.get("set") for event in events if isinstance(event, dict)] if isinstance(events, list) else []
    later = [value for each in sets if isinstance(each, dict) for value in each.values()]
    made = {}
    for kind, values in given.items():
        hints = {name: hint_of(Quantity("", choices=_choices(of, later))) for name, of in values.items()}
        body = {"kind": kind, "force": lambda self, motion: 0.0, "__annotations__": hints}
        made[kind] = type("StandIn", (Element,), body)
    return made


def _choices(values: list[Any], later: list[Any]) -> tuple[str | bool, ...]:
    """Returns the choices of a parameter with these values: none for a number, all texts that occur for a text."""
    if any(isinstance(value, bool) for value in values):
        return False, True
    if not any(isinstance(value, str) for value in values):
        return ()
    return tuple(dict.fromkeys(value for value in (*values, *later) if isinstance(value, str)))


def _elements(tables: Tables) -> Iterator[Tables]:
    installed = registry()
    lists = [tables.get(key) for key in ("dissipation", "event")]
    entries = [entry for one in lists if isinstance(one, list) for entry in one if isinstance(entry, dict)]
    for entry in entries:
        table = entry.get("swap", entry)
        kind = table.get("kind") if isinstance(table, dict) else None
        if isinstance(kind, str) and kind not in (*installed, NO_ELEMENT):
            yield table
