"""What a virtual inertia comes to at one frequency: how much mass and how much damping the device feels of it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Felt(NamedTuple):
    """The fundamental of the force of a virtual inertia m on a device that swings at w, over what a mass m would take.

    Attributes:
        duty: share of the ticks at which the gate is open.
        mass: felt mass over m.
        damping: felt damping over m w; the element takes energy out where it is positive.
    """

    duty: np.ndarray
    mass: np.ndarray
    damping: np.ndarray


def bidirectional(
    frequency_Hz: np.ndarray, *, reading_s: float, delay_s: float | np.ndarray, period_s: float = 1e-3
) -> Felt:
    """f = -m a as it arrives: the reading's age, the loop's extra delay and half a period of the hold late.

    By psi = w (reading + delay + T / 2) it lags, so that the device feels m cos(psi) and the damping m w sin(psi): late
    inertia damps, most at a quarter of a period, and drives from half a period on.
    """
    w = 2.0 * np.pi * np.asarray(frequency_Hz, float)
    return _felt(np.ones_like(w), np.ones_like(w, complex), w * (reading_s + delay_s + period_s / 2.0))


def unidirectional(
    frequency_Hz: np.ndarray,
    *,
    reading_s: float,
    delay_s: float | np.ndarray,
    velocity_s: float | np.ndarray = 5e-4,
    period_s: float = 1e-3,
) -> Felt:
    """f = -m a[k] while v[k] a[k-1] >= 0 (Choi et al. 2022, eq. 9): its describing function.

    Against the reading a[k], the velocity (a difference, T / 2 old) lags by p = pi/2 + w (velocity - reading), a[k-1]
    by q = w T. With d = p - q folded into [0, pi] the gate is open around (p + q) / 2 for the share 1 - d / pi, and
        N = (2 h + e^(-j (p + q)) sin 2 h) / pi,    2 h = pi - d,
    is what is left of the reading's fundamental, which then lags as that of a bidirectional inertia. Without any lag
    d = pi/2 and N = 1/2 - j/pi: half the mass, and a damping of m w / pi. Where w (T/2 + reading) nears pi/2, v and
    a[k-1] swing together and the gate never closes: there it is a bidirectional inertia. Beyond, it opens while
    the motion slows. The phase of the ticks is averaged over: no frequency is locked to the rate.

    Args:
        reading_s: age of the acceleration's reading.
        delay_s: extra delay of the loop.
        velocity_s: age of the velocity; of one that is low-passed by frequency, ``low_passed_s``.
    """
    w = 2.0 * np.pi * np.asarray(frequency_Hz, float)
    p, q = np.pi / 2.0 + w * (velocity_s - reading_s), w * period_s
    open_rad = np.pi - np.arccos(np.cos(p - q))
    left = (open_rad + np.exp(-1j * (p + q)) * np.sin(open_rad)) / np.pi
    return _felt(open_rad / np.pi, left, w * (reading_s + delay_s + period_s / 2.0))


def _felt(duty: np.ndarray, left: np.ndarray, lag: np.ndarray) -> Felt:
    arrives = left * np.exp(-1j * lag)
    return Felt(duty, np.real(arrives), -np.imag(arrives))


def low_passed_s(frequency_Hz: np.ndarray, cutoff_Hz: float | None, age_s: float) -> np.ndarray:
    """The age of what a first-order low-pass makes of a signal of this age: by atan(f / cutoff) / w more."""
    f = np.asarray(frequency_Hz, float)
    return age_s + (np.arctan(f / cutoff_Hz) / (2.0 * np.pi * f) if cutoff_Hz else np.zeros_like(f))


def always_open_Hz(*, reading_s: float, velocity_s: float = 5e-4, period_s: float = 1e-3) -> float:
    """The lowest frequency at which the gate never closes, Hz: w (T + reading - velocity) = pi / 2."""
    return 0.25 / (period_s + reading_s - velocity_s)
