"""Where the gate of eq. 9 helps and where it hurts: the describing functions drawn."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from haploop.tools.figure_file import empty_figure
from haploop.tools.figure_style import ELEMENTS, GREY, dress, legend
from haploop.tools.paper.experiment.gate import always_open_Hz, bidirectional, unidirectional

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FREQUENCIES_HZ = np.linspace(2.0, 498.0, 249)
DELAYS_S = np.linspace(0.0, 3e-3, 121)
# What damps where: neither, bidirectional alone, unidirectional alone, both.
_COLOURS = ("#F0F0F0", "#56B4E9", "#CC79A7", "#DDEEDD")
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


def gate_figure(reading_s: float, delay_s: float) -> Figure:
    """Felt damping and mass over frequency at the setup's reading and delay, and who damps over frequency and delay."""
    figure = empty_figure(13.0, 7.0)
    axes = figure.subplots(2, 2)
    two = bidirectional(FREQUENCIES_HZ, reading_s=reading_s, delay_s=delay_s)
    one = unidirectional(FREQUENCIES_HZ, reading_s=reading_s, delay_s=delay_s)
    damping, mass = axes[0]
    for ax, name, label in ((damping, "damping", "felt damping / (m w)"), (mass, "mass", "felt mass / m")):
        ax.plot(FREQUENCIES_HZ, getattr(two, name), color=_COLOURS[1], label="bidirectional")
        ax.plot(FREQUENCIES_HZ, getattr(one, name), color=_COLOURS[2], label="unidirectional")
        ax.axhline(0.0, color=GREY, linewidth=0.6)
        dress(ax, "", "frequency (Hz)", label)
    mass.plot(
        FREQUENCIES_HZ,
        one.duty,
        color=ELEMENTS[3],
        linewidth=0.9,
        linestyle=":",
        label="gate open, share",
    )
    never = always_open_Hz(reading_s=reading_s)
    for ax in (damping, mass):
        ax.axvline(never, color=GREY, linewidth=0.8, linestyle="--")
    damping.set_title(f"reading {1e3 * reading_s:.2f} ms old, {1e3 * delay_s:g} ms of delay", loc="left")
    legend(damping)
    legend(mass)
    _who(axes[1, 0], 0.0, "who damps: an ideal accelerometer")
    _who(axes[1, 1], reading_s, f"who damps: a reading {1e3 * reading_s:.2f} ms old")
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
