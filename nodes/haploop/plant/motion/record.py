"""The record of one mass at every plant step, filled in between the beginnings of its holds."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterator, Sequence
from itertools import groupby
from typing import Any

import numpy as np

from haploop.plant.motion.forced_response import ForcedResponse
from haploop.protocol.arrays import rows_of

# Entries noted of every hold: steps, x, v, x_comp and v_comp at its beginning, force, command.
NOTED = 7
COLUMNS = ("x", "v", "x_low", "force")
Rows = dict[str, np.ndarray]
Fill = Callable[[np.ndarray, np.ndarray, Sequence[np.ndarray], Rows, int, int], None]


def change_over(held: Any, response: Any, x: Any, v: Any, force: Any, comp: Any) -> Any:
    """Returns what the plant steps of holds add to x or v at the beginning of each hold, for one hold per interval.

    Args:
        held: coefficients of x, v and force over these steps, shape (steps, 1) each.
        response: the forced response at these steps of every interval, shape (steps, intervals).
        x, v: at the beginning of every hold, shape (intervals,).
        force: held, N, shape (intervals,).
        comp: compensation of x or v at the beginning, shape (intervals,).

    Returns:
        Shape (steps, intervals); all shapes may have one more axis, for the members of a batch.
    """
    of_x, of_v, of_force = held
    change = of_x * x
    change += of_v * v
    change += of_force * force
    change += comp
    change += response
    return change


def fill_steps(
    held: np.ndarray,
    response: np.ndarray,
    hold: Sequence[np.ndarray],
    rows: dict[str, np.ndarray],
    first: int,
    count: int,
) -> None:
    """Fills in one hold of many intervals: ``count`` steps from ``first`` on in each.

    Step i of a hold that began at y is y plus the transition of i steps, plus the forced response. An interval begins
    with a known state: the end of the one before.

    Args:
        response: of these intervals, shape (2, n + 1, intervals, ...).
        hold: x, v, x_comp, v_comp and force at the beginning of every hold, shape (intervals, ...).
        rows: what is filled in, x alone or x, v, x_low and force, shape (n, intervals, ...).
    """
    x, v, x_comp, v_comp, force = hold
    known, end = int(not first), first + count
    over, during = held[known:count, :, None], slice(first + known, end)
    dx = change_over(over[:, :3].swapaxes(0, 1), response[0, during], x, v, force, x_comp)
    at_x = np.add(x, dx, out=rows["x"][during])
    if known:
        rows["x"][0] = x
    if len(rows) == 1:
        return
    dv = change_over(over[:, 3:].swapaxes(0, 1), response[1, during], x, v, force, v_comp)
    np.add(v, dv, out=rows["v"][during])
    np.subtract(dx, at_x - x, out=rows["x_low"][during])
    if known:
        rows["v"][0], rows["x_low"][0] = v, x_comp
    rows["force"][first:end] = force


def record_of_holds(
    noted: list[Any],
    held: np.ndarray,
    response: ForcedResponse,
    tick: int,
    tail: tuple[int, ...],
    *,
    positions_only: bool = False,
    fill: Fill | None = None,
) -> dict[str, np.ndarray]:
    """Returns x, v, x_low (x_comp), force and command at every plant step from interval ``tick`` on.

    Args:
        noted: seven entries of every hold, one after the other.
        held: coefficients of ``make_zoh_transitions``; in a batch with a last axis for the members.
        tail: (members,) in a batch, () for one run.
        fill: does what ``fill_steps`` does.

    Returns:
        Shape (steps + 1, *tail) each, except ``command``, of shape (steps + 1,); the last row is left to be filled in.
        In a batch in addition ``held_N``, the force of every hold, shape (holds, members).
    """
    n = len(held) - 1
    width = _width(noted, 0, n)
    cut = noted[:width:NOTED]
    if noted[::NOTED] == cut * (len(noted) // (width or 1)):
        return _alike(noted, cut, held, response.between(tick, len(noted) // (width or 1)), tail, positions_only, fill)
    parts, first = [], tick
    for cut, some in _by_cut(noted, n):
        ticks = len(some) // (NOTED * len(cut))
        parts.append(_alike(some, cut, held, response.between(first, ticks), tail, positions_only, fill))
        first += ticks
    return {name: np.concatenate([*(part[name][:-1] for part in parts), [0.0]]) for name in parts[0]}


def _width(noted: list[Any], at: int, n: int) -> int:
    """Returns the number of entries noted for the interval that begins at entry ``at``."""
    steps, end = 0, at
    while steps < n and end < len(noted):
        steps += noted[end]
        end += NOTED
    return end - at


def _by_cut(noted: list[Any], n: int) -> Iterator[tuple[list[int], list[Any]]]:
    """Yields (steps of each hold, entries) for every series of consecutive intervals that are cut alike."""
    intervals, at = [], 0
    while at < len(noted):
        intervals.append(noted[at : at + _width(noted, at, n)])
        at += len(intervals[-1])
    for cut, alike in groupby(intervals, key=lambda interval: interval[::NOTED]):
        yield cut, [entry for interval in alike for entry in interval]


def _alike(
    noted: list[Any],
    cut: list[int],
    held: np.ndarray,
    response: np.ndarray,
    tail: tuple[int, ...],
    positions_only: bool,
    fill: Fill | None,
) -> dict[str, np.ndarray]:
    """Returns the record of intervals that are cut alike; the i-th holds of all of them are filled in at once."""
    ticks, n = response.shape[2], len(held) - 1
    record = {name: np.empty((ticks * n + 1, *tail)) for name in COLUMNS[: 1 if positions_only else 4]}
    rows = {name: column[:-1].reshape(ticks, n, *tail).swapaxes(0, 1) for name, column in record.items()}
    command, forces, first = np.empty((ticks, n)), [], 0
    for (*hold, of_command), count in zip(_columns(noted, len(cut), tail), cut, strict=True):
        (fill or fill_steps)(held, response, hold, rows, first, count)
        command[:, first : first + count] = of_command[:, None]
        forces.append(hold[-1])
        first += count
    record["command"] = np.append(command.ravel(), -1.0)
    return record | ({"held_N": np.concatenate(forces)} if tail else {})


def _columns(noted: list[Any], holds: int, tail: tuple[int, ...]) -> Iterator[tuple[np.ndarray, ...]]:
    """Yields x, v, x_comp, v_comp, force and command of the i-th holds of all intervals, shape (intervals, *tail).

    The command alone has shape (intervals,).
    """
    if not tail:
        table = np.frombuffer(array("d", noted)).reshape(-1, holds or 1, NOTED)
        yield from np.ascontiguousarray(table.transpose(1, 2, 0))[:holds, 1:]
        return
    for index in range(holds):
        entries = [noted[NOTED * index + entry :: NOTED * holds] for entry in range(1, NOTED)]
        yield *(rows_of(entry, *tail) for entry in entries[:-1]), np.array(entries[-1], float)
