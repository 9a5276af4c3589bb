"""The gate of eq. 9 at one frequency: the mass and the damping that the device feels of a virtual inertia, and the
figure of them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from haploop.tools.figure.style import ELEMENTS, GREY, dress, empty_figure, legend
from haploop.tools.studies.choi2022.drawing import COLOURS, legend_of_colours
from haploop.tools.studies.choi2022.experiment.setup import UNITS, VELOCITIES, Setup

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FREQUENCIES_HZ = np.linspace(2.0, 498.0, 249)
# Age of a reading of an MPU-9250 at its setting of 420 Hz.
OLD_S = 1.38e-3
DELAYS_S = np.linspace(0.0, 3e-3, 121)
_DAMPS = {
    "both drive": "#F0F0F0",
    "bidirectional damps, unidirectional drives": COLOURS["bidirectional-inertia"],
    "unidirectional damps, bidirectional drives": COLOURS["unidirectional-inertia"],
    "both damp": "#DDEBF5",
}


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
    """Returns what f = -m a comes to, late by the age of the reading, the extra delay and half a period of the hold.

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
    """Returns the describing function of f = -m a[k] while v[k] a[k-1] >= 0 (Choi et al. 2022, eq. 9).

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
    """Returns the age of a signal behind a first-order low-pass, atan(f / cutoff) / w more than before."""
    f = np.asarray(frequency_Hz, float)
    return age_s + (np.arctan(f / cutoff_Hz) / (2.0 * np.pi * f) if cutoff_Hz else np.zeros_like(f))


def always_open_Hz(*, reading_s: float, velocity_s: float = 5e-4, period_s: float = 1e-3) -> float:
    """Returns the lowest frequency at which the gate never closes, Hz: w (T + reading - velocity) = pi / 2."""
    return 0.25 / (period_s + reading_s - velocity_s)


def damps(reading_s: float) -> np.ndarray:
    """Returns which inertia damps, an index from 0 to 3 to the colours, shape (delays, frequencies)."""
    delay, frequency = np.meshgrid(DELAYS_S, FREQUENCIES_HZ, indexing="ij")
    two = bidirectional(frequency, reading_s=reading_s, delay_s=delay).damping > 0.0
    one = unidirectional(frequency, reading_s=reading_s, delay_s=delay).damping > 0.0
    return two + 2 * one


def felt_with(setup: Setup, frequency_Hz: np.ndarray) -> tuple[Felt, Felt]:
    """Returns what bi- and unidirectional inertia come to with a setup's delay, unit and low-pass of the velocity."""
    bandwidth, late = UNITS[setup.unit]
    reading_s = late + (1.0 / (2.0 * np.pi * bandwidth) if bandwidth else 0.0)
    velocity_s = low_passed_s(frequency_Hz, VELOCITIES[setup.velocity], 5e-4)
    two = bidirectional(frequency_Hz, reading_s=reading_s, delay_s=setup.delay_s)
    return two, unidirectional(frequency_Hz, reading_s=reading_s, delay_s=setup.delay_s, velocity_s=velocity_s)


def gate_figure(setup: Setup) -> Figure:
    """Draws felt damping and mass over frequency with a setup, and who damps over frequency and delay."""
    figure = empty_figure(13.0, 7.0)
    axes = figure.subplots(2, 2)
    two, one = felt_with(setup, FREQUENCIES_HZ)
    damping, mass = axes[0]
    for ax, name, label in ((damping, "damping", "felt damping / (m w)"), (mass, "mass", "felt mass / m")):
        ax.plot(FREQUENCIES_HZ, getattr(two, name), color=COLOURS["bidirectional-inertia"], label="bidirectional")
        ax.plot(FREQUENCIES_HZ, getattr(one, name), color=COLOURS["unidirectional-inertia"], label="unidirectional")
        ax.axhline(0.0, color=GREY, linewidth=0.6)
        dress(ax, f"felt {name}", "frequency (Hz)", label)
    mass.plot(FREQUENCIES_HZ, one.duty, ":", color=ELEMENTS[3], linewidth=0.9, label="gate open, share")
    legend(damping)
    legend(mass)
    _who(axes[1, 0], 0.0, "who damps: an ideal accelerometer")
    _who(axes[1, 1], OLD_S, f"who damps: a reading {1e3 * OLD_S:.2f} ms old")
    legend_of_colours(figure, _DAMPS)
    return figure


def _who(ax: Axes, reading_s: float, heading: str) -> None:
    from matplotlib.colors import ListedColormap

    reach = (FREQUENCIES_HZ[0], FREQUENCIES_HZ[-1], 0.0, 1e3 * DELAYS_S[-1])
    colours = {"cmap": ListedColormap(list(_DAMPS.values())), "vmin": -0.5, "vmax": 3.5, "interpolation": "nearest"}
    ax.imshow(damps(reading_s), origin="lower", aspect="auto", extent=reach, **colours)
    dress(ax, heading, "frequency (Hz)", "extra delay (ms)")
    ax.grid(visible=False)
