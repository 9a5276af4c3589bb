"""Lines in the spectrum of a window: swings that are felt, and overtones of a slower motion."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from haploop.launch.stability.traces import is_felt
from haploop.logger.verdict.spectrum import Line, line_at, lobe, main_line
from haploop.tools.dissipate.recording.samples import Floats
from haploop.tools.dissipate.swing.buzz import FAST, Band

# Most swings at once; least share of the variance of each, and least distance of peaks, in lines.
_MOST, _OF_EACH, _APART = 3, 0.1, 2
# The staircase of an encoder swings by less than a count, here the step that nine of ten exceed; a swing within this
# many counts may be one.
COUNTS, _SMALLEST = 2, 10.0
# Share of the variance that rounding leaves to a swing within the counts; the staircase of a steady motion has 0.61 of
# its own in its first line.
_ROUNDED = 0.68
# A slower periodic motion whose velocity jumps, as at a wall, has overtones at multiples k of its frequency that are no
# wider than this over k^2 of its width. They lie within this many Hz of the multiple; those of motions slower than this
# are too close together.
_OVERTONE, _APART_HZ, _CLOSE_HZ = 3.5, 0.3, 2.5
# Where it moves in steps, its overtones are no wider than this over k of its width.
_JUMPS = 1.5
# A swing beside a drift with fewer periods in a window than this, which the drift bends as well, has no frequency.
_FEWEST_PERIODS = 2.5
# The fit of a sine beside a drift is done when its frequency moves by less than this share of what a window resolves.
_STILL, _STEPS = 1e-3, 12
# In a window in which the frequency changes, or that several lines share, overtones lie within this of the multiple.
BLURRED_HZ = 0.3 * FAST.resolved_Hz
# Frequencies of a window, Hz, and amplitudes, m, 0 to peak.
Spectrum = tuple[Floats, Floats]


def swing(x_m: Floats, rate_Hz: float, band: Band = FAST) -> Line | None:
    """Returns the swing of a window if its frequency is in the band and it is felt; else None."""
    if len(x_m) <= 3 * band.drift:
        return None
    drift = _drift(len(x_m), band.drift)
    line = main_line(x_m - drift @ (drift.T @ x_m), rate_Hz, band.above_Hz)
    if line is None or line.share < (min(band.share, _ROUNDED) if within_counts(line, x_m) else band.share):
        return None
    line = _beside_drift(line, x_m, rate_Hz, band) if band.drift > 1 else line
    if line is None or line.frequency_Hz >= band.below_Hz:
        return None
    return line if is_felt(line.width, line.frequency_Hz) else None


def within_counts(line: Line, x_m: Floats) -> float:
    """Returns the count of the positions, m, if the staircase of an encoder may swing as wide as a line; else 0."""
    return 0.0 if line.width > (counts_m := _counts_m(x_m)) else counts_m / COUNTS


def _beside_drift(line: Line, x_m: Floats, rate_Hz: float, band: Band) -> Line | None:
    """Returns the line with frequency and width of a sine fitted together with a drift; None without such a fit.

    A drift that is taken out beforehand takes part of a slow sine with it: 7 % of the width of one with three periods
    in a window, for a drift of degree 5. The frequency is found by Newton's method (IEEE 1057, four-parameter fit),
    under a Hann window.
    """
    count = len(x_m)
    t, weight = np.linspace(-1.0, 1.0, count), _hann(count)
    drift, periods = _drift(count, band.drift, under_hann=True), line.frequency_Hz * count / rate_Hz

    def rest(column: Floats) -> Floats:
        """Returns the rest of a column under the window once its drift is taken out."""
        weighted = weight * column
        return weighted - drift @ (drift.T @ weighted)

    def sines(periods: float) -> list[Floats]:
        return [np.cos(np.pi * periods * t), np.sin(np.pi * periods * t)]

    rest_m = rest(x_m)
    fit = _least_squares([rest(each) for each in sines(periods)], rest_m)
    for _ in range(_STEPS):
        cosine, sine = sines(periods)
        slope = np.pi * t * (fit[1] * cosine - fit[0] * sine)
        fit = _least_squares([rest(cosine), rest(sine), rest(slope)], rest_m)
        step = float(fit[2])
        if abs(step) < _STILL:
            return Line(periods * rate_Hz / count, 2.0 * float(np.hypot(fit[0], fit[1])), line.share)
        periods += min(max(step, -0.5), 0.5)
        if periods < _FEWEST_PERIODS:
            return None
    return None


@lru_cache(maxsize=8)
def _drift(count: int, degree: int, under_hann: bool = False) -> Floats:
    """Returns orthonormal columns, shape (count, degree + 1), that span the polynomials of a degree."""
    columns = np.vander(np.linspace(-1.0, 1.0, count), degree + 1)
    return np.linalg.qr(columns * _hann(count)[:, None] if under_hann else columns)[0]


def _hann(count: int) -> Floats:
    """Returns weights whose squares are a Hann window."""
    return np.sin(np.pi * (np.arange(count) + 0.5) / count)


def _least_squares(columns: list[Floats], x_m: Floats) -> Floats:
    """Returns the coefficients of columns by normal equations: two sines and the slope of one are far from alike."""
    rows = np.array(columns)
    return np.asarray(np.linalg.lstsq(rows @ rows.T, rows @ x_m, rcond=None)[0], np.float64)


def _counts_m(x_m: Floats) -> float:
    """Returns how wide the staircase of an encoder may swing, m."""
    steps = np.abs(np.diff(x_m))
    return COUNTS * float(np.percentile(steps[steps > 0.0], _SMALLEST)) if steps.any() else 0.0


def fast_rms_m(spectrum: Spectrum) -> float:
    """Returns the root mean square of the motion faster than a hand's, under the Hann window of the spectrum."""
    at, height = spectrum
    # A line of height h has a variance of h^2 / 2, and that window spreads it over lines with 1.5 times as much; a
    # slower motion reaches two lines further.
    return float(np.sqrt((height[at > FAST.above_Hz + 2.0 * FAST.resolved_Hz] ** 2).sum() / 3.0))


