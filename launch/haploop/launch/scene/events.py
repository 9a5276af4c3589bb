"""The ``[[event]]`` tables: whether each change fits the run it comes into, which a single table cannot show."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from pydantic_core import PydanticCustomError

from haploop.controller.active_elements import make_element
from haploop.launch.scene.mistakes import counted
from haploop.launch.scene.models import number_of
from haploop.launch.scene.number import Number
from haploop.launch.scene.reading.layers import KeyPath, Layers
from haploop.protocol.changes import Event
from haploop.protocol.names import nearest
from haploop.protocol.scene.scene import NO_ELEMENT, Clock, ElementTable, EventTable, Scene, Wall
from haploop.protocol.scene.table import Tables
from haploop.protocol.ticks import DELAY, Timebase, too_long, whole_count
from haploop.protocol.walls.registry import all_walls
from haploop.protocol.walls.wall import Spring
from haploop.protocol.walls.wall import Wall as WallLaw

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element

VERBS = ("swap", "set", "pause", "stop")
SETTABLE_OF_WALL = ("stiffness", "position")


def check_events(
    layers: Layers, time: Timebase | None, kinds: Mapping[str, type[Element]]
) -> dict[int, dict[str, float]]:
    """Walks the events in order of time and follows which element is in which slot.

    Removing an element, by kind "none", moves those after it up by one.

    Returns:
        Index of each event that sets something -> settable key -> SI value. Mistakes are added to ``layers``.
    """
    events = [(i, e) for i, e in enumerate(_tables(layers.data.get("event"))) if isinstance(e, dict)]
    if not events:
        return {}
    slots = [e.get("kind") if isinstance(e, dict) else None for e in _tables(layers.data.get("dissipation"))]
    wall = _wall_of(layers)
    settings: dict[int, dict[str, float]] = {}
    settable = settable_keys(slots, wall, kinds)
    for index, event in sorted(events, key=lambda item: _read(item[1], "at")):
        key = ("event", index)
        _check_shape(layers, key, event, time)
        if isinstance(event.get("swap"), dict):
            _swap(layers, key, event, slots)
            settable = settable_keys(slots, wall, kinds)
        if isinstance(event.get("set"), dict):
            settings[index] = {
                name: value
                for name, given in event["set"].items()
                if (value := _setting(layers, (*key, "set", name), given, settable, time)) is not None
            }
    return settings


def in_order_of_time(events: Iterable[Tables]) -> list[int]:
    """Returns the places of events in their file in the order in which they happen."""
    times = [_read(event, "at") for event in events]
    return sorted(range(len(times)), key=times.__getitem__)


def _check_shape(layers: Layers, key: KeyPath, event: Tables, time: Timebase | None) -> None:
    verbs = [verb for verb in VERBS if event.get(verb) is not None]
    if len(verbs) != 1:
        given = f"has {' and '.join(verbs)}" if verbs else "changes nothing"
        layers.complain(key, "An event has exactly one of swap, set, pause and stop.", given)
    if "element" in event and "swap" not in event:
        layers.complain((*key, "element"), "It is used only with swap.")
    at = _read(event, "at")
    if time and time.first_tick_at(at) >= time.ticks:
        last = (time.ticks - 1) / time.control_rate
        layers.complain((*key, "at"), f"It must be at most {last:g} s, the time of the last tick of the run.")


def _swap(layers: Layers, key: KeyPath, event: Tables, slots: list[Any]) -> None:
    element = _read(event, "element")
    kind = event["swap"].get("kind")
    if element < len(slots) + (kind != NO_ELEMENT):
        slots[element : element + 1] = [] if kind == NO_ELEMENT else [kind]
    else:
        expected = (
            f"The scene has {counted(len(slots), 'element')} at that time, counted from 0; one past the end adds one."
        )
        layers.complain((*key, "element"), expected, f"is {element}" + " by default" * ("element" not in event))


def settable_keys(
    slots: list[Any], wall: type[WallLaw] | None, kinds: Mapping[str, type[Element]]
) -> dict[str, Number]:
    """Returns every key that can be set while these kinds are at work, and the number that reads its value."""
    of_wall = {f"wall.{name}": number_of(Wall, name) for name in SETTABLE_OF_WALL if wall}
    of_wall |= {f"wall.{name}": Number(quantity) for name, quantity in (wall.keys if wall else {}).items()}
    elements = {
        f"dissipation.{slot}.{name}": Number(quantity)
        for slot, kind in enumerate(slots)
        if isinstance(kind, str) and kind in kinds
        for name, (quantity, _) in kinds[kind].parameters().items()
    }
    return of_wall | {DELAY: number_of(Clock, "round_trip_delay")} | elements


def _wall_of(layers: Layers) -> type[WallLaw] | None:
    """Returns the kind of the scene's wall; a spring for an unknown kind, which is a mistake reported elsewhere."""
    table = layers.data.get("wall")
    if not isinstance(table, dict):
        return None
    return all_walls().get(str(table["kind"]), Spring) if "kind" in table else Spring


