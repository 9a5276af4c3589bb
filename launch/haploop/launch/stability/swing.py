"""Measures of a loop after both pushes: how wide it swings, how the swing changes, and how surely that is known."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from haploop.launch.stability.traces import frequency_Hz, level_widths, most_felt, sizes, smallest_felt_m, trend, widths
from haploop.launch.stability.turns import turns_of
from haploop.logger.verdict.ripple import RIPPLE_ABOVE_HZ, above, ripple

# Pieces in which the width of a swing is measured, and the fewest periods that a piece covers.
_PIECES, _FEW_PIECES = 24, 8
_LEAST_PERIODS = 2.0
# Effect of where in a period the pieces begin on the change of the logarithm of the width, times the eighth power of
# the periods that a piece covers (found with sines); the smallest and the largest effect.
_PHASE, _UNSURE = 6.0, (1e-4, 1.0)
# A swing this small is rounding: a thousand atoms would be wider.
REST_M = 1e-9
# A slow swing within this many counts of the encoder, or this wide, is not a motion that could cause a fast one.
_CREEP, _CREEP_M = 3.0, 20e-6
# A swing has settled once it is no larger than this share of its travel.
_SETTLED = 0.05
# Sizes whose ratio lies between these are the same; those of the pushes differ by a factor of ten.
SAME = (0.7, 1.43)
# Names of the copies after the smaller and the larger push, by number; -1 is none.
_NAMES = ("smaller", "larger", "")


class Pushed(NamedTuple):
    """Some loops after both pushes; arrays have the members on their first axis.

    Attributes:
        small, large: position at the ticks after the smaller and the larger push, shape (members, ticks), m.
        command: command at the ticks after the larger one, shape (members, ticks), N.
        push_N: the larger push, shape (members,).
        count_m: one count of the encoder, shape (members,); 0 without an encoder.
        inside: whether a tick in the last quarter of both was in contact, shape (members,).
        stays_inside: whether all ticks in the last half of both were in contact, shape (members,).
        smooth: whether the loop treats small swings like large ones, except for its encoder counts, shape (members,).
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
        push_N, count_m, inside, stays_inside, smooth: as in ``Pushed``.
        changes, errors: changes of the logarithm of the width over the second half, after the small and the large push,
            and their standard errors.
        rate_1_s, error_1_s: growth of the swing that changes less, and its standard error.
        width_m, most_m: mean and maximum of the widths in the last quarter of both.
        told_m, spread_m: mean and half range of the widths there, about level trends of two pieces: what is reported.
        moved_m: motion of either over the last half, peak to peak, including its trend.
        at_first, at_last: width after the larger push over that after the smaller, in the first piece and at the end.
        frequency_Hz: frequency at the end.
        ripple_N: swing of the command above 30 Hz after the larger push, peak to peak, in the last quarter.
        covers: whether a piece covers enough periods to show how the swing changes, or its turns show it.
        times_felt: how strong the last quarter of either is, as a multiple of the least that is felt.
        settles_s: time after the larger push from which on the swing stays within 5 % of its travel, or within what
            remains; 0 if it did not move.
        rests: which copy alone comes to rest while a hand feels the other's swing, ``larger`` or ``smaller``, after
            the push of that name; "" where they go alike. The measures are then the other's.
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
    told_m: float
    spread_m: float
    most_m: float
    moved_m: float
    at_first: float
    at_last: float
    frequency_Hz: float
    ripple_N: float
    covers: bool
    times_felt: float
    settles_s: float
    rests: str = ""

    def lasts(self, within: float) -> bool:
        """Tells whether both swings neither grow nor decay, as far as their scatter shows."""
        pairs = zip(self.changes, self.errors, strict=True)
        return all(abs(change) < max(within, 2 * error) and error < 0.1 for change, error in pairs)

    def is_alike(self) -> bool:
        """Tells whether swings of other sizes go like these: never off the wall, or the larger like the smaller one."""
        rate = abs(self.changes[1] - self.changes[0]) < 0.1 * abs(self.changes[1]) + 3 * math.hypot(*self.errors)
        kept_ratio = self.at_first > 2.0 and SAME[0] < self.at_last / self.at_first < SAME[1]
        return rate and (self.stays_inside or kept_ratio)


