"""What the last half second of some runs shows, worked out for all of them at once."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

CROSSINGS = 4
# A quantised position on the wall's face may lie inside by this much, relative to the face's position.
ROUNDING = 1e-12


class Seen(NamedTuple):
    """What a window shows of one run.

    Attributes:
        touched: whether any tick was in contact.
        crossings, growth: as ``swings`` tells them.
        figures: the ``window`` entry of the summary.
    """

    touched: bool
    crossings: int
    growth: float
    figures: dict[str, Any]


class Span(NamedTuple):
    """What part of a run a window covers: its plant steps, its ticks, and its first step."""

    steps: int
    ticks: int
    first: int

    @classmethod
    def of(cls, ran: int, keep: int, steps_per_tick: int) -> Span:
        """The last ``keep`` steps of a run of ``ran`` steps, or its second half if it is shorter."""
        steps = min(keep, ran if ran >= keep else ran // 2)
        first = ran - steps
        ticks = ran // steps_per_tick + bool(ran % steps_per_tick)
        return cls(steps, ticks - -(-first // steps_per_tick), first)


def _rate(growth: float, seconds: float) -> float | None:
    """r in 1/s if what is ``growth`` times as wide in the second half of ``seconds`` follows e^(r t)."""
    return 2.0 * math.log(growth) / seconds if growth > 0.0 else None


@lru_cache(maxsize=4)
def _centred(count: int) -> tuple[np.ndarray, float]:
    """So many equal steps around 0, and the sum of their squares."""
    t = np.arange(count) - (count - 1) / 2.0
    return t, np.dot(t, t)


def look(x: np.ndarray, rows: dict[str, np.ndarray], span: Span, rate: int, swing_m: np.ndarray) -> list[Seen]:
    """What the windows of some runs show; each is worked out as if it were alone.

    Args:
        x: positions at the last plant steps at least, shape (runs, steps), m.
        rows: ``CONTROLLER_COLUMNS`` at the last ticks at least, shape (runs, ticks).
        span: of the windows.
        rate: plant steps a second.
        swing_m: what does not count as a swing, shape (runs,).
    """
    x = x[:, -span.steps - 1 :]
    held = {name: column[:, column.shape[1] - span.ticks :] for name, column in rows.items()}
    crossings, growth = swings(x, swing_m)
    inside = held["in_contact"] > 0
    depth = held["wall_position"] - held["x"]
    real = inside & (np.abs(depth) > ROUNDING * np.abs(held["wall_position"]))
    stiffness = np.divide(held["total"], depth, out=np.zeros_like(depth), where=real)
    outside = np.count_nonzero(~inside, axis=1) / max(span.ticks, 1)
    columns: dict[str, list[Any]] = {
        "oscillation_m": np.ptp(x, axis=1).tolist() if x.shape[1] else [0.0] * len(x),
        "growth_1_s": [
            _rate(by, x.shape[1] / rate) if count >= CROSSINGS else None
            for count, by in zip(crossings, growth, strict=True)
        ],
        "outside_fraction": outside.tolist() if span.ticks else [1.0] * len(x),
        "displayed_stiffness_N_m": _means(stiffness, real),
        "penetration_mean_m": _means(np.abs(depth), inside),
    }
    figures = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    touched, from_s = np.any(inside, axis=1).tolist(), {"from_s": span.first / rate}
    return [Seen(*of[:3], from_s | of[3]) for of in zip(touched, crossings, growth, figures, strict=True)]


def _means(values: np.ndarray, counted: np.ndarray) -> list[float | None]:
    """The mean of those counted in each row; None of none."""
    chosen = [row[mask] for row, mask in zip(values, counted, strict=True)]
    return [float(np.add.reduce(row)) / len(row) if len(row) else None for row in chosen]


def swings(x: np.ndarray, swing_m: np.ndarray) -> tuple[list[int], list[float]]:
    """How often x swings across its straight trend by more than ``swing_m`` on either side, and how the width grows.

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
    beyond = np.flatnonzero(np.abs(offset) > swing_m[:, None])
    is_above, run = offset.ravel()[beyond] > 0.0, beyond // steps
    crossed = run[1:][(is_above[1:] != is_above[:-1]) & (run[1:] == run[:-1])]
    first, second = (np.ptp(half, axis=1) for half in (offset[:, : steps // 2], offset[:, steps // 2 :]))
    growth = np.divide(second, first, out=np.zeros(runs), where=first > 0.0)
    return np.bincount(crossed, minlength=runs).tolist(), growth.tolist()
