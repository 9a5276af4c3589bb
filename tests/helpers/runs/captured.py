"""Runs kept whole: every state, force and controller row of a scene, beside its summary."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from haploop.launch.runs.in_process import Loop
from haploop.launch.scene.events import scene_events
from haploop.logger.logger import Block, Logger
from haploop.logger.session import LogSession
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
from helpers.scenes.least import KINDS


@dataclass
class Captured:
    """A run kept whole.

    Attributes:
        plant: x, v, force, command and columns of effects at every step and at the end, shape (steps + 1,).
        controller: x, v, a, wall, total, in_contact at every tick, shape (ticks,).
        forces: force of every element's book at every tick, 0 where it was not at work, shape (ticks,).
        summary: the run's summary.
    """

    plant: dict[str, np.ndarray]
    controller: dict[str, np.ndarray]
    forces: dict[int, np.ndarray]
    summary: dict[str, Any]

    @property
    def energy(self) -> dict[str, Any]:
        return self.summary["energy"]

    @property
    def relative_residual(self) -> float:
        return self.energy["residual_J"] / self.energy["moved_J"]


class CapturingLogger(Logger):
    """A logger that also remembers the blocks it was given."""

    def __init__(self, scene: Scene, time: Timebase) -> None:
        super().__init__(scene, time, None)
        self.plant_blocks: list[Block] = []
        self.controller_blocks: list[Block] = []

    def plant_block(self, block: Block) -> None:
        self.plant_blocks.append(block)
        super().plant_block(block)

    def controller_block(self, block: Block) -> None:
        self.controller_blocks.append(block)
        super().controller_block(block)


def run(scene: Scene) -> Captured:
    """Runs a resolved scene in this process and keeps everything."""
    time = Timebase.from_scene(scene)
    logger = CapturingLogger(scene, time)
    loop = Loop(scene, time, KINDS, LogSession(logger, None, None))
    loop.schedule(sorted(scene_events(scene, time), key=lambda event: event[0]))
    while loop.block():
        pass
    summary = loop.finish()
    controller, forces = _joined_rows(logger.controller_blocks)
    return Captured(_joined_states(logger.plant_blocks), controller, forces, summary)


def summarise(scene: Scene) -> dict[str, Any]:
    """The summary of a run of a resolved scene."""
    return run(scene).summary


def _joined_states(blocks: list[Block]) -> dict[str, np.ndarray]:
    """Joins consecutive blocks, which share one state; the later has the force from then on. Pieces share none."""
    columns: dict[str, np.ndarray] = {}
    for name in blocks[0]["columns"]:
        rows = [np.frombuffer(block["columns"][name]) for block in blocks]
        if not name.startswith("pieces."):
            rows = [*(row[:-1] for row in rows), rows[-1][-1:]]
        columns[name] = np.concatenate(rows)
    return columns


def _joined_rows(blocks: list[Block]) -> tuple[dict[str, np.ndarray], dict[int, np.ndarray]]:
    ticks = sum(block["ticks"] for block in blocks)
    names = ("x", "v", "a", "wall", "total", "in_contact")
    rows = {name: np.concatenate([np.frombuffer(b["columns"][name]) for b in blocks]) for name in names}
    forces: dict[int, np.ndarray] = {}
    for block in blocks:
        covered = slice(block["from_tick"], block["from_tick"] + block["ticks"])
        for index, element in enumerate(block["elements"]):
            force = forces.setdefault(element["book"], np.zeros(ticks))
            force[covered] = np.frombuffer(block["columns"][f"dissipation.{index}"])
    return rows, forces


OF_THE_MACHINE = ("wall_s", "real_time_factor", "versions")


def of_the_scene(summary: dict[str, Any]) -> dict[str, Any]:
    """The summary without the keys that differ between two runs of the same scene."""
    return {name: value for name, value in summary.items() if name not in OF_THE_MACHINE}


def in_blocks(scene: Scene, block_ticks: int, window_blocks: int = 1) -> dict[str, Any]:
    cut = replace(scene.run, block_ticks=block_ticks, window_blocks=window_blocks)
    return of_the_scene(summarise(replace(scene, run=cut)))


def bodies(ran: Captured) -> dict[str, np.ndarray]:
    """Positions of all bodies at the steps, from the first to the last, by name."""
    plant = ran.plant
    x = {"body 0": plant["x"]}
    for link in ("cable", "grip"):
        if f"{link}.stretch" in plant:
            x[link] = list(x.values())[-1] + plant[f"{link}.stretch"]
    return x