def measure(pushed: Pushed, rate: float) -> list[Swing]:
    """Returns the measures of each loop, computed as if it were alone.

    If only one of the two copies of a loop comes to rest and a hand feels the other's swing, the other is measured.
    Slow swings are measured in fewer, longer pieces, and those too slow for these from turn to turn. If a loop rests
    except for a slow swing that no hand feels and a fast one that a hand does feel, the fast one is measured.

    ``rate``: ticks a second.
    """
    ticks = pushed.large.shape[-1]
    pushed, rests_alone = _of_swinging(pushed, rate)
    frequency = frequency_Hz(pushed.large[:, ticks // 2 :], rate)
    last = np.stack([pushed.small, pushed.large])[..., -ticks // 4 :]
    of_copies, most_Hz = most_felt(last, rate)
    harder = of_copies.argmax(axis=0)[None]
    times_felt, fast_Hz = (np.take_along_axis(each, harder, axis=0)[0] for each in (of_copies, most_Hz))
    moved_m = np.ptp(last, axis=-1).max(axis=0)
    rests = (moved_m < 2.0 * smallest_felt_m(frequency)) & (moved_m < np.maximum(_CREEP * pushed.count_m, _CREEP_M))
    is_buried = (times_felt >= 1.0) & rests & (fast_Hz > RIPPLE_ABOVE_HZ)
    frequency = np.where(is_buried, fast_Hz, frequency)
    is_slow = ticks // _PIECES * frequency / rate < _LEAST_PERIODS
    found: dict[int, Swing] = {}
    for slow, buried in product((False, True), repeat=2):
        places = np.flatnonzero((is_slow == slow) & (is_buried == buried))
        if len(places):
            some = Pushed(*(part[places] for part in pushed))
            if buried:
                some = some._replace(small=above(some.small, rate), large=above(some.large, rate))
            rows = _measured(some, rate, frequency[places], times_felt[places], _FEW_PIECES if slow else _PIECES)
            found |= {place: Swing(ticks / rate, *row) for place, row in zip(places.tolist(), rows, strict=True)}
    swings = [_by_turns(found[i], pushed.small[i], pushed.large[i], rate) for i in range(len(frequency))]
    return [swing._replace(rests=_NAMES[copy]) for swing, copy in zip(swings, rests_alone.tolist(), strict=True)]


def _of_swinging(pushed: Pushed, rate: float) -> tuple[Pushed, np.ndarray]:
    """Returns the loops with a copy that alone comes to rest replaced by the other, and the number of that copy.

    The numbers, shape (members,), are 0 for the copy after the smaller push, 1 for that after the larger, -1 for none.
    """
    last = np.stack([pushed.small, pushed.large])[..., -(pushed.large.shape[-1] // 4) :]
    still = np.ptp(last, axis=-1) < REST_M
    apart = still[0] != still[1]
    if not apart.any():
        return pushed, np.full(still.shape[1], -1)
    apart &= most_felt(last, rate)[0].max(axis=0) >= 1.0
    small = np.where((apart & still[0])[:, None], pushed.large, pushed.small)
    large = np.where((apart & still[1])[:, None], pushed.small, pushed.large)
    return pushed._replace(small=small, large=large), np.where(apart, np.where(still[1], 1, 0), -1)


def _measured(
    pushed: Pushed, rate: float, frequency: np.ndarray, times_felt: np.ndarray, pieces: int
) -> Iterator[tuple[Any, ...]]:
    """Yields for each loop the fields of its ``Swing`` after the time."""
    small_x, large_x, command, *of_each = pushed
    ticks = large_x.shape[-1]
    size, last_half, last_quarter = ticks // pieces, slice(ticks // 2, None), slice(-ticks // 4, None)
    small, large = widths(small_x, size), widths(large_x, size)
    half, quarter = small.shape[-1] // 2, small.shape[-1] // 4
    covers = size * frequency / rate
    unsure = np.where(frequency > 0.0, np.clip(_PHASE / np.maximum(covers, 0.1) ** 8, *_UNSURE), 0.0)
    trends = [trend(sizes(x[:, -half * size :], size), size / rate, unsure) for x in (small_x, large_x)]
    small_trend, large_trend = trends
    slower = np.where(np.abs(large_trend.rate_1_s) < np.abs(small_trend.rate_1_s), large_trend[:2], small_trend[:2])
    tail = np.concatenate([small[:, -quarter:], large[:, -quarter:]], axis=1)
    told = np.concatenate([level_widths(x[:, -quarter * size :], 2 * size) for x in (small_x, large_x)], axis=1)
    ends = [width[:, -quarter:].mean(axis=1) for width in (small, large)]
    columns = [
        *of_each,
        np.stack([each.change for each in trends], axis=-1),
        np.stack([each.error for each in trends], axis=-1),
        *slower,
        tail.mean(axis=1),
        told.mean(axis=1),
        np.ptp(told, axis=1) / 2.0,
        tail.max(axis=1),
        np.maximum(*(np.ptp(x[:, last_half], axis=1) for x in (small_x, large_x))),
        large[:, 0] / np.maximum(small[:, 0], REST_M),
        ends[1] / np.maximum(ends[0], REST_M),
        frequency,
        ripple(command[:, last_quarter], rate),
        covers >= _LEAST_PERIODS,
        times_felt,
        _settling_s(large_x, rate),
    ]
    return zip(*(column.tolist() for column in columns), strict=True)


def _settling_s(x: np.ndarray, rate: float) -> np.ndarray:
    """Returns the times from which on x, shape (loops, ticks), stays within 5 % of its travel, or what remains."""
    quarter = x[:, -x.shape[1] // 4 :]
    apart = np.abs(x - quarter.mean(axis=1, keepdims=True))
    within = np.maximum(_SETTLED * apart.max(axis=1), np.maximum(np.ptp(quarter, axis=1), REST_M))
    outside = apart > within[:, None]
    return np.where(outside.any(axis=1), x.shape[1] - np.argmax(outside[:, ::-1], axis=1), 0) / rate


def _by_turns(swing: Swing, small_x: np.ndarray, large_x: np.ndarray, rate: float) -> Swing:
    """Returns a swing, measured by its turns if too slow for its pieces and if they suffice; x: shape (ticks,)."""
    if swing.covers or swing.most_m < REST_M:
        return swing
    small, large = turns_of(small_x, rate), turns_of(large_x, rate)
    if not (small and large):
        return swing
    # Turns of a faster motion beside the swing are not its own.
    if not all(SAME[0] < turns.frequency_Hz / swing.frequency_Hz < SAME[1] for turns in (small, large)):
        return swing
    slower = min(small, large, key=lambda turns: abs(turns.trend.rate_1_s))
    return swing._replace(
        changes=(float(small.trend.change), float(large.trend.change)),
        errors=(float(small.trend.error), float(large.trend.error)),
        rate_1_s=float(slower.trend.rate_1_s),
        error_1_s=float(slower.trend.error_1_s),
        width_m=(small.last_m + large.last_m) / 2.0,
        told_m=(small.last_m + large.last_m) / 2.0,
        spread_m=abs(large.last_m - small.last_m) / 2.0,
        at_first=large.first_m / small.first_m,
        at_last=large.last_m / small.last_m,
        frequency_Hz=large.frequency_Hz,
        covers=True,
    )
