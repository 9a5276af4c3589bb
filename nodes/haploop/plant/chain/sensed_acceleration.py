"""The acceleration that an accelerometer on a body of the chain senses: under which forces, band-limited, how late."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from haploop.plant.chain.chain import Chain, sensor_body
from haploop.plant.chain.transition import make_tables
from haploop.plant.sensing.encoder import accelerometer_is_used
from haploop.protocol.ticks import Timebase
from haploop.protocol.trees import tree_select


class NoAcceleration:
    """Stands where no sample carries an acceleration.

    Attributes:
        none: sensed accelerations before the first.
    """

    none: tuple[Any, ...] = ()

    def after(
        self, sensed: tuple[Any, ...], states: np.ndarray, command: np.ndarray, at_ends: np.ndarray, step: int
    ) -> tuple[Any, ...]:
        """Returns the accelerations at the last plant steps, m/s^2, the oldest first.

        Args:
            sensed: those before an interval.
            states: of the chain at every step of the interval and at its end, shape (n + 1, states).
            command: force held over every step, N, shape (n,).
            at_ends: friction in N and whether body 0 is stuck at the end of every step, shape (n, 2).
            step: the number of the plant step at the end of the first one.
        """
        return sensed

    def select(self, kept: np.ndarray) -> None:
        """There is nothing to drop members from."""


class SensedAcceleration(NoAcceleration):
    """The acceleration of a body at plant steps under the forces held over the step that ends there; 0 at the start,
    and while friction holds the body.

    Args:
        late: plant steps by which a reading is late.
        factors: of (states, command, friction, load), free and with body 0 stuck, shape (states + 3, 1, ...) each.
        loads: load in N at the steps first ... last - 1.
    """

    def __init__(self, late: int, factors: tuple[np.ndarray, ...], loads: Callable[[int, int], np.ndarray]) -> None:
        self._factors, self._loads = factors, loads
        self.none = (0.0,) * (late + 1)

    def after(
        self, sensed: tuple[Any, ...], states: np.ndarray, command: np.ndarray, at_ends: np.ndarray, step: int
    ) -> tuple[Any, ...]:
        friction, is_stuck = at_ends.swapaxes(0, 1)
        load = self._loads(step, step + len(command))
        acting = [*states[1:].swapaxes(0, 1), command, friction, load]
        free, stuck = self._factors
        factors = np.where(is_stuck > 0.0, stuck, free)
        total = factors[0] * acting[0]
        for factor, of in zip(factors[1:], acting[1:], strict=True):
            total = total + factor * of
        return (*sensed, *_rows(total))[-len(self.none) :]

    def select(self, kept: np.ndarray) -> None:
        self._factors = tree_select(self._factors, kept)


class FilteredAcceleration(NoAcceleration):
    """A band-limited sensor's output, which is a state of the chain.

    Args:
        late: plant steps by which a reading is late.
        state: its place among the states.
    """

    def __init__(self, late: int, state: int) -> None:
        self._state, self.none = state, (0.0,) * (late + 1)

    def after(
        self, sensed: tuple[Any, ...], states: np.ndarray, command: np.ndarray, at_ends: np.ndarray, step: int
    ) -> tuple[Any, ...]:
        return (*sensed, *_rows(states[1:, self._state]))[-len(self.none) :]


def make_sensed_acceleration(
    scene: dict[str, Any],
    chain: Chain,
    time: Timebase,
    loads: Callable[[int, int], np.ndarray],
    members: int | None = None,
) -> NoAcceleration:
    """Makes what a sensor with the scene's bandwidth and delay senses of the chain.

    Args:
        scene: a resolved scene, or the stacked scene of a batch.
        chain: of the scene.
        time: the integers of the run.
        loads: load in N at the steps first ... last - 1.
        members: of the batch; None for one run.
    """
    if not accelerometer_is_used(scene):
        return NoAcceleration()
    table = scene.get("accelerometer", {})
    late = round(table.get("delay", 0.0) * time.plant_rate)
    if chain.sensor:
        return FilteredAcceleration(late, chain.states.index("accelerometer"))
    body = sensor_body(table, "transmission" in scene)

    def factors_of(chain: Chain) -> tuple[np.ndarray, ...]:
        return tuple(chain.accelerations(stuck)[body].astype(float) for stuck in (False, True))

    factors = tuple(table[:, None] for table in make_tables(factors_of, chain, has_members=members is not None))
    return SensedAcceleration(late, factors, loads)


def _rows(column: np.ndarray) -> list[Any]:
    return column.tolist() if column.ndim == 1 else list(column)
