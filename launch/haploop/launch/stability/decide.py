"""The verdict on a loop, from how its swing develops after two pushes of different size."""

from __future__ import annotations

import math
from dataclasses import replace

from haploop.launch.stability.finding import STILL_1_S, Finding
from haploop.launch.stability.swing import REST_M, SAME, Swing
from haploop.launch.stability.traces import is_felt, smallest_felt_m

# A dying swing is watched until it is this small, or for long.
_SMALL_M = 20e-6
# The most that the logarithm of the width may change over the second half for a swing that is said to last.
_LASTING, _LASTING_LONG = 0.05, 0.02
# A swing that changes by more than this, and surely, is still developing.
_SETTLED = 0.002
# After this time, and this many periods, a slow change counts as none, and a steady growth as growth.
_LONG_S = 8.0
_COUNTED_PERIODS = 60.0
# A decay slower than this, in 1/s, would hardly be seen, and a slightly different loop might not decay.
_DIES_1_S = 0.01
# After this time, swings of both sizes that grow alike grow for good, and a swing known not to change lasts.
_ALIKE_S = 4.0
# A frequency is known from this many periods on.
_SEEN_PERIODS = 6.0
# This many periods show how a swing changes, wherever its turns fall.
_TELLING_PERIODS = 7.0
# A command that ripples by less is constant except for rounding.
_STILL_N = 1e-9
# Behind an encoder a decaying swing may end as a chatter of at most this many counts, peak to peak.
_COUNTS = 10


def decide(swing: Swing, *, last: bool) -> Finding:
    """Returns the finding, see ``_decided``; *undecided* if it rests after one push and swings on after the other."""
    found = _decided(swing, last=last)
    if swing.rests and found.word in ("limit-cycle", "growing"):
        return replace(found, word="undecided", why=f"{swing.rests} rests")
    return found


def _decided(swing: Swing, *, last: bool) -> Finding:
    """Returns the finding on copies alike; ``undecided`` asks for a longer time unless this is the ``last`` look.

    *steady*: the swing has died; or it dies or lasts, and no hand feels what is left of it; or at the last look both
    swings still decay alike, to a third within 100 s. *limit-cycle*: the swing forgets how hard it was pushed, yet
    remains, or it lasts, felt or not. *growing*: both swings grow. Nothing is said about swings of fewer than six
    periods.
    """
    if not swing.inside:
        why = "rests off the wall" if swing.moved_m < REST_M else "leaves the wall"
        return Finding("undecided", why, swing.push_N, swing.watched_s)
    if swing.most_m < REST_M and swing.moved_m < _SMALL_M:
        return _finding(swing, "steady", "rest" if swing.settles_s else "unmoved")
    is_long, changes = swing.watched_s >= _LONG_S, [*zip(swing.changes, swing.errors, strict=True)]
    # If a swing is too slow for its pieces, its whole travel counts, since they show only a part of it.
    size_m = swing.width_m if swing.covers else swing.moved_m
    # In half of a short watch even a quickly growing swing changes little.
    least = min(_LASTING, STILL_1_S * swing.watched_s / 2.0)
    rising = any(change > max(least, 3 * error) for change, error in changes)
    falling = max(swing.changes) < -_LASTING and (size_m < _SMALL_M or (is_long and swing.covers))
    forgets = swing.lasts(_LASTING) and SAME[0] < swing.at_last < SAME[1] and not 0.5 < swing.at_first < 2.0
    unfelt = swing.times_felt < 1.0 and not is_felt(swing.width_m, swing.frequency_Hz)
    seen = swing.frequency_Hz * swing.watched_s >= _SEEN_PERIODS or not is_felt(swing.moved_m, swing.frequency_Hz)
    goes_on = not (falling or size_m <= 2.0 * swing.count_m or (forgets and swing.covers))
    # A swing that dies behind an encoder whose counts still move may leave a chatter of counts that is felt.
    settles = falling and swing.count_m > 0.0 and swing.ripple_N > _STILL_N and not is_long
    if unfelt and seen and not (rising or goes_on or settles):
        ends = ("rest", "unfelt") if swing.settles_s else ("unmoved", "unfelt throughout")
        return _finding(swing, "steady", ends[swing.width_m >= REST_M])
    if not swing.covers:
        found = _finding(swing, "undecided", "too few")
        return replace(found, width_m=swing.moved_m, frequency_Hz=0.0, rate_1_s=None, error_1_s=None)
    if forgets:
        return _finding(swing, "limit-cycle", "forgets")
    kept_ratio = swing.at_first > 2.0 and SAME[0] < swing.at_last / swing.at_first < SAME[1]
    clearly = swing.watched_s >= _ALIKE_S and all(abs(change) + 2 * error < _LASTING_LONG for change, error in changes)
    counted = swing.frequency_Hz * swing.watched_s >= _COUNTED_PERIODS
    settled = all(abs(change) <= max(3 * error, _SETTLED) for change, error in changes)
    if settled and (clearly or (is_long and counted and swing.lasts(_LASTING_LONG))) and not kept_ratio:
        return _finding(swing, "limit-cycle", "lasts")
    # A chatter within the counts of an encoder grows, but not for good.
    grows = all(change > 4 * error for change, error in changes) and (last or swing.width_m > 2.0 * swing.count_m)
    soon = swing.watched_s >= _ALIKE_S and min(swing.changes) > _LASTING and swing.is_alike()
    if grows and (soon or (is_long and (min(swing.changes) > _LASTING_LONG or swing.is_alike()))):
        return _finding(swing, "growing", "grows")
    dies = -_DIES_1_S * swing.watched_s / 2.0
    decays = last and all(change < min(dies, -3 * error) for change, error in changes) and swing.is_alike()
    if decays and swing.smooth and not is_felt(_COUNTS * swing.count_m, swing.frequency_Hz):
        return _finding(swing, "steady", "decays")
    return _finding(swing, "undecided", "too slow")


def _finding(swing: Swing, word: str, why: str) -> Finding:
    felt_m = 2.0 * float(smallest_felt_m(swing.frequency_Hz))
    pairs = [*zip(swing.changes, swing.errors, strict=True)]
    most_1_s = max(abs(change) + 2.0 * error for change, error in pairs) / (swing.watched_s / 2.0)
    needs_s = None
    if word == "undecided":
        change, error = min(pairs, key=lambda each: abs(each[0]))
        needs_s = _TELLING_PERIODS / swing.frequency_Hz if swing.frequency_Hz else 0.0
        needs_s = max(needs_s, swing.watched_s * max(2.0, 4.0 * error / max(abs(change), 1e-12)))
        if swing.rate_1_s < 0.0:
            needs_s = max(needs_s, swing.watched_s + math.log(max(swing.width_m / felt_m, 1.0)) / -swing.rate_1_s)
    # What is left of a swing that came to rest is rounding, which has no frequency.
    frequency_Hz, ripple_N = (0.0, 0.0) if swing.width_m < REST_M else (swing.frequency_Hz, swing.ripple_N)
    times_felt = max(swing.times_felt, swing.width_m / felt_m)
    return Finding(
        word, why, swing.push_N, swing.watched_s, swing.rate_1_s, swing.error_1_s, frequency_Hz, swing.told_m,
        swing.spread_m, ripple_N, times_felt >= 1.0, None, needs_s, most_1_s,
        times_felt=None if swing.width_m < REST_M or not math.isfinite(times_felt) else times_felt,
        settles_s=swing.settles_s if why in ("rest", "unfelt") else None,
    )  # fmt: skip
