"""The word for a loop, from how its swing goes on after two pushes of different size."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from haploop.launch.stability.traces import Trend, frequency_Hz, is_felt, ripple, smallest_felt_m, trend, widths

# Pieces in which the width of a swing is measured, and the periods that one covers at least.
PIECES = 24
_LEAST_PERIODS = 1.5
# A swing this small is rounding: a thousand atoms would be wider.
_REST_M = 1e-9
# A swing that dies is watched until it is this small, or for long.
_SMALL_M = 20e-6
# So much may the logarithm of the width change over the second half where a swing is said to last.
_LASTING, _LASTING_LONG = 0.05, 0.02
# Sizes whose ratio lies between these are the same; those of the pushes differ by ten.
_SAME = (0.7, 1.43)
# After so long a slow change counts as none, and a steady growth as one.
_LONG_S = 8.0

WHY = {
    "diverged": "The run ended by itself: {detail}.",
    "no contact": "No tick of the last half second, or of the second half of a shorter run, was in contact.",
    "rest": "After a push of {push_N:.3g} N it came to rest.",
    "unfelt": "After a push of {push_N:.3g} N it came to rest but for {width_um:.3g} um peak to peak at "
    "{frequency_Hz:.3g} Hz, less than a hand feels ({felt_um:.3g} um).",
    "forgets": "Pushes of {push_N:.3g} N and a tenth of it end in the same swing, {width_um:.4g} um peak to peak at "
    "{frequency_Hz:.3g} Hz.",
    "lasts": "A swing of {width_um:.4g} um peak to peak at {frequency_Hz:.3g} Hz lasted for {watched_s:g} s, its width "
    "changing by less than 2 %.",
    "grows": "Its swing grew by {rate_1_s:.3g} +- {error_1_s:.2g} 1/s, at {frequency_Hz:.3g} Hz.",
    "leaves the limit": "Its swing grew until the device was beyond its limit.",
    "failed": "The loop failed while it was watched: {detail}",
    "leaves the wall": "Held still, the hand does not keep the device at the wall.",
    "too slow": "Its swing of {width_um:.4g} um peak to peak at {frequency_Hz:.3g} Hz changes by {rate_1_s:.2g} +- "
    "{error_1_s:.1g} 1/s, too slowly to tell within {watched_s:g} s; {needs_s:.3g} s would tell.",
}


@dataclass(frozen=True)
class Finding:
    """What was found of a loop whose hand is held still.

    Attributes:
        word: steady, limit-cycle, growing, diverged, no-contact or undecided.
        why: key of ``WHY``.
        push_N: the larger of the two pushes.
        watched_s: time looked at, since the push.
        rate_1_s, error_1_s: growth of the swing and its standard error; None where it died within a few pieces.
        frequency_Hz: of what remains at the end.
        width_m: what remains, peak to peak: the mean over the last quarter of both traces.
        spread_m: half the range of that width over the pieces and traces.
        force_ripple_N: what the command swings by above 30 Hz, peak to peak, in the last quarter.
        felt: whether a hand feels the swing.
        chaotic: whether two copies started a thousandth apart ended apart by a fifth of the swing; None if not asked.
        detail: why the run itself ended, where it diverged, or what failed.
        needs_s: time after which a swing that changes too slowly would be told; None otherwise.
    """

    word: str
    why: str
    push_N: float = 0.0
    watched_s: float = 0.0
    rate_1_s: float | None = None
    error_1_s: float | None = None
    frequency_Hz: float = 0.0
    width_m: float = 0.0
    spread_m: float = 0.0
    force_ripple_N: float = 0.0
    felt: bool = False
    chaotic: bool | None = None
    needs_s: float | None = None
    detail: str = ""

    def sentence(self) -> str:
        """Returns why, with its numbers."""
        numbers = {name: math.nan if value is None else value for name, value in vars(self).items()}
        felt_um = 2e6 * smallest_felt_m(self.frequency_Hz)
        return WHY[self.why].format(**numbers, width_um=1e6 * self.width_m, felt_um=felt_um)


@dataclass(frozen=True)
class Pushed:
    """The loop after both pushes.

    Attributes:
        small, large: position at ticks after the smaller and the larger push, m, of equal length.
        command: command at ticks after the larger one, N.
        rate: ticks a second.
        push_N: the larger push.
        count_m: one count of the encoder; 0 without.
        inside: whether a tick in the last quarter of both was in contact.
    """

    small: np.ndarray
    large: np.ndarray
    command: np.ndarray
    rate: float
    push_N: float
    count_m: float
    inside: bool


def decide(pushed: Pushed, *, last: bool) -> Finding:
    """Returns the finding; ``undecided`` asks for a longer time unless it is the ``last`` one.

    *steady*: the swing died, or dies and what is left of it no hand feels. *limit-cycle*: it forgets how hard it was
    pushed, yet remains, and is felt. *growing*: both swings grow.
    """
    watched_s = len(pushed.large) / pushed.rate
    if not pushed.inside:
        return Finding("undecided", "leaves the wall", pushed.push_N, watched_s)
    size = len(pushed.large) // PIECES
    small, large = widths(pushed.small, size), widths(pushed.large, size)
    half, quarter = len(small) // 2, len(small) // 4
    of_small, of_large = (trend(width[half:], size / pushed.rate) for width in (small, large))
    tail = np.concatenate([small[-quarter:], large[-quarter:]])
    end = pushed.large[-len(pushed.large) // 4 :]
    found = _Found(pushed, watched_s, of_small, of_large, tail, frequency_Hz(end, pushed.rate))
    width, frequency = float(tail.mean()), found.frequency_Hz
    if tail.max() < _REST_M:
        return found.finding("steady", "rest")
    rising = any(each.change > max(_LASTING, 3 * each.error) for each in (of_small, of_large))
    falling = of_small.change < -_LASTING and of_large.change < -_LASTING and (width < _SMALL_M or watched_s >= _LONG_S)
    if not is_felt(width, frequency) and not rising and (falling or width <= 2.0 * pushed.count_m):
        return found.finding("steady", "unfelt")
    if size * frequency < _LEAST_PERIODS * pushed.rate and not last:
        return found.finding("undecided", "too slow")
    at_first = large[0] / max(small[0], _REST_M)
    at_last = large[-quarter:].mean() / max(small[-quarter:].mean(), _REST_M)
    if found.lasts(_LASTING) and _SAME[0] < at_last < _SAME[1] and not 0.5 < at_first < 2.0:
        return found.finding("limit-cycle", "forgets")
    kept_ratio = at_first > 2.0 and _SAME[0] < at_last / at_first < _SAME[1]
    if found.lasts(_LASTING_LONG) and watched_s >= _LONG_S and not kept_ratio:
        return found.finding("limit-cycle", "lasts")
    if watched_s >= _LONG_S and all(each.change > 4 * each.error for each in (of_small, of_large)):
        return found.finding("growing", "grows")
    return found.finding("undecided", "too slow")


@dataclass(frozen=True)
class _Found:
    pushed: Pushed
    watched_s: float
    small: Trend
    large: Trend
    tail: np.ndarray
    frequency_Hz: float

    def lasts(self, within: float) -> bool:
        """Tells whether both swings neither grow nor decay, as far as their scatter lets one say."""
        both = self.small, self.large
        return all(abs(each.change) < max(within, 2 * each.error) and each.error < 0.1 for each in both)

    def finding(self, word: str, why: str) -> Finding:
        slower = min((self.small, self.large), key=lambda each: abs(each.rate_1_s))
        width = float(self.tail.mean())
        felt_m = 2.0 * smallest_felt_m(self.frequency_Hz)
        needs_s = None
        if word == "undecided":
            needs_s = self.watched_s * max(2.0, 4.0 * slower.error / max(abs(slower.change), 1e-12))
            if slower.rate_1_s < 0.0:
                needs_s = max(needs_s, self.watched_s + math.log(max(width / felt_m, 1.0)) / -slower.rate_1_s)
        end = self.pushed.command[-len(self.pushed.command) // 4 :]
        return Finding(
            word, why, self.pushed.push_N, self.watched_s, slower.rate_1_s, slower.error_1_s, self.frequency_Hz, width,
            float(np.ptp(self.tail)) / 2.0, ripple(end, self.pushed.rate), width >= felt_m, None, needs_s,
        )  # fmt: skip
