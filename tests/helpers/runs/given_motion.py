"""The controller and the books along a given motion, since no plant is needed to find what a spring leaks."""

from __future__ import annotations

from typing import Any

import numpy as np

from haploop.controller.controller import Controller
from haploop.logger.logger import Logger
from haploop.logger.summary import energy
from haploop.plant.sensing.encoder import make_encoder
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
from helpers.scenes.least import KINDS


def books_along(scene: Scene, x: np.ndarray) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Lets the controller of a scene see a motion and its delayed commands act on it, and writes the books.

    Args:
        scene: a resolved scene; its duration is that of the motion.
        x: position at every plant step and at the end, m.

    Returns:
        The running books at every tick by name, J, and the summary's ``energy``. The plant's own books have no meaning
        here, since no plant moved this way.
    """
    time = Timebase.from_scene(scene)
    n, steps = time.steps_per_tick, time.ticks * time.steps_per_tick
    assert len(x) == steps + 1
    measure = make_encoder(scene.encoder)
    controller = Controller(scene, time, KINDS)
    commands = controller.answer([(measure(float(at)),) for at in x[:-1:n]])
    in_effect = np.maximum((np.arange(steps + 1) - time.delay_steps) // n, -1)
    in_effect[-1] = in_effect[-2]
    force = np.array([0.0, *commands])[in_effect + 1]
    columns = {
        "x": x,
        "v": np.zeros_like(x),
        "x_low": np.zeros_like(x),
        "force": force,
        "command": in_effect.astype(float),
    }
    logger = Logger(scene, time, None)
    latest: dict[str, np.ndarray] = {}
    logger.booked = lambda first, books: latest.update(books)
    logger.start({"tick": 0, "x": x[0], "v": 0.0, "force": 0.0}, [])
    blocks = {name: np.ascontiguousarray(column).tobytes() for name, column in columns.items()}
    logger.plant_block({"from_tick": 0, "ticks": time.ticks, "columns": blocks})
    for block in controller.recorder.take():
        logger.controller_block(block)
    return latest, energy(logger.books.state, [], scene.wall is not None)
