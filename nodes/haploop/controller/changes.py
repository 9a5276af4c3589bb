"""Carrying out a swap or a set at its tick: the only things that change a controller while it runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from haploop.controller.active_elements import Slots
from haploop.controller.dissipation import Element, load_plugin
from haploop.controller.wall import Wall

Change = dict[str, Any]


def apply_change(change: Change, tick: int, slots: Slots, wall: Wall, kinds: dict[str, type[Element]]) -> str | None:
    """Carry out a change that was checked before; returns why it could not be done, or None.

    Whatever fails leaves slots and wall as they were. ``plugin`` names a file that is loaded first; it lies in the
    run's own directory, put there by the launcher.
    """
    try:
        if "plugin" in change:
            kinds.update(load_plugin(Path(change["plugin"])))
        if "swap" in change:
            slots.swap(change.get("element", 0), change["swap"], tick)
        for key, value in change.get("set", {}).items():
            _set(key.split("."), value, tick, slots, wall)
    except Exception as error:
        return f"{describe(change)} at tick {tick} was refused: {type(error).__name__}: {error}"
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


def describe(change: Change) -> str:
    """The change in a few words, for logs and messages."""
    if "swap" in change:
        table = dict(change["swap"])
        kind = table.pop("kind")
        parameters = ", ".join(f"{name} = {value}" for name, value in table.items())
        return f"swap of element {change.get('element', 0)} to {kind}" + (f" ({parameters})" if parameters else "")
    if "set" in change:
        return "set " + ", ".join(f"{key} = {value}" for key, value in change["set"].items())
    return next(iter(change))
