"""The energy books of one tick of many loops, by the formulas of the books, on a compiler's placeholders."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import accumulate
from operator import add
from typing import Any

from haploop.launch.batch.jax.rows import Rows
from haploop.launch.batch.jax.tick import Ticked
from haploop.logger.books.one_mass import OneMassBooks, Steps, Ticks, increments
from haploop.logger.books.sums import sum_rows
from haploop.logger.books.work import CAUSES, displacement, ideal_springs, sampled_work

# Force of the wall and of every element at one tick.
Forces = dict[str, Any]
# Gives what a function gives, made once for all that needs it.
Apart = Callable[[Callable[[], Any]], Any]


def added_in_tick(
    plant: OneMassBooks, told: Ticked, now: Forces, acting: Sequence[Forces], before: Forces, x_m_before: Any,
    has_wall: bool, apart: Apart,
) -> dict[str, Any]:  # fmt: skip
    """What a tick adds to each book, J, by the names of ``Books``; shape (loops,).

    Args:
        plant: the books of the plant.
        told: the tick.
        now: forces computed at this tick.
        acting: those with the two newest commands that act in its interval.
        before: those computed at the tick before.
        x_m_before: measured position at the tick before.
        has_wall: whether there is a wall.
        apart: for what several books need; a compiler would make it for each of them anew.
    """
    x, v, n, summed = told.x, told.v, len(told.x) - 1, partial(_sum_steps, apart)
    moved = displacement(x, told.x_low, None, summed)
    counts, applied = zip(*told.held, strict=True)
    in_effect = {account: [forces[account] for forces in acting[2 - len(counts) :]] for account in now}
    tau, force = told.tau, Rows(_by_step(counts, applied))
    commanded = [Rows(_by_step(counts, forces)) for forces in in_effect.values()] if plant.is_limited else None
    steps = Steps(x[:-1], v[:-1], force, tau[:-1], tau[1:] - tau[:-1], moved.by_step)
    ticks = Ticks(x[::n], v[::n], moved.by_tick)
    flows: dict[str, Any] = dict(
        zip(plant.names, increments(plant.params, steps, ticks, commanded, summed), strict=True)
    )
    ways = [moved.by_tick]
    if len(counts) > 1:
        ends = list(accumulate(counts))
        ways = [summed(moved.by_step, end - count, end) for count, end in zip(counts, ends, strict=True)]
    for account, forces in in_effect.items():
        flows[f"{account}.true"] = sum_rows(-force * way for force, way in zip(forces, ways, strict=True))
    flows["moved"] = 0.5 * sum_rows(abs(flow) for flow in flows.values())
    if has_wall:
        *wall, into_wall = told.wall
        springs = ideal_springs(x[::n], moved.by_tick, Rows([now["wall"]]), (wall[0], wall[1]), into_wall)
        flows |= zip(CAUSES, springs, strict=True)
    x_m: Any = Rows([x_m_before, told.row["x"]])
    for account in now:
        flows[f"{account}.sampled"] = sampled_work(x_m, before[account])
    return {name: flow[0] for name, flow in flows.items()}


def _sum_steps(apart: Apart, flow: Rows, first: int = 0, end: int | None = None) -> Rows:
    """``sum_steps`` of one tick, made once."""
    return Rows([apart(lambda: flow[first:end].over(add))])


def _by_step(counts: Sequence[int], forces: Sequence[Any]) -> list[Any]:
    """What is held in each hold, at each of its steps."""
    return [force for count, force in zip(counts, forces, strict=True) for _ in range(count)]
