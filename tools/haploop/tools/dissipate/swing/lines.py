"""Lines in the spectrum of a window: a swing that is felt, or an overtone of a slower motion."""

from __future__ import annotations

import numpy as np

from haploop.launch.stability.traces import is_felt
from haploop.tools.dissipate.recording.samples import Floats
from haploop.tools.dissipate.swing.buzz import ABOVE_HZ
from haploop.view.look.spectrum import Line, main_line

# A swing at one frequency has so much of the variance of all that is faster than ``ABOVE_HZ``.
_SHARE = 0.8
# The staircase of an encoder swings by less than a count, here the step that nine of ten exceed.
_COUNTS, _SMALLEST = 2.0, 10.0
# Where its velocity jumps, as at a wall, a slower periodic motion has overtones, at multiples k of its frequency, of no
# more than this over k^2 of its width. They meet the multiple to so many Hz; of the slowest they are too close.
_OVERTONE, _APART_HZ, _CLOSE_HZ = 3.5, 0.3, 2.5


def swing(x_m: Floats, rate_Hz: float) -> Line | None:
    """Returns the swing of a window that is faster than a hand's, wider than the counts are, and felt."""
    line = main_line(x_m, rate_Hz, ABOVE_HZ)
    steps = np.abs(np.diff(x_m))
    if line is None or line.share < _SHARE or not is_felt(line.width, line.frequency_Hz):
        return None
    return line if line.width > _COUNTS * np.percentile(steps[steps > 0.0], _SMALLEST) else None


def is_overtone(frequency_Hz: float, width_m: float, of: Line, apart_Hz: float = _APART_HZ) -> bool:
    """Tells whether a line of this frequency and width in m may be an overtone of a slower one."""
    order = frequency_Hz / of.frequency_Hz
    is_multiple = abs(order - round(order)) * of.frequency_Hz < apart_Hz or of.frequency_Hz < _CLOSE_HZ
    return is_multiple and width_m < _OVERTONE / order**2 * of.width


def overtone_of(line: Line, x_m: Floats, rate_Hz: float, apart_Hz: float) -> Line | None:
    """Returns the slower line of a window of which another may be an overtone; None where there is none.

    ``apart_Hz`` is how far from a multiple it may be, as where the frequency changes within the window.
    """
    slower = main_line(x_m, rate_Hz)
    if not slower or slower.frequency_Hz >= ABOVE_HZ:
        return None
    return slower if is_overtone(line.frequency_Hz, line.width, slower, apart_Hz) else None
