"""Measures of the windows of a batch, computed by a program that goes through their rings step by step."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from haploop.launch.batch.jax.block import Rings
from haploop.logger.verdict.measures import (
    ROUNDING,
    MeasuredColumns,
    RunMeasures,
    main_lines,
    window_measures,
    window_span,
)
from haploop.logger.verdict.ripple import peak_to_peak, ripple
from haploop.logger.verdict.window import TOGETHER, Window, keep_steps, last_rows

# Steps that a program goes through in one piece, so that what it carries from step to step stays in registers.
_UNROLLED = 5


class CompiledWindow(Window):
    """``Window`` of a batch whose rings are filled by compiled programs, and read by one."""

    rings: Rings | None = None

    def take(self, rings: Rings, *, writable: bool) -> None:
        """Takes the rings of a program; ``writable`` if the batch is to continue uncompiled."""
        held = np.array if writable else np.asarray
        x, rows = held(rings.x).reshape(-1, len(self.swing_m)), {name: held(ring) for name, ring in rings.rows.items()}
        self.state = self.state._replace(x=x, rows=self.state.rows | rows)
        self.rings = None if writable else rings

    def measures(self, places: Iterable[int] = (0,)) -> Iterator[RunMeasures]:
        """Yields the measures of these members, exact but for the last digits; a crossing by less may count or not."""
        rate, n, steps = self._time.plant_rate, self._time.steps_per_tick, self.state.steps
        span = window_span(steps, keep_steps(rate), n)
        if self.rings is None or steps < span.steps + n:
            yield from super().measures(places)
            return
        wanted = np.fromiter(places, np.intp)
        if not len(wanted):
            return
        rows = {**self.rings.rows, "wall_position": self.state.rows["wall_position"]}
        found = _look(self.rings.x, rows, np.int64(steps), self.swing_m, steps=span.steps + 1, ticks=span.ticks)
        crossings, growth, width, inside, *means = (np.asarray(column)[wanted].tolist() for column in found)
        stiffness, depth = _where_any(*means[:2]), _where_any(*means[2:])
        # Done once a run: transforms by NumPy cost less than a program for them.
        at_ticks = last_rows(np.asarray(self.rings.x)[:, -1], steps // n, wanted)[:, -(span.steps // n) :]
        lines = main_lines(at_ticks, self._time.control_rate, crossings)
        command = last_rows(np.asarray(self.rings.rows["total"]), steps // n, wanted)[:, -span.ticks :]
        parts = [command[first : first + TOGETHER] for first in range(0, len(command), TOGETHER)]
        ripples = np.concatenate([ripple(part, self._time.control_rate) for part in parts])
        forces = ripples.tolist(), peak_to_peak(command).tolist()
        measured = MeasuredColumns(crossings, growth, lines, width, inside, stiffness, depth, *forces)
        windows = window_measures(measured, span, rate, self._time.control_rate)
        yield from map(RunMeasures, windows, self.extremes(wanted), self.swing_m[wanted].tolist())


def _where_any(counts: list[int], means: list[float]) -> list[float | None]:
    return [mean if count else None for count, mean in zip(counts, means, strict=True)]


class _Swings(NamedTuple):
    """Side of its trend line on which each member was last, how often it crossed it, and how far it went."""

    side: Any
    crossings: Any
    low: Any
    high: Any


@partial(jax.jit, static_argnames=("steps", "ticks"))
def _look(x: Any, rows: dict[str, jax.Array], ran: Any, swing_m: Any, *, steps: int, ticks: int) -> list[Any]:
    """Returns the columns of ``MeasuredColumns`` but the line and the last two, with counts before means.

    See ``measure_window``.

    Args:
        x: positions, shape (ticks kept, n, members); rows: ``CONTROLLER_COLUMNS``, shape (ticks kept, members).
        ran: number of steps that the members have run.
        swing_m: what does not count as a swing, shape (members,).
        steps, ticks: length of the window.
    """
    n, members = x.shape[1], len(swing_m)
    x = x.reshape(-1, members)

    def at(i: Any) -> Any:
        return x[(ran - steps + i) % len(x)]

    def sums(i: Any, so_far: tuple[Any, ...]) -> tuple[Any, ...]:
        total, weighted, low, high = so_far
        away = at(i) - pivot
        middle = i - (steps - 1) / 2.0
        return total + away, weighted + middle * away, jnp.minimum(low, away), jnp.maximum(high, away)

    pivot, none, far = at(0), jnp.zeros(members), jnp.full(members, jnp.inf)
    total, weighted, low, high = jax.lax.fori_loop(0, steps, sums, (none, none, far, -far), unroll=_UNROLLED)
    slope, mean = weighted / (steps * (steps**2 - 1) / 12.0), total / steps

    def swing(i: Any, so_far: _Swings) -> _Swings:
        offset = at(i) - pivot - mean - slope * (i - (steps - 1) / 2.0)
        side = jnp.where(offset > swing_m, 1.0, jnp.where(offset < -swing_m, -1.0, so_far.side))
        crossings = so_far.crossings + (side * so_far.side < 0.0)
        return _Swings(side, crossings, jnp.minimum(so_far.low, offset), jnp.maximum(so_far.high, offset))

    begun = _Swings(none, jnp.zeros(members, np.int64), far, -far)
    first = jax.lax.fori_loop(0, steps // 2, swing, begun, unroll=_UNROLLED)
    second = jax.lax.fori_loop(steps // 2, steps, swing, first._replace(low=far, high=-far), unroll=_UNROLLED)
    before = first.high - first.low
    growth = jnp.where(before > 0.0, (second.high - second.low) / before, 0.0)
    return [second.crossings, growth, high - low, *_in_contact(rows, ran // n, ticks)]


def _in_contact(rows: dict[str, jax.Array], ran: Any, ticks: int) -> list[Any]:
    """Returns, for the last ticks: how many are in contact; how many show a stiffness, its mean; and the mean depth."""
    length, members = rows["x"].shape

    def add(i: Any, so_far: list[Any]) -> list[Any]:
        place = (ran - ticks + i) % length
        position, inside = rows["wall_position"][place], rows["in_contact"][place] > 0.0
        depth = position - rows["x"][place]
        real = inside & (abs(depth) > ROUNDING * abs(position))
        stiffness = jnp.where(real, rows["total"][place] / jnp.where(real, depth, 1.0), 0.0)
        added = [1.0 * inside, 1.0 * real, stiffness, jnp.where(inside, abs(depth), 0.0)]
        return [total + more for total, more in zip(so_far, added, strict=True)]

    inside, real, stiffness, depth = jax.lax.fori_loop(0, ticks, add, [jnp.zeros(members)] * 4)
    return [inside, real, stiffness / real, inside, depth / inside]
