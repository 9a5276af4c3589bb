"""Measures of the last half second of some runs, and the word for each: does it rest, swing, or stay off the wall?"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from haploop.logger.verdict.about_trend import about_trend
from haploop.logger.verdict.ripple import peak_to_peak, ripple
from haploop.logger.verdict.spectrum import main_line

WINDOW_S = 0.5
CROSSINGS = 4
# Swinging by less is no limit cycle, whatever the encoder: a thousandth of how far a wall of 1 N/mm yields to 1 N.
SMALLEST_SWING_M = 1e-6
# A quantised position on the wall's face may lie inside by this much, relative to the face's position.
ROUNDING = 1e-12
# Words for a window alone, which says nothing about stability, by the verdicts of a pushed loop that look the same.
NO_SWING, SWINGING = "no-swing-seen", "swinging"
OF_WINDOW = {"steady": NO_SWING, "limit-cycle": SWINGING}
# Why the window of a run gets no word, whatever is seen in it.
UNTOLD = {
    "no tick": "The run ended before its first tick was done.",
    "short": f"Less than {WINDOW_S:g} s of the run was seen.",
    "failed": "The run failed, and nothing shows how it would have continued.",
    "changed": "The loop was changed at {at_s:g} s, within the window from {from_s:g} s on, "
    "so the window does not show the loop as it is now.",
}
_SWINGING = (
    f"; swinging is to do so {CROSSINGS} times or more, in the second half at least half as wide as in the first."
)
_RULES = {
    "swings": "From {from_s:.6g} s on the position swung through the middle of its motion {times} times by more than "
    "{swing_um:.3g} µm, in the second half {growth:.2f} times as wide as in the first" + _SWINGING,
    "rests": "From {from_s:.6g} s on the position did not swing by more than {swing_um:.3g} µm to both sides of the "
    "middle of its motion" + _SWINGING,
    "untouched": "No tick from {from_s:.6g} s on was in contact.",
}


class Figures(NamedTuple):
    """The ``window`` entry of the summary.

    Attributes:
        from_s: when the window begins: half a second before the end, or half-way through a run shorter than that.
        oscillation_m: how far the true position moved in the window, peak to peak.
        growth_1_s: the r of e^(r t) by which the swings grow; negative: they decay; None where nothing swings.
        frequency_Hz: frequency of the main line in the spectrum of the position at the ticks; where none stands out, or
            where the swing is too fast for them, half the number of crossings of its straight trend per second, to
            1 Hz; None where nothing swings.
        outside_fraction: share of the ticks of the window that are out of contact.
        displayed_stiffness_N_m: mean of total force over penetration at the ticks in contact (Choi et al. 2022, V.B.2),
            except those whose penetration is a rounding error of the wall's position; None without such ticks.
        penetration_mean_m: mean penetration of the measured position at the ticks in contact; None without such ticks.
        force_ripple_N: swing of the commanded force above 30 Hz, peak to peak.
        force_swing_N: swing of the commanded force, peak to peak.
        changed_s: when the loop was last changed within the window, so that it shows two loops; None if it was not.
    """

    from_s: float
    oscillation_m: float
    growth_1_s: float | None
    frequency_Hz: float | None
    outside_fraction: float
    displayed_stiffness_N_m: float | None
    penetration_mean_m: float | None
    force_ripple_N: float
    force_swing_N: float
    changed_s: float | None = None


class WindowMeasures(NamedTuple):
    """Measures of the window of one run: whether any tick was in contact, what ``swings`` counts, and the figures."""

    touched: bool
    crossings: int
    growth: float
    figures: Figures


class MeasuredColumns(NamedTuple):
    """Measures of the windows of some runs, a list each: the two of ``swings``, the main line, width peak to peak, and
    ticks in contact.

    The line is None where nothing swings or no line stands out. Displayed stiffness and penetration are means over
    ticks in contact, None without any; forces are of the command.
    """

    crossings: list[int]
    growth: list[float]
    line_Hz: list[float | None]
    width_m: list[float]
    inside: list[int]
    stiffness_N_m: list[float | None]
    depth_m: list[float | None]
    ripple_N: list[float]
    swing_N: list[float]


class Extremes(NamedTuple):
    """Extremes of a whole run.

    Attributes:
        x_min_m: least true position of the device, of the motor where there is a cable.
        x_max_m: greatest true position of the same body.
        force_max_N: greatest force of the actuator, in magnitude.
    """

    x_min_m: float
    x_max_m: float
    force_max_N: float


class Verdict(NamedTuple):
    """A word, for a window ``no-swing-seen``, ``swinging``, ``no-contact`` or ``undecided``, and the rule behind it."""

    word: str
    rule: str


class RunMeasures(NamedTuple):
    """Measures of a run so far: of its window, of all of it, and the limit up to which nothing counts as a swing."""

    window: WindowMeasures
    extremes: Extremes
    swing_m: float

    def is_finite(self) -> bool:
        """Tells whether every number is finite, and no sum of them is beyond what a float holds."""
        return math.isfinite(sum(self.extremes) + sum(filter(None, self.window.figures)))

    def verdict(self, diverged: str | None, untold: str = "") -> Verdict:
        """Judges the run by its window.

        Args:
            diverged: why the plant itself ended the run, if it did.
            untold: a sentence on why the window gets no word; "" where it gets one.
        """
        if diverged:
            return Verdict("diverged", f"{diverged}.")
        window = self.window
        known = {"from_s": window.figures.from_s, "times": window.crossings, "growth": window.growth}
        rule = _RULES["untouched" if not window.touched else "swings" if window.crossings else "rests"].format(
            **known, swing_um=self.swing_m * 1e6
        )
        if untold:
            return Verdict("undecided", untold if untold == UNTOLD["no tick"] else f"{untold} {rule}")
        if not window.touched:
            return Verdict("no-contact", rule)
        return Verdict(SWINGING if window.crossings >= CROSSINGS and window.growth >= 0.5 else NO_SWING, rule)

    def untold(self, ticks: int, ended: str, changed_s: float | None) -> str:
        """Returns why the window gets no word, "" where it gets one.

        Args:
            ticks: number of ticks that ran.
            ended: how the run ended; "" while it goes on.
            changed_s: when the loop was changed within the window; None if it was not.
        """
        if not ticks:
            return UNTOLD["no tick"]
        if ended == "failed":
            return UNTOLD["failed"]
        if changed_s is None or not self.window.touched:
            return ""
        return UNTOLD["changed"].format(at_s=changed_s, from_s=self.window.figures.from_s)

    def of_two_loops(self, changed_s: float) -> RunMeasures:
        """Returns the measures for a window in which the loop was changed: it displayed more than one stiffness."""
        figures = self.window.figures._replace(displayed_stiffness_N_m=None, changed_s=changed_s)
        return self._replace(window=self.window._replace(figures=figures))


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


def measure_window(
    x: np.ndarray, rows: dict[str, np.ndarray], span: Span, rate: int, control_rate: int, swing_m: np.ndarray
) -> list[WindowMeasures]:
    """Returns the measures of the windows of some runs; each is computed as if it were alone.

    Args:
        x: positions at the last plant steps at least, shape (runs, steps), m.
        rows: ``CONTROLLER_COLUMNS`` at the last ticks at least, shape (runs, ticks).
        rate, control_rate: plant steps and ticks a second.
        swing_m: limit up to which nothing counts as a swing, shape (runs,), m.
    """
    x = x[:, -span.steps - 1 :]
    held = {name: column[:, column.shape[1] - span.ticks :] for name, column in rows.items()}
    inside = held["in_contact"] > 0
    depth = held["wall_position"] - held["x"]
    real = inside & (np.abs(depth) > ROUNDING * np.abs(held["wall_position"]))
    with np.errstate(over="ignore"):  # an element may ask for any finite force
        stiffness = np.divide(held["total"], depth, out=np.zeros_like(depth), where=real)
    crossings, growth = swings(x, swing_m)
    n = rate // control_rate
    at_ticks = x[:, ::-1][:, : span.steps // n * n : n][:, ::-1]
    measured = MeasuredColumns(
        crossings,
        growth,
        main_lines(at_ticks, control_rate, crossings),
        np.ptp(x, axis=1).tolist() if x.shape[1] else [0.0] * len(x),
        np.count_nonzero(inside, axis=1).tolist(),
        _means(stiffness, real),
        _means(np.abs(depth), inside),
        ripple(held["total"], control_rate).tolist(),
        peak_to_peak(held["total"]).tolist(),
    )
    return window_measures(measured, span, rate, control_rate)


def main_lines(x: np.ndarray, control_rate: int, crossings: list[int]) -> list[float | None]:
    """Returns the frequency of the main line of each run's position at its ticks, Hz; None where nothing swings.

    Args:
        x: positions at the last ticks, shape (runs, ticks), m.
        control_rate: ticks a second.
        crossings: those of ``swings``.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        lines = [main_line(row, control_rate) if n >= CROSSINGS else None for row, n in zip(x, crossings, strict=True)]
    return [line and line.frequency_Hz for line in lines]


