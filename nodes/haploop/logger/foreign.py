"""Checks of the telemetry of a plant or controller that is not haploop's own, before it is booked."""

from __future__ import annotations

from typing import Any

import numpy as np

from haploop.logger.books.buffers import PIECES, as_float64
from haploop.plant.chain.chain import Chain
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
from haploop.protocol.transport.messages import MESSAGES
from haploop.protocol.transport.messages import complaint as message_complaint
from haploop.protocol.transport.wire import Frame, Message
from haploop.protocol.walls.registry import class_of, parameters_of

_PLANT = ("x", "v", "x_low", "force", "command")
_CONTROLLER = ("x", "v", "a", "wall", "total", "in_contact")
# Where the device is, as reported by the plant, or measured: without it nothing is known.
_MOTION = ("x", "v")
_STATE = ("tick", "x", "v", "force", "command")
_ELEMENT = {"book": int, "kind": str, "parameters": dict, "from_tick": int}


def complaint(frame: Frame, role: str, scene: Scene, time: Timebase) -> str:
    """Returns what is wrong with a STATE or block of a foreign plant or controller, as a sentence; "" for nothing."""
    message = frame.as_dict()
    if frame.name not in ("STATE", "END", f"{role.upper()}_BLOCK"):
        return f"{frame.name} is not telemetry of a {role}, but came from it."
    if frame.name == "STATE":
        wrong = _state(message["state"], role, scene)
    elif frame.name == "PLANT_BLOCK":
        wrong = _columns(message, plant_columns(scene), message["ticks"] * time.steps_per_tick + 1)
    elif frame.name == "CONTROLLER_BLOCK":
        wrong = _controller_block(message, scene)
    else:
        return ""
    return wrong and f"A {frame.name} of the {role} from tick {frame.fields[0]} cannot be booked: {wrong}."


def plant_columns(scene: Scene) -> tuple[str, ...]:
    """Returns the columns without which the books of a scene's plant do not know all that moves."""
    chain, friction = Chain.from_scene(scene), ("friction", "stuck") if scene.friction else ()
    lows = (f"{name}_low" for name in chain.positions)
    return tuple(dict.fromkeys((*_PLANT, *chain.states, *lows, *friction)))


def _state(state: Message, role: str, scene: Scene) -> str:
    if role == "plant":
        missing = [name for name in _STATE if not _is_number(state.get(name))]
        return f"its state has no number for {' and '.join(missing)}" if missing else ""
    history = state.get("history")
    if not isinstance(history, list):
        return "its state has no list for history"
    names = [name for name, _ in MESSAGES["CONTROLLER_BLOCK"].fields]
    for block in history:
        fields: list[object] = [block.get(name) for name in names] if isinstance(block, dict) else []
        if wrong := message_complaint("CONTROLLER_BLOCK", fields) or _controller_block(block, scene):
            return f"in its history {wrong}"
    return ""


def _controller_block(block: Message, scene: Scene) -> str:
    names = (*_CONTROLLER, *(f"dissipation.{index}" for index in range(len(block["elements"]))))
    return _parts(block, scene) or _columns(block, names, block["ticks"])


def _columns(block: Message, names: tuple[str, ...], rows: int) -> str:
    columns = block["columns"]
    if block["ticks"] < 1 or block["from_tick"] < 0:
        return f"it has {block['ticks']} ticks"
    if missing := [name for name in names if name not in columns]:
        return f"it has no column {' and '.join(missing)}"
    for name, data in columns.items():
        if not isinstance(data, bytes) or len(data) % 8:
            return f"column {name} is not the bytes of float64 numbers"
        if len(data) != 8 * rows and not name.startswith(PIECES):
            return f"column {name} has {len(data) // 8} rows, but {rows} were expected"
        if name in _MOTION and not np.isfinite(as_float64(data)).all():
            return f"column {name} holds a value that is not a finite number"
    return ""


def _parts(block: Message, scene: Scene) -> str:
    wall, elements = block["wall"], block["elements"]
    needed = *parameters_of(class_of(scene.wall)), "into_wall"
    if missing := [name for name in needed if not _is_number(wall.get(name))]:
        return f"its wall has no number for {' and '.join(missing)}"
    if wall["into_wall"] not in (-1, 0, 1):
        return f"into_wall of its wall is {wall['into_wall']:g}, not -1, 0 or 1"
    for index, element in enumerate(elements):
        for key, kind in _ELEMENT.items():
            if not isinstance(element, dict) or not isinstance(element.get(key), kind):
                return f"element {index} has no {kind.__name__} for {key}"
        parameters = element["parameters"].items()
        if not all(isinstance(name, str) and isinstance(value, int | float | str) for name, value in parameters):
            return f"a parameter of element {index} is neither a number nor text"
    if len({element["book"] for element in elements}) < len(elements):
        return "two elements have the same book"
    return ""


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
