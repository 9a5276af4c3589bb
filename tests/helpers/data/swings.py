"""Sines over four seconds at 1 kHz, in m, and the counts of an encoder."""

from __future__ import annotations

import numpy as np

from haploop.tools.dissipate.recording.samples import Floats

S: Floats = np.arange(4000.0) * 1e-3
COUNT_M = 11e-6


def counted(x_m: Floats) -> Floats:
    return np.round(x_m / COUNT_M) * COUNT_M


def swing(frequency_Hz: float, amplitude_m: float) -> Floats:
    return amplitude_m * np.sin(2.0 * np.pi * frequency_Hz * S)
