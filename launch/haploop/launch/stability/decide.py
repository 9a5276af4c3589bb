"""The word for a loop, from how its swing goes on after two pushes of different size."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from haploop.launch.stability.traces import frequency_Hz, is_felt, ripple, smallest_felt_m, trend, widths

# Pieces in which the width of a swing is measured, and the periods that one covers at least.
PIECES, FEW_PIECES = 24, 8
_LEAST_PERIODS = 1.5
# A swing this small is rounding: a thousand atoms would be wider.
_REST_M = 1e-9
# A swing that dies is watched until it is this small, or for long.
_SMALL_M = 20e-6
# So much may the logarithm of the width change over the second half where a swing is said to last.
_LASTING, _LASTING_LONG = 0.05, 0.02
# Sizes whose ratio lies between these are the same; those of the pushes differ by ten.
_SAME = (0.7, 1.43)
# After so long, and so many periods, a slow change counts as none, and a steady growth as one.
_LONG_S = 8.0
_COUNTED_PERIODS = 60.0
# After so long, swings of both sizes that grow alike grow for good, and what is known not to change lasts.
_ALIKE_S = 4.0
# A swing of the loop that is wider than that of its run by more than this has not been seen in it.
_WIDER = 1.2
# Behind an encoder a swing that decays may end as a chatter of so many counts, peak to peak, at the most.
_COUNTS = 10

WHY = {
    "diverged": "The run ended by itself: {detail}.",
    "no contact": "No tick of the last half second, or of the second half of a shorter run, was in contact.",
    "rest": "After a push of {push_N:.3g} N it came to rest; what else moved was the hand or noise.",
    "unfelt": "After a push of {push_N:.3g} N it came to rest but for {width_um:.3g} um peak to peak at "
    "{frequency_Hz:.3g} Hz, less than a hand feels ({felt_um:.3g} um).",
    "forgets": "Pushes of {push_N:.3g} N and a tenth of it end in the same swing, {width_mm:.3g} mm peak to peak at "
    "{frequency_Hz:.3g} Hz.",
    "lasts": "A swing of {width_mm:.3g} mm peak to peak at {frequency_Hz:.3g} Hz lasted for {watched_s:g} s, its width "
    "changing by less than 2 %.",
    "decays": "Its swing of {width_mm:.3g} mm peak to peak at {frequency_Hz:.3g} Hz still decays, by {rate_1_s:.3g} +- "
    "{error_1_s:.1g} 1/s, and nothing in the loop makes small swings other than large ones.",
    "grows": "Its swing grew by {rate_1_s:.3g} +- {error_1_s:.2g} 1/s, at {frequency_Hz:.3g} Hz.",
    "leaves the limit": "Its swing grew until the device was beyond its limit.",
    "failed": "The loop failed while it was watched: {detail}",
    "leaves the wall": "Held still, the hand does not keep the device at the wall.",
    "too slow": "Its swing of {width_mm:.3g} mm peak to peak at {frequency_Hz:.3g} Hz changes by {rate_1_s:.2g} +- "
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

    def entries(self, seen_m: float | None = None) -> dict[str, Any]:
        """Returns what a summary tells of it: the word, why as a sentence, and the numbers as its ``stability``.

        ``seen_m`` is how far the run itself swung at its end, peak to peak.
        """
        numbers = {name: value for name, value in vars(self).items() if name not in ("word", "detail")}
        numbers["own_share"] = self.own_share(seen_m)
        return {"verdict": self.word, "verdict_rule": self.sentence(), "stability": numbers}

    def own_share(self, seen_m: float | None) -> float | None:
        """Returns which share of the swing seen in the run the loop keeps up by itself, with a still hand and no noise.

        What is left is the hand's own motion, the noise, or dies away. None where it cannot be told: of a loop that
        does not settle, of a run that did not swing, and where the loop swings wider than the run did.
        """
        if self.word not in ("steady", "limit-cycle") or not seen_m or seen_m < _REST_M:
            return None
        own_m = 0.0 if self.why == "decays" else self.width_m
        return min(own_m / seen_m, 1.0) if own_m < _WIDER * seen_m else None

    def sentence(self) -> str:
        """Returns why, with its numbers."""
        numbers = {name: math.nan if value is None else value for name, value in vars(self).items()}
        sizes = {"width_mm": 1e3 * self.width_m, "width_um": 1e6 * self.width_m}
        return WHY[self.why].format(**numbers, **sizes, felt_um=2e6 * smallest_felt_m(self.frequency_Hz))


class Pushed(NamedTuple):
    """Some loops after both pushes; arrays have the members on their first axis.

    Attributes:
        small, large: position at the ticks after the smaller and the larger push, shape (members, ticks), m.
        command: command at the ticks after the larger one, shape (members, ticks), N.
        push_N: the larger push, shape (members,).
        count_m: one count of the encoder, shape (members,); 0 without.
        inside: whether a tick in the last quarter of both was in contact, shape (members,).
        stays_inside: whether all ticks in the last half of both were.
        smooth: whether the loop treats small swings as large ones, but for the counts of its encoder, shape (members,).
    """

    small: np.ndarray
    large: np.ndarray
    command: np.ndarray
    push_N: np.ndarray
    count_m: np.ndarray
    inside: np.ndarray
    stays_inside: np.ndarray
    smooth: np.ndarray


class Swing(NamedTuple):
    """Measures of one loop after both pushes.

    Attributes:
        watched_s: time since the push.
        changes, errors: of the logarithm of the width over the second half, small and large, and their standard errors.
        rate_1_s, error_1_s: growth of the one that changes less, and its standard error.
        width_m, spread_m, most_m: mean, half range and maximum of the widths in the last quarter of both.
        moved_m: peak to peak over the last half of either, with its trend.
        at_first, at_last: width after the larger push over that after the smaller, in the first piece and at the last.
        frequency_Hz: of the end.
        covers_periods: periods that a piece covers.
    """

    watched_s: float
    push_N: float
    count_m: float
    inside: bool
    stays_inside: bool
    smooth: bool
    changes: tuple[float, float]
    errors: tuple[float, float]
    rate_1_s: float
    error_1_s: float
    width_m: float
    spread_m: float
    most_m: float
    moved_m: float
    at_first: float
    at_last: float
    frequency_Hz: float
    ripple_N: float
    covers_periods: float

    def lasts(self, within: float) -> bool:
        """Tells whether both swings neither grow nor decay, as far as their scatter lets one say."""
        pairs = zip(self.changes, self.errors, strict=True)
        return all(abs(change) < max(within, 2 * error) and error < 0.1 for change, error in pairs)

    def is_alike(self) -> bool:
        """Tells whether swings of other sizes go as these: never off the wall, or the larger as the smaller one."""
        rate = abs(self.changes[1] - self.changes[0]) < 0.1 * abs(self.changes[1]) + 3 * math.hypot(*self.errors)
        kept_ratio = self.at_first > 2.0 and _SAME[0] < self.at_last / self.at_first < _SAME[1]
        return rate and (self.stays_inside or kept_ratio)

    def finding(self, word: str, why: str) -> Finding:
        felt_m = 2.0 * smallest_felt_m(self.frequency_Hz)
        needs_s = None
        if word == "undecided":
            slower = min(zip(self.changes, self.errors, strict=True), key=lambda each: abs(each[0]))
            needs_s = FEW_PIECES * _LEAST_PERIODS / self.frequency_Hz if self.frequency_Hz else 0.0
            needs_s = max(needs_s, self.watched_s * max(2.0, 4.0 * slower[1] / max(abs(slower[0]), 1e-12)))
            if self.rate_1_s < 0.0:
                needs_s = max(needs_s, self.watched_s + math.log(max(self.width_m / felt_m, 1.0)) / -self.rate_1_s)
        return Finding(
            word, why, self.push_N, self.watched_s, self.rate_1_s, self.error_1_s, self.frequency_Hz, self.width_m,
            self.spread_m, self.ripple_N, self.width_m >= felt_m, None, needs_s,
        )  # fmt: skip


def measure(pushed: Pushed, rate: float) -> list[Swing]:
    """Returns the measures of each loop, worked out as if it were alone; slow swings in fewer, longer pieces.

    ``rate``: ticks a second.
    """
    ticks = pushed.large.shape[-1]
    frequency = frequency_Hz(pushed.large[:, ticks // 2 :], rate)
    is_slow = frequency * ticks / rate < _LEAST_PERIODS * PIECES
    found: dict[int, Swing] = {}
    for pieces, which in ((PIECES, ~is_slow), (FEW_PIECES, is_slow)):
        places = np.flatnonzero(which)
        if len(places):
            some = Pushed(*(part[places] for part in pushed))
            found |= zip(places.tolist(), _measured(some, rate, frequency[places], pieces), strict=True)
    return [found[place] for place in range(len(frequency))]


def _measured(pushed: Pushed, rate: float, frequency: np.ndarray, pieces: int) -> list[Swing]:
    small_x, large_x, command, *of_each = pushed
    ticks = large_x.shape[-1]
    size, last_half, last_quarter = ticks // pieces, slice(ticks // 2, None), slice(-ticks // 4, None)
    small, large = widths(small_x, size), widths(large_x, size)
    half, quarter = small.shape[-1] // 2, small.shape[-1] // 4
    small_trend, large_trend = (trend(width[:, half:], size / rate) for width in (small, large))
    slower = np.where(np.abs(large_trend.rate_1_s) < np.abs(small_trend.rate_1_s), large_trend[:2], small_trend[:2])
    tail = np.concatenate([small[:, -quarter:], large[:, -quarter:]], axis=1)
    ends = [width[:, -quarter:].mean(axis=1) for width in (small, large)]
    columns = [
        *of_each,
        np.stack([small_trend.change, large_trend.change], axis=-1),
        np.stack([small_trend.error, large_trend.error], axis=-1),
        *slower,
        tail.mean(axis=1),
        np.ptp(tail, axis=1) / 2.0,
        tail.max(axis=1),
        np.maximum(*(np.ptp(x[:, last_half], axis=1) for x in (small_x, large_x))),
        large[:, 0] / np.maximum(small[:, 0], _REST_M),
        ends[1] / np.maximum(ends[0], _REST_M),
        frequency,
        ripple(command[:, last_quarter], rate),
        size * frequency / rate,
    ]
    rows = zip(*(column.tolist() for column in columns), strict=True)
    return [Swing(ticks / rate, *row) for row in rows]


def decide(swing: Swing, *, last: bool) -> Finding:
    """Returns the finding; ``undecided`` asks for a longer time unless it is the ``last`` one.

    *steady*: the swing died, or dies and what is left of it no hand feels, or at the last look both swings still decay
    alike. *limit-cycle*: it forgets how hard it was pushed, yet remains, and is felt. *growing*: both swings grow. Of
    swings so slow that a piece covers less than one and a half nothing is said.
    """
    if not swing.inside:
        return Finding("undecided", "leaves the wall", swing.push_N, swing.watched_s)
    if swing.most_m < _REST_M:
        return swing.finding("steady", "rest")
    is_long, changes = swing.watched_s >= _LONG_S, [*zip(swing.changes, swing.errors, strict=True)]
    rising = any(change > max(_LASTING, 3 * error) for change, error in changes)
    falling = max(swing.changes) < -_LASTING and (swing.width_m < _SMALL_M or is_long)
    unfelt = not is_felt(swing.width_m, swing.frequency_Hz)
    # What is too slow for its frequency to be seen is judged by all of its way.
    seen = swing.frequency_Hz * swing.watched_s >= 4 * _LEAST_PERIODS or not is_felt(swing.moved_m, swing.frequency_Hz)
    if unfelt and seen and not rising and (falling or swing.width_m <= 2.0 * swing.count_m):
        return swing.finding("steady", "unfelt")
    if swing.covers_periods < _LEAST_PERIODS:
        return swing.finding("undecided", "too slow")
    if swing.lasts(_LASTING) and _SAME[0] < swing.at_last < _SAME[1] and not 0.5 < swing.at_first < 2.0:
        return swing.finding("limit-cycle", "forgets")
    kept_ratio = swing.at_first > 2.0 and _SAME[0] < swing.at_last / swing.at_first < _SAME[1]
    clearly = swing.watched_s >= _ALIKE_S and all(abs(change) + 2 * error < _LASTING_LONG for change, error in changes)
    counted = swing.frequency_Hz * swing.watched_s >= _COUNTED_PERIODS
    if (clearly or (is_long and counted and swing.lasts(_LASTING_LONG))) and not kept_ratio:
        return swing.finding("limit-cycle", "lasts")
    grows = all(change > 4 * error for change, error in changes)
    if grows and (is_long or (swing.watched_s >= _ALIKE_S and min(swing.changes) > _LASTING and swing.is_alike())):
        return swing.finding("growing", "grows")
    decays = last and all(change < -3 * error for change, error in changes) and swing.is_alike()
    if decays and swing.smooth and not is_felt(_COUNTS * swing.count_m, swing.frequency_Hz):
        return swing.finding("steady", "decays")
    return swing.finding("undecided", "too slow")
