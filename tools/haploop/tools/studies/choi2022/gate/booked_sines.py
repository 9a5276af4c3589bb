"""What the sampled books make of one frequency: inertia against damping, whatever the age of the acceleration."""

from __future__ import annotations

import numpy as np

from haploop.tools.studies.choi2022.motion.prescribed import PERIOD_S

_TICKS, _PHASES = 400, 16


def damper_J(frequency_Hz: np.ndarray) -> np.ndarray:
    """Mean energy a sample of 1 N s/m under a sine of 1 m: (2 / T) sin^2(theta / 2) cos(theta) (eq. 4)."""
    theta = 2.0 * np.pi * frequency_Hz * PERIOD_S
    return 2.0 / PERIOD_S * np.sin(theta / 2.0) ** 2 * np.cos(theta)


def bidirectional_J(frequency_Hz: np.ndarray, age_s: float | None) -> np.ndarray:
    """The same of 1 kg whose acceleration is read ``age_s`` late: |a| sin(theta / 2) sin(w (age + T / 2)), |a| = w^2.

    f[k-1] = -|a| sin(w (t[k] - T - age)) times x[k] - x[k-1], which goes as cos(w (t[k] - T / 2)). The older the
    reading, the more it takes: all of what is moved at a quarter of a swing.

    Args:
        age_s: None for a difference of differences: T old, and |a| = (2 / T)^2 sin^2(theta / 2).
    """
    w, size, age = _reading(frequency_Hz, age_s)
    return size * np.sin(w * PERIOD_S / 2.0) * np.sin(w * (age + PERIOD_S / 2.0))


def unidirectional_J(frequency_Hz: np.ndarray, age_s: float | None) -> np.ndarray:
    """The same with the gate of eq. 9: a mean over samples and over where in its swing the sine begins."""
    w, size, age = _reading(frequency_Hz, age_s)
    t = np.arange(_TICKS)[:, None, None] * PERIOD_S
    phase = 2.0 * np.pi * np.arange(_PHASES)[:, None] / _PHASES
    moved = np.diff(np.sin(w * t + phase), axis=0, prepend=np.nan)
    a = -size * np.sin(w * (t - age) + phase)
    force = np.where(moved[1:] * a[:-1] >= 0.0, a[1:], 0.0)
    return (force[:-1] * moved[2:]).mean(axis=(0, 1))


def _reading(frequency_Hz: np.ndarray, age_s: float | None) -> tuple[np.ndarray, np.ndarray, float]:
    """w, the amplitude of the reading, and its age."""
    w = 2.0 * np.pi * np.asarray(frequency_Hz, float)
    if age_s is None:
        return w, (2.0 / PERIOD_S * np.sin(w * PERIOD_S / 2.0)) ** 2, PERIOD_S
    return w, w**2, age_s
