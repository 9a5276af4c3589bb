"""The energy books of one tick of many loops, by the formulas of the books, on a compiler's placeholders."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import accumulate
from typing import Any

from haploop.launch.batch.jax.rows import Rows
from haploop.launch.batch.jax.tick import Ticked
from haploop.logger.books.one_mass import PlantBooks
from haploop.logger.books.sums import by_tick, sum_rows
from haploop.logger.books.wall_leak import CAUSES, ideal_and_undelayed
from haploop.logger.books.work import Displacement, sampled_flow

# Force of the wall and of every element at one tick.
Forces = dict[str, Any]
# Gives what a function gives, made once for all that needs it.
Apart = Callable[[Callable[[], Any]], Any]


def added_in_tick(
    plant: PlantBooks, told: Ticked, now: Forces, acting: Sequence[Forces], before: Forces, x_m_before: Any,
    has_wall: bool, apart: Apart,
) -> dict[str, Any]:  # fmt: skip
    """What a tick adds to each book, J, by the names of ``Books``; shape (loops,).

    Args:
        plant: the books of the plant, which know the force of the hand in this tick.
        told: the tick.
        now: forces computed at this tick.
        acting: those with the two newest commands that act in its interval.
        before: those computed at the tick before.
        x_m_before: measured position at the tick before.
        has_wall: whether there is a wall.
        apart: for what several books need; a compiler would make it for each of them anew.
    """
    x, n, summed = told.x, len(told.x) - 1, partial(_by_tick, apart)
    moved: Any = Displacement.of({"x": x, "x_low": told.x_low}, n, summed)  # pyright: ignore[reportArgumentType]
    counts, applied = zip(*told.held, strict=True)
    in_effect = {account: [forces[account] for forces in acting[2 - len(counts) :]] for account in now}
    columns: Any = {"x": x, "v": told.v, "force": Rows([*_by_step(counts, applied), applied[-1]])}
    commanded = [Rows(_by_step(counts, forces)) for forces in in_effect.values()]
    flows: dict[str, Any] = dict(
        zip(plant.names, plant.increments(told.first_step, columns, moved, commanded, summed), strict=True)  # pyright: ignore[reportArgumentType]
    )
    ways = [moved.by_tick]
    if len(counts) > 1:
        ends = list(accumulate(counts))
        ways = [summed(moved.by_step, n, end - count, end) for count, end in zip(counts, ends, strict=True)]
    for account, forces in in_effect.items():
        flows[f"{account}.true"] = sum_rows(-force * way for force, way in zip(forces, ways, strict=True))
    flows["moved"] = 0.5 * sum_rows(abs(flow) for flow in flows.values())
    if has_wall:
        *wall, into_wall = told.wall
        springs = ideal_and_undelayed(x[::n], moved.by_tick, Rows([now["wall"]]), (wall[0], wall[1]), into_wall)
        flows |= zip(CAUSES, springs, strict=True)
    x_m: Any = Rows([x_m_before, told.row["x"]])
    for account in now:
        flows[f"{account}.sampled"] = sampled_flow(x_m, before[account])
    return {name: flow[0] for name, flow in flows.items()}


def _by_tick(apart: Apart, flow: Rows, n: int, first: int = 0, end: int | None = None) -> Rows:
    """``by_tick`` of one tick, made once."""
    return Rows([apart(lambda: by_tick(flow, n, first, end)[0])])


def _by_step(counts: Sequence[int], forces: Sequence[Any]) -> list[Any]:
    """What is held in each hold, at each of its steps."""
    return [force for count, force in zip(counts, forces, strict=True) for _ in range(count)]