def window_measures(measured: MeasuredColumns, span: Span, rate: int, control_rate: int) -> list[WindowMeasures]:
    """Returns the measures of each run's window, with the figures of the summary."""
    start_s, seconds = span.first / rate, (span.steps + 1) / rate
    measures = []
    for crossings, growth, line_Hz, width_m, inside, stiffness_N_m, depth_m, *forces_N in zip(*measured, strict=True):
        # A swing that is `growth` times as wide in the second half of the window follows e^(r t).
        rate_1_s = 2.0 * math.log(growth) / seconds if crossings >= CROSSINGS and growth > 0.0 else None
        crossed_Hz = crossings / (2.0 * seconds) if crossings >= CROSSINGS else None
        # What swings faster than half the control rate appears at another frequency in the positions at the ticks.
        is_slow = crossed_Hz is not None and 2.0 * crossed_Hz <= control_rate
        frequency_Hz = line_Hz if line_Hz and is_slow else crossed_Hz
        outside = (span.ticks - inside) / span.ticks if span.ticks else 1.0
        figures = Figures(start_s, width_m, rate_1_s, frequency_Hz, outside, stiffness_N_m, depth_m, *forces_N)
        measures.append(WindowMeasures(inside > 0, crossings, growth, figures))
    return measures


def _means(values: np.ndarray, counted: np.ndarray) -> list[float | None]:
    chosen = [row[mask] for row, mask in zip(values, counted, strict=True)]
    return [float(np.add.reduce(row)) / len(row) if len(row) else None for row in chosen]


def swings(x: np.ndarray, swing_m: np.ndarray) -> tuple[list[int], list[float]]:
    """Counts how often x swings across its straight trend by more than ``swing_m``, and measures how the width grows.

    Args:
        x: positions of some runs at equal steps, shape (runs, steps), m.
        swing_m: a crossing counts only from beyond +swing_m to beyond -swing_m or back; shape (runs,).

    Returns:
        For every run, crossings, and peak to peak of the second half over that of the first (0 for no width at all).
    """
    runs, steps = x.shape
    if steps < 4:
        return [0] * runs, [0.0] * runs
    offset = about_trend(x)
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
