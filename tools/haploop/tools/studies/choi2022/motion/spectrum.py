"""At which frequencies a device swings in the end."""

from __future__ import annotations

from typing import Any

import numpy as np

_LAST_S = 0.5


def spectrum(log: Any) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies in Hz and amplitudes in m of a run's position in its last half second, its trend taken out."""
    t, x = np.asarray(log["/plant"]["t"]), np.asarray(log["/plant"]["x"])
    last = t >= t[-1] - _LAST_S
    t, x = t[last], x[last]
    x = x - np.polyval(np.polyfit(t - t[0], x, 1), t - t[0])
    window = np.hanning(len(x))
    amplitudes = np.abs(np.fft.rfft(x * window)) / window.sum() * 2.0 * np.sqrt(2.0 / 3.0)
    return np.fft.rfftfreq(len(x), t[1] - t[0]), amplitudes


def strongest_Hz(log: Any) -> float:
    """The frequency of the largest swing."""
    frequencies, amplitudes = spectrum(log)
    return float(frequencies[np.argmax(amplitudes[1:]) + 1])


def faster_m(log: Any, frequency_Hz: float) -> float:
    """Root mean square of what of the position is faster than a frequency."""
    frequencies, amplitudes = spectrum(log)
    return float(np.sqrt((amplitudes[frequencies > frequency_Hz] ** 2).sum() / 2.0))
