"""The controller and the books of a scene around a foreign plant, in this process."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from haploop.controller.controller import Controller
from haploop.logger.logger import Logger
from haploop.logger.summary import Summary
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
from helpers.scenes.least import KINDS

Step = Callable[[float], tuple[float, float]]


def booked(scene: Scene, columns: dict[str, Any], controller: Controller, foreign: tuple[str, ...] = ()) -> Summary:
    """Returns the summary that the logger writes from the rows of a plant and those recorded by the controller."""
    time = Timebase.from_scene(scene)
    logger = Logger(scene, time, None)
    logger.foreign = foreign
    rows = {name: np.ascontiguousarray(column, "<f8") for name, column in columns.items()}
    logger.start({"tick": 0, **{name: float(rows[name][0]) for name in ("x", "v", "force")}}, [])
    blocks = {name: column.tobytes() for name, column in rows.items()}
    logger.plant_block({"from_tick": 0, "ticks": time.ticks, "columns": blocks})
    for block in controller.recorder.take():
        logger.controller_block(block)
    return logger.summary("", None, None, 0)


def around(scene: Scene, step: Step, x: float, v: float) -> tuple[dict[str, np.ndarray], Controller]:
    """Runs the controller of a scene around a plant; returns the plant's rows and the controller, rows not yet taken.

    Args:
        step: from the force held over a plant step, N, to position and velocity after it.
        x, v: at the start, m and m/s.
    """
    time = Timebase.from_scene(scene)
    n, controller = time.steps_per_tick, Controller(scene, time, KINDS)
    commands: list[float] = []
    rows: list[tuple[float, float, float, float]] = []
    force, command = 0.0, -1
    for now in range(time.ticks * n):
        if now % n == 0:
            commands += controller.answer([(x,)])
        due = (now - time.delay_steps) // n
        if due > command and due >= 0:
            force, command = commands[due], due
        rows.append((x, v, force, float(command)))
        x, v = step(force)
    rows.append((x, v, force, float(command)))
    columns = dict(zip(("x", "v", "force", "command"), np.array(rows).T, strict=True))
    return columns | {"x_low": np.zeros(len(rows))}, controller


def run_around(scene: Scene, step: Step, x: float, v: float) -> tuple[dict[str, np.ndarray], Summary]:
    """Returns the rows of a plant around which the scene's controller ran, and the summary of the run."""
    columns, controller = around(scene, step, x, v)
    return columns, booked(scene, columns, controller, ("plant",))
