"""The acceleration sensed by an accelerometer on a body of the chain: its forces, bandwidth and delay."""

from __future__ import annotations

from typing import Any

import numpy as np

from haploop.plant.chain.chain import Chain, sensor_body
from haploop.plant.chain.transition import Loads, make_tables
from haploop.protocol.scene.scene import Scene, accelerometer_is_used
from haploop.protocol.ticks import Timebase
from haploop.protocol.trees import tree_select


class SensedAcceleration:
    """Accelerations at plant steps, kept until a delayed sensor has reported them.

    At a step the sensor senses the acceleration under the forces held over the step that ends there; 0 at the start,
    and while friction holds its body. With a bandwidth it is a state of the chain; with a delay an older step is read.

    Attributes:
        none: what is kept before the first step; empty where no sample carries an acceleration.
    """

    def __init__(self, scene: Scene, chain: Chain, time: Timebase, loads: Loads, members: int | None) -> None:
        is_used, delay_s = accelerometer_is_used(scene), scene.accelerometer.delay if scene.accelerometer else 0.0
        self.none = (0.0,) * (round(delay_s * time.plant_rate) + 1) if is_used else ()
        self._loads, self._state = loads, chain.states.index("accelerometer") if chain.sensor else None
        if is_used and not chain.sensor:
            body = sensor_body(scene)

            def factors_of(chain: Chain) -> tuple[np.ndarray, ...]:
                return tuple(chain.accelerations(stuck)[body].astype(float) for stuck in (False, True))

            factors = make_tables(factors_of, chain, has_members=members is not None)
            self._factors = tuple(factor[:, None] for factor in factors)

    def after(
        self, sensed: tuple[Any, ...], states: np.ndarray, command: np.ndarray, at_ends: np.ndarray, step: int
    ) -> tuple[Any, ...]:
        """Returns the accelerations at the last plant steps, m/s^2, the oldest first.

        Args:
            states: of the chain at every step of the interval and at its end, shape (n + 1, states).
            command: force held over every step, N, shape (n,).
            at_ends: friction in N and whether body 0 is stuck at the end of every step, shape (n, 2).
            step: the number of the plant step at the end of the first one.
        """
        if not sensed:
            return sensed
        rows = states[1:, self._state] if self._state else self._accelerations(states[1:], command, at_ends, step)
        return (*sensed, *(rows.tolist() if rows.ndim == 1 else rows))[-len(sensed) :]

    def _accelerations(self, states: np.ndarray, command: np.ndarray, at_ends: np.ndarray, step: int) -> np.ndarray:
        friction, is_stuck = at_ends.swapaxes(0, 1)
        acting = [*states.swapaxes(0, 1), command, friction, self._loads(step, step + len(command))]
        free, stuck = self._factors
        factors = np.where(is_stuck > 0.0, stuck, free)
        total = factors[0] * acting[0]
        for factor, of in zip(factors[1:], acting[1:], strict=True):
            total = total + factor * of
        return total

    def select(self, kept: np.ndarray) -> None:
        if self.none and not self._state:
            self._factors = tree_select(self._factors, kept)
