"""Sight of a loop: what its newest half second and two seconds show, in a word only for a window in one regime."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from haploop.logger.verdict.about_trend import about_trend
from haploop.logger.verdict.measures import CROSSINGS, ROUNDING, SMALLEST_SWING_M, WINDOW_S, swings
from haploop.logger.verdict.spectrum import main_line
from haploop.protocol.filled import filled
from haploop.view.store.history import History

# A slow swing, or one that has just ended, is looked for in this many windows; growth and decay are reported beyond
# these ratios of the two halves.
_LONG = 4
_DIES, _GROWS = 0.5, 2.0
_SWINGS = ("died away", "dying away", "growing", "swinging")
# At rest, the position stays within this multiple of what counts as a swing, once to either side, plus rounding. The
# force stays within this share of the largest.
_REST, _RIPPLE, _LEAST_RIPPLE_N = 2.0 + 1e-6, 0.02, 1e-3
_WHY = {
    "settling": "These are the numbers so far: no word before {window:g} s in one regime, since {begin}.",
    "no contact": "No tick of the last {window:g} s was in contact.",
    "swinging": "In the last {seen:.3g} s the position swung through the middle of its motion {crossings} times "
    "by more than {swing_um:.3g} µm.",
    "growing": "In the last {seen:.3g} s the position swung through the middle of its motion {crossings} times, "
    "the second half {growth:.2f} times as wide as the first.",
    "dying away": "In the last {seen:.3g} s the position swung through the middle of its motion {crossings} times, "
    "the second half {growth:.2f} times as wide as the first.",
    "over": "In the last {seen:.3g} s the position swung through the middle of its motion {crossings} times "
    "by more than {swing_um:.3g} µm; in the last {window:g} s it did not.",
    "moving": "In the last {seen:.3g} s the position moved by {width_um:.3g} µm and swung through the middle "
    "of its motion {crossings} times: a push of the hand, or a swing too slow to be recognised.",
    "force ripples": "The position rests, but in the last {window:g} s the force rippled by {ripple_N:.3g} N.",
    "ripple over": "The position rests; in the last {seen:.3g} s the force rippled by {most_N:.3g} N, in the last "
    "{window:g} s by {ripple_N:.3g} N.",
    "no swing seen": "In the last {seen:.3g} s the position stayed within {width_um:.3g} µm; in no {window:g} s of "
    "them did the force swing by more than {most_N:.3g} N about its straight trend. This says nothing about stability.",
    "not finite": "A position or force is not a finite number.",
}


@dataclass(frozen=True)
class Sight:
    """What is seen of a loop in an interval.

    Attributes:
        word: a key of the rules; ``why`` is a sentence.
        so_far_word: what the word would be if the interval were a whole window; "" where nothing can be said.
        from_s, to_s: the interval that the word is about; numbers are of its newest window.
        so_far: whether the interval is shorter than a window, so that no word is given yet.
        oscillation_m, ripple_N: widths of position and of applied force about their straight trends, peak to peak; that
            of the position with its trend, where the trend of a swing that is cut off makes it no narrower.
        force_swing_N: width of the applied force with its trend, peak to peak.
        rests: whether the position, in the newest window, swung by no more than what counts as a swing.
        frequency_Hz: of the line of the position if one stands out, else of the line of the force; None without one.
        stiffness_N_m: mean of force over penetration at the ticks in contact; None without any, or where the actuator
            could not give the force.
    """

    word: str
    why: str
    from_s: float
    to_s: float
    so_far: bool = False
    oscillation_m: float | None = None
    ripple_N: float | None = None
    frequency_Hz: float | None = None
    stiffness_N_m: float | None = None
    force_swing_N: float | None = None
    so_far_word: str = ""
    rests: bool = False


def window_ticks(rate: int) -> int:
    return max(2, round(WINDOW_S * rate))


def see(history: History, since: int, end: int, resolution_m: float, most_N: float = math.inf) -> Sight | None:
    """Returns what the ticks before ``end`` show; None where none of them is held in full.

    Args:
        since: tick of the last change of the loop, or of its start: what was before is another regime. So is what was
            before a contact that came after more than a window without contact.
        resolution_m: of the encoder; swings within it do not count. 0 without an encoder.
        most_N: the actuator's largest force; where more was commanded, no stiffness is displayed.
    """
    rate, window = history.time.control_rate, window_ticks(history.time.control_rate)
    known = max(history.steps.full_from_tick, history.ticks.full_from_tick, history.first_tick or 0)
    begin, by = max(since, known), "the start" if since <= known else f"{since / rate:g} s"
    if end - begin < 4:
        return None
    inside, stiffness = _contact(history, max(known, end - 2 * window), end, most_N)
    came = end - len(inside) + int(np.argmax(inside)) if inside.any() else None
    if came is not None and came > max(begin, end - window) and came > end - len(inside):
        begin, by = came, f"contact at {came / rate:g} s"
    n = history.time.steps_per_tick
    recent = history.steps.rows(("x", "force"), held := max(begin, end - _LONG * window), end)
    lacking = np.flatnonzero(np.isnan(recent).any(axis=0))
    if len(lacking) and lacking[-1] < recent.shape[1] - 1:  # not received: what is no number stays so to the end
        begin = held + int(lacking[-1]) // n + 1
        by = f"the missing data before {begin / rate:g} s"
        recent = recent[:, (begin - held) * n :]
    so_far = end - begin < window
    first = max(begin, end - window)
    if end - first < 4:
        return Sight("settling", _WHY["settling"].format(window=WINDOW_S, begin=by), first / rate, end / rate, True)
    long_first = max(begin, end - _LONG * window)
    if not np.isfinite(recent).all():
        return Sight("not finite", _WHY["not finite"], first / rate, end / rate)
    newest, swing_m = recent[:, (first - long_first) * n :], max(resolution_m, SMALLEST_SWING_M)
    (fast, fast_growth), (crossings, growth) = _swings(newest[0], swing_m), _swings(recent[0, ::n], swing_m)
    rests = bool(np.ptp(newest[0]) <= swing_m * (1.0 + 1e-6))
    if fast >= CROSSINGS:
        crossings, growth, long_first, recent = fast, fast_growth, first, newest
    seen_s = (end - long_first) / rate
    width, ripples = float(np.ptp(recent[0])), _ripples(recent[1], window * n)
    ripple, why = ripples[0][0], ""
    if not inside[-window:].any():
        word = "no contact"
    elif crossings >= CROSSINGS and rests:
        word, why = "died away", "over"
    elif crossings >= CROSSINGS:
        word = _course(recent[0] if recent is newest else recent[0, ::n], growth, swing_m)
    elif width > _REST * swing_m:
        word = "moving"
    elif ripples[0][1]:
        word = "force ripples"
    elif any(counts for _, counts in ripples):
        word, why = "died away", "ripple over"
    else:
        word = "no swing seen"
    so_far_word, word = word, "settling" if so_far else word
    line = main_line(recent[0, ::n], rate) if width > _REST * swing_m else None
    line = line or (main_line(recent[1, ::n], rate) if ripple else None)
    # The frequency of a swing without a line follows from how often it crosses its middle.
    hertz = line.frequency_Hz if line else crossings / (2.0 * seen_s) if so_far_word in _SWINGS else None
    hertz = None if so_far_word == "no swing seen" else hertz
    why = filled(
        _WHY[word if so_far else why or word], window=WINDOW_S, begin=by, seen=seen_s, crossings=crossings,
        growth=growth, swing_um=swing_m * 1e6, width_um=width * 1e6, ripple_N=ripple, most_N=max(ripples)[0],
    )  # fmt: skip
    swing_now_m = float(min(np.ptp(newest[0]), np.ptp(about_trend(newest[0]))))
    return Sight(
        word, why, long_first / rate, end / rate, so_far, swing_now_m, ripple,
        hertz, stiffness if inside[first - end :].any() else None,
        float(np.ptp(newest[1])), so_far_word, rests,
    )  # fmt: skip


def _contact(history: History, first: int, end: int, most_N: float) -> tuple[np.ndarray, float | None]:
    """Returns whether each tick was in contact, and the mean of total force over penetration in the newest window.

    That is None without contact there, and where more than ``most_N`` was commanded.
    """
    position, x, total = history.ticks.rows(("wall_position", "x_measured", "total"), first, end)
    depth = (x - position) * history.at_work.into_wall
    with np.errstate(invalid="ignore"):
        inside = depth > ROUNDING * np.abs(position)
    newest = np.flatnonzero(inside[-window_ticks(history.time.control_rate) :])
    if not len(newest):
        return inside, None
    newest += max(0, len(inside) - window_ticks(history.time.control_rate))
    if (np.abs(total[newest]) > most_N).any():
        return inside, None
    ratio = -total[newest] * history.at_work.into_wall / depth[newest]
    return inside, float(ratio.mean()) if np.isfinite(ratio).all() else None


def _ripples(force: np.ndarray, size: int) -> list[tuple[float, bool]]:
    """Returns the width of force about its straight trend, and if it counts, in windows of a size, the newest first."""
    windows = [force[max(0, stop - size) : stop] for stop in range(len(force), 3, -size)]
    widths = [float(np.ptp(about_trend(window))) for window in windows]
    least = [max(_LEAST_RIPPLE_N, _RIPPLE * float(np.abs(window).max())) for window in windows]
    return [(width, width > above) for width, above in zip(widths, least, strict=True)]


def _course(x: np.ndarray, growth: float, swing_m: float) -> str:
    """Returns the word for a swing by the growth from half to half of its trace x, m, which its second half must share:
    what a contact sets off may be half as wide in the second half, and go on there for good."""
    later = _swings(x[len(x) // 2 :], swing_m)[1]
    if growth < _DIES and later < _DIES**0.5:
        return "dying away"
    return "growing" if growth > _GROWS and later > _GROWS**0.5 else "swinging"


def _swings(x: np.ndarray, swing_m: float) -> tuple[int, float]:
    crossings, growth = swings(x[None], np.array([swing_m]))
    return crossings[0], growth[0]
