"""Where the gate of eq. 9 helps and where it hurts: the describing functions drawn."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from haploop.tools.figure.style import ELEMENTS, GREY, dress, empty_figure, legend
from haploop.tools.studies.choi2022.colours import COLOURS
from haploop.tools.studies.choi2022.experiment.setup import UNITS, VELOCITIES, Setup
from haploop.tools.studies.choi2022.gate.gate import Felt, bidirectional, low_passed_s, unidirectional

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FREQUENCIES_HZ = np.linspace(2.0, 498.0, 249)
# Age of a reading of an MPU-9250 at its setting of 420 Hz.
OLD_S = 1.38e-3
DELAYS_S = np.linspace(0.0, 3e-3, 121)
# What damps where: neither, bidirectional alone, unidirectional alone, both.
_COLOURS = ("#F0F0F0", COLOURS["bidirectional-inertia"], COLOURS["unidirectional-inertia"], "#DDEBF5")
_NAMES = (
    "both drive",
    "bidirectional damps, unidirectional drives",
    "unidirectional damps, bidirectional drives",
    "both damp",
)


def damps(reading_s: float) -> np.ndarray:
    """0 to 3, an index to what damps, shape (delays, frequencies)."""
    delay, frequency = np.meshgrid(DELAYS_S, FREQUENCIES_HZ, indexing="ij")
    two = bidirectional(frequency, reading_s=reading_s, delay_s=delay).damping > 0.0
    one = unidirectional(frequency, reading_s=reading_s, delay_s=delay).damping > 0.0
    return two + 2 * one


def felt(setup: Setup, frequency_Hz: np.ndarray) -> tuple[Felt, Felt]:
    """What bi- and unidirectional inertia come to in a reading, with its delay, unit and low-pass of the velocity."""
    bandwidth, late = UNITS[setup.unit]
    reading_s = late + (1.0 / (2.0 * np.pi * bandwidth) if bandwidth else 0.0)
    velocity_s = low_passed_s(frequency_Hz, VELOCITIES[setup.velocity], 5e-4)
    two = bidirectional(frequency_Hz, reading_s=reading_s, delay_s=setup.delay_s)
    return two, unidirectional(frequency_Hz, reading_s=reading_s, delay_s=setup.delay_s, velocity_s=velocity_s)


def gate_figure(setup: Setup) -> Figure:
    """Felt damping and mass over frequency under a reading, and who damps over frequency and delay."""
    figure = empty_figure(13.0, 7.0)
    axes = figure.subplots(2, 2)
    two, one = felt(setup, FREQUENCIES_HZ)
    damping, mass = axes[0]
    for ax, name, label in ((damping, "damping", "felt damping / (m w)"), (mass, "mass", "felt mass / m")):
        ax.plot(FREQUENCIES_HZ, getattr(two, name), color=_COLOURS[1], label="bidirectional")
        ax.plot(FREQUENCIES_HZ, getattr(one, name), color=_COLOURS[2], label="unidirectional")
        ax.axhline(0.0, color=GREY, linewidth=0.6)
        dress(ax, f"felt {name}", "frequency (Hz)", label)
    mass.plot(
        FREQUENCIES_HZ,
        one.duty,
        color=ELEMENTS[3],
        linewidth=0.9,
        linestyle=":",
        label="gate open, share",
    )
    legend(damping)
    legend(mass)
    _who(axes[1, 0], 0.0, "who damps: an ideal accelerometer")
    _who(axes[1, 1], OLD_S, f"who damps: a reading {1e3 * OLD_S:.2f} ms old")
    from matplotlib.patches import Patch

    patches = [
        Patch(facecolor=colour, edgecolor=GREY, label=name) for colour, name in zip(_COLOURS, _NAMES, strict=True)
    ]
    figure.legend(handles=patches, loc="outside lower center", ncols=4, frameon=False)
    return figure


def _who(ax: Axes, reading_s: float, heading: str) -> None:
    from matplotlib.colors import ListedColormap

    reach = (FREQUENCIES_HZ[0], FREQUENCIES_HZ[-1], 0.0, 1e3 * DELAYS_S[-1])
    ax.imshow(
        damps(reading_s),
        origin="lower",
        aspect="auto",
        extent=reach,
        cmap=ListedColormap(_COLOURS),
        vmin=-0.5,
        vmax=3.5,
        interpolation="nearest",
    )
    dress(ax, heading, "frequency (Hz)", "extra delay (ms)")
    ax.grid(visible=False)
