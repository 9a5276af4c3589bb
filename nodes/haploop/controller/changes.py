"""Carrying out a swap or a set on the controller at its tick."""

from __future__ import annotations

from pathlib import Path

from haploop.controller.active_elements import Slots
from haploop.controller.dissipation import Element, load_plugin
from haploop.controller.wall import Wall
from haploop.protocol.changes import Change


def apply_change(change: Change, slots: Slots, wall: Wall, kinds: dict[str, type[Element]]) -> Change | None:
    """Carries out a change that was checked before; returns the change, refused, where that failed, else None.

    Whatever fails leaves slots and wall as they were. A plugin is loaded first; it lies in the run's own directory,
    put there by the launcher.
    """
    try:
        if change.plugin is not None:
            kinds.update(load_plugin(Path(change.plugin)))
        if change.swap is not None:
            slots.swap(change.element, dict(change.swap), change.tick)
        for key, value in change.set.items():
            _set(key.split("."), value, change.tick, slots, wall)
    except Exception as error:
        return change.refuse(error)
    return None


def _set(path: list[str], value: float, tick: int, slots: Slots, wall: Wall) -> None:
    match path:
        case ["wall", "stiffness" | "position" as name]:
            setattr(wall, name, value)
        case ["clock", "round_trip_delay"]:
            pass  # the plant's to do
        case ["dissipation", index, name]:
            slots.set_parameter(int(index), name, value, tick)
        case _:
            raise KeyError(f"{'.'.join(path)} cannot be set while a loop runs")
