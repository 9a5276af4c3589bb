"""Carrying out a swap or a set on the controller at its tick."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from haploop.controller.active_elements import ActiveElement, make_element
from haploop.controller.dissipation import Element, load_plugin
from haploop.controller.tick import ControllerParams, ControllerState
from haploop.protocol.changes import Change
from haploop.protocol.scene.scene import NO_ELEMENT, ElementTable

Kinds = dict[str, type[Element]]


def apply_change(
    change: Change, params: ControllerParams, state: ControllerState, kinds: Kinds
) -> tuple[ControllerParams, ControllerState]:
    """Returns parameters and state after a change that was checked before; whatever raises leaves both as they were.

    A plugin is loaded first; it lies in the run's own directory, put there by the launcher.
    """
    if change.plugin is not None:
        kinds.update(load_plugin(Path(change.plugin)))
    if change.swap is not None:
        params, state = _swapped(params, state, change, change.swap, kinds)
    for key, value in change.set.items():
        params = _set(params, change.tick, key.split("."), value)
    return params, state


def _swapped(
    params: ControllerParams, state: ControllerState, change: Change, table: ElementTable, kinds: Kinds
) -> tuple[ControllerParams, ControllerState]:
    """Both with a new element in its place, one more past the end, or one less; a new one's memory is fresh."""
    place, elements, memories, books = change.element, list(params.elements), list(state.elements), params.books
    if table.name == NO_ELEMENT:
        del elements[place]
        del memories[place]
    else:
        active = ActiveElement(*make_element(table, kinds), books, change.tick)
        elements[place : place + 1] = [active]
        memories[place : place + 1] = [active.element.memory]
        books += 1
    return replace(params, elements=tuple(elements), books=books), state._replace(elements=tuple(memories))


def _set(params: ControllerParams, tick: int, path: list[str], value: float) -> ControllerParams:
    match path:
        case ["wall", "stiffness" | "position" as name]:
            return replace(params, wall=replace(params.wall, **{name: value}))
        case ["clock", "round_trip_delay"]:
            return params  # the plant's to do
        case ["dissipation", place, name]:
            elements = list(params.elements)
            active = elements[int(place)]
            setattr(active.element, name, value)  # in place: what an element keeps of its own stays
            elements[int(place)] = replace(active, book=params.books, from_tick=tick)
            return replace(params, elements=tuple(elements), books=params.books + 1)
    raise KeyError(f"{'.'.join(path)} cannot be set while a loop runs")
