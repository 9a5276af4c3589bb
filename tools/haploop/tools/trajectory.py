"""A run in one process that keeps the motion at ticks besides the summary."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from haploop.controller.dissipation import registry
from haploop.launch.runs.in_process import Loop
from haploop.launch.scene.events import scene_events
from haploop.logger.logger import Logger
from haploop.logger.session import LogSession
from haploop.logger.summary import Summary
from haploop.protocol.scene.scene import Scene, by_window
from haploop.protocol.ticks import Timebase
from haploop.protocol.transport.telemetry import Block


@dataclass(frozen=True)
class Trajectory:
    """The motion of body 0 at every tick and at the end, shape (ticks + 1,); fewer where the run diverged."""

    x_m: np.ndarray
    v_m_s: np.ndarray
    summary: Summary


class _Remembering(Logger):
    """A logger that keeps what the plant reports at ticks."""

    def __init__(self, scene: Scene, time: Timebase) -> None:
        super().__init__(scene, time, None)
        self.motion: list[np.ndarray] = []

    def plant_block(self, block: Block) -> None:
        columns = (np.frombuffer(block["columns"][name], "<f8") for name in ("x", "v"))
        at_ticks = np.stack([column[:: self.time.steps_per_tick] for column in columns])
        self.motion.append(at_ticks[:, 1 if self.motion else 0 :])
        super().plant_block(block)


def trajectory(scene: Scene) -> Trajectory:
    """Runs a resolved scene of installed elements to its end; nothing is written, and the verdict is the cheap one.

    Raises:
        ElementError: an element raised, or returned something that is not a number.
        ArithmeticError: friction switched too often for the plant rate.
    """
    scene, time = by_window(scene), Timebase.from_scene(scene)
    logger = _Remembering(scene, time)
    loop = Loop(scene, time, registry(), LogSession(logger, None, None))
    loop.schedule(scene_events(scene, time))
    while loop.block():
        pass
    summary = loop.finish()
    x, v = np.concatenate(logger.motion, axis=1)
    return Trajectory(x, v, summary)
