"""The one-tick map of a loop whose plant is a row of bodies, with or without the actuator's bandwidth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from haploop.protocol.scene.scene import Scene
from oracles.effects_reference import Bodies
from oracles.one_tick_map import OneTickMap


@dataclass(frozen=True)
class ChainLoop(OneTickMap):
    """The plant of a resolved scene without friction: A and b are its rates at every unit state."""

    scene: Scene

    @classmethod
    def of(cls, scene: Scene) -> ChainLoop:
        clock, rate = scene.clock, scene.clock.plant_rate
        return cls(
            scene,
            delay_steps=round(clock.round_trip_delay * rate),
            virtual_damping=sum(table.parameters["damping"] for table in scene.dissipation),
            steps_per_tick=rate // clock.control_rate,
            step_s=1.0 / rate,
        )

    def rates(self) -> tuple[np.ndarray, np.ndarray]:
        bodies = Bodies(self.scene)
        bodies.rest = 0.0
        size = 2 * bodies.count + bool(bodies.actuator_rate)

        def rate(unit: np.ndarray, command: float) -> np.ndarray:
            return bodies.rates(0.0, unit, command, 0.0, 0.0)[:size]

        units = np.eye(len(bodies.z))[:size]
        return np.column_stack([rate(unit, 0.0) for unit in units]), rate(np.zeros(len(bodies.z)), 1.0)

    def modes_Hz(self) -> np.ndarray:
        """Natural frequencies of the plant alone, rising."""
        modes = np.linalg.eigvals(self.rates()[0]).imag / (2.0 * np.pi)
        return np.sort(modes[modes > 1e-9])
