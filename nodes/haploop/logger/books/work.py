"""What ticks and plant steps hand to the books: how far the device went, and under which forces."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from haploop.protocol.arrays import first_row

if TYPE_CHECKING:
    from haploop.logger.books.buffers import ControllerTape
    from haploop.logger.books.buffers_batch import ControllerTapeArray


class Displacement(NamedTuple):
    """How far the device goes, with the digits that the difference of two positions has lost, m.

    Attributes:
        by_step: over every plant step, shape (ticks * n,).
        by_tick: over every interval, shape (ticks,).
    """

    by_step: Any
    by_tick: Any

    @classmethod
    def of(cls, plant: dict[str, np.ndarray], steps_per_tick: int, summed: Callable[[Any, int], Any]) -> Displacement:
        """From telemetry columns; ``summed`` sums steps over their tick."""
        x, low = plant["x"], plant["x_low"]
        dx = (x[1:] - x[:-1]) + (low[1:] - low[:-1])
        return cls(dx, summed(dx, steps_per_tick))


def sampled_flow(x_m: np.ndarray, force: np.ndarray) -> np.ndarray:
    """-f[k-1] (x_m[k] - x_m[k-1]), J (Choi et al. 2022, eq. 4).

    Args:
        x_m: positions as measured at consecutive ticks, m, shape (ticks + 1,).
        force: commanded at all of them but the last, N, shape (ticks,) or (forces, ticks).
    """
    return force * -(x_m[1:] - x_m[:-1])


def sampled_flows(
    tick: int, ticks: int, tape: ControllerTape | ControllerTapeArray, forces: list[np.ndarray]
) -> np.ndarray:
    """``sampled_flow`` of every account at every tick; nothing at the first tick there is.

    Returns:
        Shape (accounts, ticks).
    """
    first, end = max(tick - 1, tape.first), tick + ticks
    x_m = tape.rows("x", first, end)
    known = slice(first - tape.first, end - 1 - tape.first)
    added = np.zeros((len(forces), ticks, *x_m.shape[1:]))
    for row, force in zip(added, forces, strict=True):
        row[ticks + 1 - len(x_m) :] = sampled_flow(x_m, force[known])
    return added


def wall_at(tick: int, tape: ControllerTape | ControllerTapeArray) -> tuple[Any, Any]:
    """Where the wall is at a tick, m, and how stiff, N/m."""
    position, stiffness = (first_row(tape.rows(f"wall_{of}", tick, tick + 1)) for of in ("position", "stiffness"))
    return position, stiffness


def in_effect(force: np.ndarray, command: np.ndarray, first: int) -> np.ndarray:
    """What an account commanded where each of these commands is in effect, N; 0 before the first command.

    Args:
        force: of the commands from ``first`` on.
    """
    found = force.take(np.maximum(command - first, 0), axis=0)
    found[command < 0] = 0.0
    return found
