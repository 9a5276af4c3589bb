"""What an accelerometer on a body of the chain feels: under which forces, band-limited, and how late."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from haploop.plant.chain.chain import Chain, sensor_body
from haploop.plant.chain.tables import tables_of
from haploop.plant.sensing.encoder import accelerometer_is_used
from haploop.protocol.ticks import Timebase

if TYPE_CHECKING:
    from haploop.plant.chain.history import Interval

Feel = Callable[["Interval", int], None]


def felt_acceleration(
    scene: dict[str, Any], chain: Chain, time: Timebase, loads: Callable[[int, int], np.ndarray]
) -> tuple[Feel, Callable[[], float]]:
    """(takes an interval and the plant step at the end of its first one, tells what is felt now in m/s^2).

    At a step the sensor feels the acceleration under the forces held over the step that ends there; 0 at the start,
    and while friction holds its body. A bandwidth makes it a state of the flow; a delay reads an older step.
    """
    if not accelerometer_is_used(scene):
        return lambda _interval, _step: None, lambda: 0.0
    table = scene.get("accelerometer", {})
    late = round(table.get("delay", 0.0) * time.plant_rate)
    felt = deque([0.0] * (late + 1), maxlen=late + 1)

    if chain.sensor:
        state = chain.states.index("accelerometer")

        def feel_filtered(interval: Interval, _step: int) -> None:
            felt.extend(rows(interval.states[1:, state]))

        return feel_filtered, lambda: felt[0]

    body = sensor_body(table, "transmission" in scene)

    def factors_of(chain: Chain) -> tuple[np.ndarray, ...]:
        return tuple(chain.accelerations(stuck)[body].astype(float) for stuck in (False, True))

    free, stuck = (factors[:, None] for factors in tables_of(factors_of, chain, of_many="loops" in scene))

    def feel(interval: Interval, step: int) -> None:
        friction, is_stuck = interval.at_ends.swapaxes(0, 1)
        command = interval.held[:, 0]
        acting = [*interval.states[1:].swapaxes(0, 1), command, friction, loads(step, step + len(command))]
        factors = np.where(is_stuck > 0.0, stuck, free)
        total = factors[0] * acting[0]
        for factor, of in zip(factors[1:], acting[1:], strict=True):
            total = total + factor * of
        felt.extend(rows(total))

    return feel, lambda: felt[0]


def rows(column: np.ndarray) -> list[Any]:
    """Numbers of one loop, or arrays over many."""
    return column.tolist() if column.ndim == 1 else list(column)