def _setting(
    layers: Layers, key: KeyPath, given: Any, settable: dict[str, Number], time: Timebase | None
) -> float | None:
    name = str(key[-1])
    if isinstance(given, dict):
        layers.complain(
            key,
            f'Write the whole key in quotes, such as "{name}.{next(iter(given), "stiffness")}" = 1.0.',
            "is a table",
        )
    elif name not in settable:
        no_wall = name.startswith("wall.") and "wall.position" not in settable
        fixed = "" if no_wall else _fixed(name, settable)
        expected = f"{'The scene has no [wall]. ' * no_wall}{fixed}Allowed at that time: {', '.join(settable)}."
        layers.complain(key, expected, "cannot be set", _nearest_key(name, settable))
    else:
        try:
            value = settable[name].read(given)
        except PydanticCustomError as error:
            layers.complain(key, error.message())
            return None
        complaints: list[str] = []
        if name == DELAY and time:
            whole_count(value, time.plant_rate, "It", "plant steps", complaints)
            complaints += too_long("It", value, time.control_rate)
        for sentence in complaints:
            layers.complain(key, sentence)
        return value
    return None


def _fixed(name: str, settable: dict[str, Number]) -> str:
    """Returns a sentence on the table of a key if nothing in that table of a scene changes in a run; "" otherwise."""
    table = name.partition(".")[0]
    is_fixed = table != name and hasattr(Scene, table) and not any(key.startswith(f"{table}.") for key in settable)
    return f"Nothing in [{table}] changes during a run. " if is_fixed else ""


def _nearest_key(name: str, settable: dict[str, Number]) -> str | None:
    """Returns the key closest to ``name``: by its last part if the table is right, since long names begin alike."""
    if _fixed(name, settable):
        return None
    table, _, last = name.rpartition(".")
    names = {key.rpartition(".")[2]: key for key in settable if key.startswith(f"{table}.")}
    return names.get(nearest(last, names) or "") if names else nearest(name, settable)


def _read(event: Tables, key: str) -> Any:
    """Returns a number of an event; 0 where it is missing, or wrong, which is a mistake reported elsewhere."""
    try:
        return number_of(EventTable, key).read(event.get(key))
    except PydanticCustomError:
        return 0


def _tables(value: Any) -> list[Any]:
    return value if isinstance(value, list) else []


def elements_of(scene: Scene) -> list[ElementTable]:
    """Returns every element that a scene begins with or swaps in."""
    return [*scene.dissipation, *swapped_in(scene.event)]


def swapped_in(events: Iterable[EventTable]) -> list[ElementTable]:
    """Returns every element that these events bring."""
    return [event.swap for event in events if event.swap is not None and event.swap.name != NO_ELEMENT]


def try_out(tables: Iterable[ElementTable], kinds: Mapping[str, type[Element]]) -> None:
    """Makes each element once, since its own code may refuse with an ElementError what its declaration allows."""
    for table in tables:
        make_element(table, kinds)


def scene_events(scene: Scene, time: Timebase) -> list[tuple[int, Event]]:
    """Returns the events of a scene with their ticks, in order."""
    return [(time.first_tick_at(event.at), event.as_dict()) for event in scene.event]
