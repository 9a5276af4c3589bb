"""Measures of the last half second of some runs, worked out for all of them at once."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

WINDOW_S = 0.5
CROSSINGS = 4
# A quantised position on the wall's face may lie inside by this much, relative to the face's position.
ROUNDING = 1e-12


class WindowMeasures(NamedTuple):
    """Measures of the window of one run.

    Attributes:
        touched: whether any tick was in contact.
        crossings, growth: of ``swings``.
        figures: the ``window`` entry of the summary. The displayed stiffness is the mean of total force over
            penetration, ticks in contact (Choi et al. 2022, V.B.2); ticks whose penetration is a rounding error of the
            wall's position are left out of it. ``growth_1_s`` is the r of e^(r t) by which the swings grow (decay
            where negative); None where nothing swings.
    """

    touched: bool
    crossings: int
    growth: float
    figures: dict[str, Any]


class MeasuredColumns(NamedTuple):
    """Measures of the windows of some runs, a list each.

    Attributes:
        crossings, growth: of ``swings``.
        width_m: peak to peak.
        inside: ticks in contact.
        stiffness_N_m, depth_m: displayed stiffness and penetration, means of ticks in contact; None of none.
    """

    crossings: list[int]
    growth: list[float]
    width_m: list[float]
    inside: list[int]
    stiffness_N_m: list[float | None]
    depth_m: list[float | None]


class Span(NamedTuple):
    """The part of a run that a window covers: its plant steps, its ticks, and its first step."""

    steps: int
    ticks: int
    first: int


def window_span(ran: int, keep: int, steps_per_tick: int) -> Span:
    """Returns the last ``keep`` steps of a run of ``ran`` steps, or its second half if it is shorter."""
    steps = min(keep, ran if ran >= keep else ran // 2)
    first = ran - steps
    ticks = ran // steps_per_tick + bool(ran % steps_per_tick)
    return Span(steps, ticks - -(-first // steps_per_tick), first)


def _rate(growth: float, seconds: float) -> float | None:
    """Returns r in 1/s if what is ``growth`` times as wide in the second half of ``seconds`` follows e^(r t)."""
    return 2.0 * math.log(growth) / seconds if growth > 0.0 else None


@lru_cache(maxsize=4)
def _centred(count: int) -> tuple[np.ndarray, float]:
    """Returns so many equal steps around 0, and the sum of their squares."""
    t = np.arange(count) - (count - 1) / 2.0
    return t, np.dot(t, t)


def measure_window(
    x: np.ndarray, rows: dict[str, np.ndarray], span: Span, rate: int, swing_m: np.ndarray
) -> list[WindowMeasures]:
    """Returns the measures of the windows of some runs; each is worked out as if it were alone.

    Args:
        x: positions at the last plant steps at least, shape (runs, steps), m.
        rows: ``CONTROLLER_COLUMNS`` at the last ticks at least, shape (runs, ticks).
        span: of the windows.
        rate: plant steps a second.
        swing_m: what does not count as a swing, shape (runs,).
    """
    x = x[:, -span.steps - 1 :]
    held = {name: column[:, column.shape[1] - span.ticks :] for name, column in rows.items()}
    inside = held["in_contact"] > 0
    depth = held["wall_position"] - held["x"]
    real = inside & (np.abs(depth) > ROUNDING * np.abs(held["wall_position"]))
    stiffness = np.divide(held["total"], depth, out=np.zeros_like(depth), where=real)
    measured = MeasuredColumns(
        *swings(x, swing_m),
        np.ptp(x, axis=1).tolist() if x.shape[1] else [0.0] * len(x),
        np.count_nonzero(inside, axis=1).tolist(),
        _means(stiffness, real),
        _means(np.abs(depth), inside),
    )
    return window_measures(measured, span, rate)


def window_measures(measured: MeasuredColumns, span: Span, rate: int) -> list[WindowMeasures]:
    """Returns the measures of each run's window, with the figures of the summary."""
    start_s, seconds = span.first / rate, (span.steps + 1) / rate
    measures = []
    for crossings, growth, width_m, inside, stiffness_N_m, depth_m in zip(*measured, strict=True):
        figures = {
            "from_s": start_s,
            "oscillation_m": width_m,
            "growth_1_s": _rate(growth, seconds) if crossings >= CROSSINGS else None,
            "outside_fraction": (span.ticks - inside) / span.ticks if span.ticks else 1.0,
            "displayed_stiffness_N_m": stiffness_N_m,
            "penetration_mean_m": depth_m,
        }
        measures.append(WindowMeasures(inside > 0, crossings, growth, figures))
    return measures


def _means(values: np.ndarray, counted: np.ndarray) -> list[float | None]:
    """Returns the mean of those counted in each row; None of none."""
    chosen = [row[mask] for row, mask in zip(values, counted, strict=True)]
    return [float(np.add.reduce(row)) / len(row) if len(row) else None for row in chosen]


def swings(x: np.ndarray, swing_m: np.ndarray) -> tuple[list[int], list[float]]:
    """Counts how often x swings across its straight trend by more than ``swing_m``, and measures how the width grows.

    Args:
        x: positions of some runs at equal steps, shape (runs, steps), m.
        swing_m: a crossing counts only from beyond +swing_m to beyond -swing_m or back; shape (runs,).

    Returns:
        Of every run (crossings, peak to peak of the second half over that of the first; 0 for no width at all).
    """
    runs, steps = x.shape
    if steps < 4:
        return [0] * runs, [0.0] * runs
    t, square = _centred(steps)
    offset = x - x.mean(axis=1)[:, None]
    offset -= t * (np.vecdot(t, offset) / square)[:, None]
    side = np.zeros((runs, steps + 1), np.int8)  # each run begins on neither side
    np.subtract((offset > swing_m[:, None]).view(np.int8), (offset < -swing_m[:, None]).view(np.int8), out=side[:, 1:])
    sides = side.ravel()
    comes = np.flatnonzero(sides[1:] != sides[:-1]) + 1
    comes = comes[sides[comes] != 0]
    run, is_above = comes // (steps + 1), sides[comes] > 0
    crossed = run[1:][(is_above[1:] != is_above[:-1]) & (run[1:] == run[:-1])]
    first, second = (np.ptp(half, axis=1) for half in (offset[:, : steps // 2], offset[:, steps // 2 :]))
    growth = np.divide(second, first, out=np.zeros(runs), where=first > 0.0)
    return np.bincount(crossed, minlength=runs).tolist(), growth.tolist()
