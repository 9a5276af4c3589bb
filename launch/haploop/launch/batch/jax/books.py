"""The energy books of one tick of a batch, by the formulas of the books, on a compiler's placeholders."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import accumulate
from operator import add
from typing import Any

import jax

from haploop.controller.tick import Wall
from haploop.launch.batch.jax.rows import Rows
from haploop.launch.batch.jax.tick import TickOutputs
from haploop.logger.books.one_mass import OneMassParams, Steps, Ticks, increments
from haploop.logger.books.sums import sum_rows
from haploop.logger.books.work import CAUSES, displacement, ideal_springs, sampled_work

# Force of the wall and of every element at one tick.
Forces = dict[str, jax.Array]
# Gives what a function gives, made once for all that needs it.
Apart = Callable[[Callable[[], Any]], Any]


def added_in_tick(
    params: OneMassParams, names: Sequence[str], told: TickOutputs, acting: Sequence[Forces], before: Forces,
    x_m_before: Any, wall: Wall | None, apart: Apart,
) -> dict[str, jax.Array]:  # fmt: skip
    """Returns what a tick adds to each book, J, by the names of ``Books``; shape (members,).

    Args:
        params, names: of the books of the plant.
        told: the tick.
        acting: forces computed with the two newest commands that act in its interval.
        before: those computed at the tick before.
        x_m_before: measured position at the tick before.
        wall: None without one.
        apart: for what several books need; a compiler would make it for each of them anew.
    """
    x, v, tau, now = told.x, told.v, told.tau, told.forces
    n, summed = len(x) - 1, partial(_sum_steps, apart)
    moved = displacement(x, told.x_comp, None, summed)
    counts, applied = zip(*told.held, strict=True)
    in_effect = {account: [forces[account] for forces in acting[2 - len(counts) :]] for account in now}
    force = Rows(_by_step(counts, applied))
    commanded = [Rows(_by_step(counts, forces)) for forces in in_effect.values()] if "actuator" in names else None
    steps = Steps(x[:-1], v[:-1], force, tau[:-1], tau[1:] - tau[:-1], moved.by_step)
    ticks = Ticks(x[::n], v[::n], moved.by_tick)
    flows: dict[str, Any] = dict(zip(names, increments(params, steps, ticks, commanded, summed), strict=True))
    ways = [moved.by_tick]
    if len(counts) > 1:
        ends = list(accumulate(counts))
        ways = [summed(moved.by_step, end - count, end) for count, end in zip(counts, ends, strict=True)]
    for account, forces in in_effect.items():
        flows[f"{account}.true"] = sum_rows(-force * way for force, way in zip(forces, ways, strict=True))
    flows["moved"] = 0.5 * sum_rows(abs(flow) for flow in flows.values())
    if wall:
        place = wall.position, wall.stiffness
        springs = ideal_springs(x[::n], moved.by_tick, Rows([now["wall"]]), place, wall.inward)
        flows |= zip(CAUSES, springs, strict=True)
    x_m: Any = Rows([x_m_before, told.row["x"]])
    for account in now:
        flows[f"{account}.sampled"] = sampled_work(x_m, before[account])
    return {name: flow[0] for name, flow in flows.items()}


def _sum_steps(apart: Apart, flow: Rows, first: int = 0, end: int | None = None) -> Rows:
    """``sum_steps`` of one tick, made once."""
    return Rows([apart(lambda: flow[first:end].over(add))])


def _by_step(counts: Sequence[int], forces: Sequence[Any]) -> list[Any]:
    """Returns the value held in each hold, at each of its steps."""
    return [force for count, force in zip(counts, forces, strict=True) for _ in range(count)]
