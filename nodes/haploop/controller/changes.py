"""Changes in a running loop: a swap, a set, and a swap taken back, as functions of controller parameters and state."""

from __future__ import annotations

import math
from copy import deepcopy
from dataclasses import replace
from pathlib import Path

from haploop.controller.active_elements import ActiveElement, make_element
from haploop.controller.asked import first_memory
from haploop.controller.dissipation import Element, ElementError, load_plugin
from haploop.controller.dissipation.element import place_in
from haploop.controller.estimators.base import Sample
from haploop.controller.tick import MOTION_COLUMNS, ControllerParams, ControllerState, tick
from haploop.protocol.arrays import where
from haploop.protocol.changes import Change
from haploop.protocol.scene.scene import NO_ELEMENT, ElementTable

Kinds = dict[str, type[Element]]


def apply_change(
    change: Change, params: ControllerParams, state: ControllerState, kinds: Kinds
) -> tuple[ControllerParams, ControllerState]:
    """Returns parameters and state after a change that was checked before; if anything raises, both stay unchanged."""
    if change.swap is not None:
        params, state = _swapped(params, state, change, change.swap, kinds)
    for key, value in change.set.items():
        params = _set(params, change.tick, key.split("."), value)
    return params, state


def code_of(change: Change) -> Kinds:
    """Loads the plugin that comes with a change; the launcher has put it into the run's own directory."""
    return {} if change.plugin is None else load_plugin(Path(change.plugin))


def _swapped(
    params: ControllerParams, state: ControllerState, change: Change, table: ElementTable, kinds: Kinds
) -> tuple[ControllerParams, ControllerState]:
    """Returns both with an element replaced, appended or removed; the memory of a new one is fresh."""
    if table.name == NO_ELEMENT:
        return _replaced(params, state, change.element, None)
    before = replace(params.elements[change.element], swapped=None) if change.element < len(params.elements) else None
    came = (change.tick, before, change.plugin)
    active = ActiveElement(*make_element(table, kinds), params.books, change.tick, came)
    return _replaced(params, state, change.element, active)


def _replaced(
    params: ControllerParams, state: ControllerState, place: int, active: ActiveElement | None
) -> tuple[ControllerParams, ControllerState]:
    """Returns both with an element put in a place, with a fresh memory, or with that place removed."""
    elements, memories, books = list(params.elements), list(state.elements), params.books
    elements[place : place + 1] = [active] if active else []
    memories[place : place + 1] = [first_memory(active.element, params.declared)] if active else []
    books += active is not None
    return replace(params, elements=tuple(elements), books=books), state._replace(elements=tuple(memories))


def try_element(place: int, params: ControllerParams, state: ControllerState, sample: Sample) -> None:
    """Makes a new element answer a sample on a copy of everything, so that the trial changes nothing.

    Raises:
        NoForce: the element raises.
        ElementError: it gives a force that is not finite although the motion is.
    """
    try:
        copied = deepcopy(params)
    except Exception:  # an element that holds something that cannot be copied is not tried
        return
    *_, row = tick(copied, state, sample)
    x, force = row[0], row[len(MOTION_COLUMNS) + place]
    is_good = where(abs(x) < math.inf, abs(force) < math.inf, True)
    if not (is_good if isinstance(is_good, bool) else is_good.all()):
        where_it_is = place_in(type(params.elements[place].element))
        raise ElementError(f"it gave {force} when it was tried on the motion of this tick{where_it_is}")


def take_back(
    place: int, before: ActiveElement | None, params: ControllerParams, state: ControllerState, at: int
) -> tuple[Change, ControllerParams, ControllerState]:
    """Returns the change that undoes a swap, with parameters and state after it; what was there is made again."""
    table = ElementTable(name=NO_ELEMENT)
    if before:
        of = before.element
        table = ElementTable.from_dict({"kind": of.kind, "acts": before.acts, **of.values()})
        before = ActiveElement(type(of)(**table.parameters), before.acts, params.books, at)
    return Change(at, table, place), *_replaced(params, state, place, before)


def _set(params: ControllerParams, tick: int, path: list[str], value: float) -> ControllerParams:
    match path:
        case ["wall", name] if name in params.wall.values():
            return replace(params, wall=replace(params.wall, **{name: value}))
        case ["clock", "round_trip_delay"]:  # the plant carries it out; elements that ask are told
            steps = round(value * params.declared.steps / params.motion.period_s)
            return replace(params, declared=params.declared.delayed(steps))
        case ["dissipation", place, name]:
            elements = list(params.elements)
            active = elements[int(place)]
            if name not in active.element.values():
                raise KeyError(f"the element {active.element.kind} has no {name}")
            setattr(active.element, name, value)  # in place, so that what an element keeps of its own stays
            elements[int(place)] = replace(active, book=params.books, from_tick=tick)
            return replace(params, elements=tuple(elements), books=params.books + 1)
    raise KeyError(f"{'.'.join(path)} cannot be set while a loop runs")
