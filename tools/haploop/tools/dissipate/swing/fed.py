"""Mean power that a recorded force gives to a swing, from the lines of their spectra."""

from __future__ import annotations

import numpy as np

from haploop.logger.verdict.about_trend import about_trend
from haploop.tools.dissipate.recording.samples import Floats

# A force counts as giving to the swing, or taking from it, if it does so by this share of the most that it could.
LEAST_FED = 0.01
# A swing has its own frequency and the overtones that shape it; higher overtones hold less than the noise of all lines.
_ORDERS = range(1, 6)
# Lines this near another, in lines, are part of it under a Hann window.
_NEAR = 2.5


def fed_W(x_m: Floats, force_N: Floats, rate_Hz: float, frequency_Hz: float, delay_s: float) -> tuple[float, float]:
    """Returns the mean power that a force gives to a swing, and the most that it could, were it in phase with velocity.

    Each force is held for a period T from its delay d on: it gives F[k] (x(t[k] + d + T) - x(t[k] + d)), of which the
    mean is Re(conj(F) X exp(i w d) (exp(i w T) - 1)) / T, summed over the lines of the swing and of its first
    overtones: an overtone of a tenth of its width gets as much as 4 % from a delayed spring. A slower press does not
    contribute, nor does the energy that it stores, nor the rounding of the positions beyond its share in these lines.
    """
    count, window = len(x_m), np.hanning(len(x_m) + 1)[:-1]
    at_Hz = np.fft.rfftfreq(count, 1.0 / rate_Hz)
    x, force = (np.fft.rfft(window * about_trend(u)) for u in (x_m, force_N))
    given, most = 0.0, 0.0
    for order_Hz in (order * frequency_Hz for order in _ORDERS):
        near, turn = np.abs(at_Hz - order_Hz) < _NEAR * rate_Hz / count, 2j * np.pi * order_Hz
        way = x[near] * np.exp(turn * delay_s) * (np.exp(turn / rate_Hz) - 1.0)
        work = force[near].conj() * way
        given, most = given + float(work.real.sum()), most + float(np.abs(work).sum())
    scale = 2.0 * rate_Hz / (count * float((window**2).sum()))
    return scale * given, scale * most
