"""Samples that repeat the one before at even intervals, as where a sensor is read faster than it measures."""

from __future__ import annotations

import numpy as np

from haploop.tools.dissipate.recording.samples import Floats

# Least steps before and after a pause, in counts, in the same direction: a device this fast does not stand still except
# where it turns.
_MOVING_COUNTS = 3.0
# Pauses are looked for in blocks of this many samples, and are no longer than this many.
_BLOCK, _LONGEST = 4096, 50
# Pauses come at even intervals, to a sample, where their spectrum has a line of at least this share of the least height
# that such pauses give; a line whose square is this many times their number is found in one of a thousand blocks of
# pauses that come by chance.
_EVEN, _BEYOND_CHANCE = 0.9, 15.0
# Each block is padded with zeros to this many times its length, so that a line between two places is no lower.
_PADDED = 4


def repeats(x: Floats) -> int:
    """Returns how many positions repeat the one before in mid-motion; ``x`` has shape (samples,) and no gap.

    Only blocks in which the pauses come at even intervals count, as those of a sensor with its own rate do; pauses by
    chance, as where noise is rounded, come at any interval.
    """
    return sum(_repeats(x[at : at + _BLOCK]) for at in range(0, len(x), _BLOCK))


def _repeats(x: Floats) -> int:
    step = np.diff(x)
    moves = np.flatnonzero(step)
    if len(moves) < 2:
        return 0
    fast = np.abs(step[moves]) >= _MOVING_COUNTS * np.abs(step[moves]).min()
    lengths = np.diff(moves) - 1
    goes_on = fast[:-1] & fast[1:] & (step[moves[:-1]] * step[moves[1:]] > 0.0)
    paused = goes_on & (lengths > 0) & (lengths <= _LONGEST)
    if not paused.any():
        return 0
    begins = np.zeros(_BLOCK)
    begins[moves[:-1][paused]] = 1.0
    count = int(paused.sum())
    line = np.abs(np.fft.rfft(begins, _PADDED * _BLOCK))
    at = _PADDED * _BLOCK // _LONGEST + int(np.argmax(line[_PADDED * _BLOCK // _LONGEST :]))
    # Each is up to a sample late.
    is_even = line[at] >= _EVEN * count * np.sinc(at / (_PADDED * _BLOCK)) and line[at] ** 2 > _BEYOND_CHANCE * count
    return int(lengths[paused].sum()) if is_even else 0