def swings(x_m: Floats, spectrum: Spectrum) -> tuple[Line, ...]:
    """Returns the swings of a window at several frequencies at once, from slow to fast; empty where there are none.

    All are faster than a hand's, wider than the counts, and felt.
    """
    at, height = spectrum
    power = np.where(at > FAST.above_Hz, height**2, 0.0)
    if not (whole := float(power.sum())):
        return ()
    peaks = 1 + np.flatnonzero((height[1:-1] > height[:-2]) & (height[1:-1] >= height[2:]) & (power[1:-1] > 0.0))
    chosen, together = list[int](), np.zeros(len(power), bool)
    for peak in peaks[np.argsort(-height[peaks])].tolist():
        if len(chosen) < _MOST and all(abs(peak - other) >= _APART for other in chosen):
            chosen.append(peak)
    lines = [line_at(at, height, peak, float(power[lobe(peak)].sum()) / whole) for peak in sorted(chosen)]
    told = [line for line in lines if line.share >= _OF_EACH]
    for peak in (peak for peak, line in zip(sorted(chosen), lines, strict=True) if line in told):
        together[lobe(peak)] = True
    if len(told) < 2 or float(power[together].sum()) < FAST.share * whole:
        return ()
    counts_m = _counts_m(x_m)
    return tuple(told) if all(is_felt(each.width, each.frequency_Hz) and each.width > counts_m for each in told) else ()


class Slower(NamedTuple):
    """A slower motion at one frequency, which may differ by ``spread_Hz`` from window to window."""

    line: Line
    spread_Hz: float = 0.0


def is_overtone(
    frequency_Hz: float, width_m: float, of: Slower, apart_Hz: float = _APART_HZ, of_jumps: bool = False
) -> bool:
    """Tells whether a line of this frequency and width in m may be an overtone of a slower one.

    ``of_jumps``: also of a motion whose position itself seems to jump, unless it is so slow that steps stand apart.
    """
    slower, spread_Hz = of
    order = frequency_Hz / slower.frequency_Hz
    if slower.frequency_Hz < _CLOSE_HZ:
        return width_m < _OVERTONE / order**2 * slower.width
    is_multiple = order > 1.5 and abs(order - round(order)) * slower.frequency_Hz < apart_Hz + order * spread_Hz
    return is_multiple and width_m < (_JUMPS / order if of_jumps else _OVERTONE / order**2) * slower.width


def overtone_of(line: Line, x_m: Floats, rate_Hz: float, band: Band) -> Line | None:
    """Returns the line of a window, slower than the band, of which ``line`` may be an overtone; None without one."""
    slower = main_line(x_m, rate_Hz)
    if not slower or slower.frequency_Hz >= band.above_Hz:
        return None
    return slower if is_overtone(line.frequency_Hz, line.width, Slower(slower), BLURRED_HZ) else None
