"""Telemetry of programs of somebody else's: whatever comes is booked as it is, or refused with a sentence."""

from __future__ import annotations

import random
import struct
from typing import Any

import pytest

from haploop.launch.scene.file import load
from haploop.logger.foreign import complaint
from haploop.protocol.ticks import Timebase
from haploop.protocol.transport.wire import Frame
from helpers.live.launched import SCENE

TICKS = 3
PLANT = ("x", "v", "x_low", "force", "command")
CONTROLLER = ("x", "v", "a", "wall", "dissipation.0", "total", "in_contact")
ELEMENT = {"book": 0, "kind": "unidirectional-inertia", "parameters": {"mass": 0.01}, "from_tick": 0}
WALL = {"position": -0.06, "stiffness": 150.0, "into_wall": -1.0}
ODD = (None, True, -1, 2**63, 1.5, float("nan"), "x", "", b"", b"x", b"12345678", [], [1], {}, {"x": 1}, {1: b"2"})


def columns(names: tuple[str, ...], rows: int) -> dict[str, bytes]:
    return {name: struct.pack(f"<{rows}d", *range(rows)) for name in names}


def plant(**changed: Any) -> Frame:
    return Frame(
        "PLANT_BLOCK", list(({"from_tick": 0, "ticks": TICKS, "columns": columns(PLANT, 31)} | changed).values())
    )


def controller(**changed: Any) -> Frame:
    fields = {
        "from_tick": 0,
        "ticks": TICKS,
        "columns": columns(CONTROLLER, TICKS),
        "elements": [ELEMENT],
        "wall": WALL,
    }
    return Frame("CONTROLLER_BLOCK", list((fields | changed).values()))


def said(frame: Frame, role: str) -> str:
    scene = load(SCENE)
    return complaint(frame, role, scene, Timebase.from_scene(scene))


def test_what_a_node_owes_is_taken() -> None:
    assert said(plant(), "plant") == said(controller(), "controller") == ""
    assert said(controller(elements=[], columns=columns(CONTROLLER, TICKS)), "controller") == ""
    names = ("from_tick", "ticks", "columns", "elements", "wall")
    for history in ([], [dict(zip(names, controller().fields, strict=True))]):
        assert said(Frame("STATE", [0, {"history": history}]), "controller") == ""


@pytest.mark.parametrize(
    ("frame", "role", "words"),
    [
        (plant(ticks=2), "plant", "column x has 31 rows, but 21 were expected"),
        (plant(ticks=0), "plant", "it has 0 ticks"),
        (plant(columns=columns(PLANT[1:], 31)), "plant", "it has no column x"),
        (plant(columns=columns(PLANT, 31) | {"v": b"123"}), "plant", "column v is not the bytes of float64 numbers"),
        (
            plant(columns=columns(PLANT, 31) | {"x": b"\xff" * 248}),
            "plant",
            "column x holds a value that is not a finite number",
        ),
        (plant(), "controller", "PLANT_BLOCK is not telemetry of a controller, but came from it."),
        (controller(wall=WALL | {"stiffness": "soft"}), "controller", "its wall has no number for stiffness"),
        (controller(wall=WALL | {"into_wall": 2}), "controller", "into_wall of its wall is 2, not -1, 0 or 1"),
        (controller(elements=[{**ELEMENT, "book": "0"}]), "controller", "element 0 has no int for book"),
        (controller(elements=[{**ELEMENT, "parameters": {"mass": b"1"}}]), "controller", "neither a number nor text"),
        (controller(elements=[ELEMENT] * 2), "controller", "two elements have the same book"),
        (controller(elements=[ELEMENT, {**ELEMENT, "book": 1}]), "controller", "it has no column dissipation.1"),
        (Frame("STATE", [0, {"history": [5]}]), "controller", "in its history CONTROLLER_BLOCK has 5 fields"),
        (Frame("STATE", [0, {"tick": 0, "x": 0.0, "v": None, "force": 0.0}]), "plant", "no number for v and command"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_block_is_said(frame: Frame, role: str, words: str) -> None:
    assert words in said(frame, role)


def test_no_block_however_odd_raises() -> None:
    dice = random.Random(17)
    for _ in range(150):
        name, good = dice.choice((("plant", plant()), ("controller", controller())))
        fields = list(good.fields)
        place = dice.randrange(2, len(fields))
        inner = dict(fields[place]) if isinstance(fields[place], dict) else list(fields[place])
        if isinstance(inner, dict):
            inner[dice.choice(list(inner))] = dice.choice(ODD)
        else:
            inner = [dice.choice(ODD) for _ in range(2)]
        fields[place] = inner
        assert isinstance(said(Frame(good.name, fields), name), str)
