"""Samples of a recorded motion, piece by piece, and notes on what was found."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class RecordingError(ValueError):
    """Raised for a recording that cannot be used; the message says why and what to do."""


@dataclass(frozen=True)
class Samples:
    """Consecutive samples, one control period apart; arrays of shape (samples,).

    Attributes:
        x_m, true_x_m: position measured by the controller, and that of the device.
        v_m_s, a_m_s2: velocity and acceleration as recorded; None where they are to be estimated.
        between_x_m: its position within the period after each sample, when a delayed force changes; None for a straight
            line from sample to sample.
        begins: whether a gap lies before it, or it is the first.
        end_x_m: position a period after the last sample; None where it is in the next piece, or not known.
        force_N: recorded force on the device, along the position; None where it was not read.
        taken_J: what the force took out of the device in the period after each sample, where that is known exactly.
        unknown: samples at its beginning whose velocity or acceleration would need those in the gap before: no element
            is taken to act there.
    """

    t_s: Floats
    x_m: Floats
    v_m_s: Floats | None
    a_m_s2: Floats | None
    true_x_m: Floats
    between_x_m: Floats | None
    begins: bool
    end_x_m: float | None = None
    unknown: int = 0
    force_N: Floats | None = None
    taken_J: Floats | None = None


@dataclass
class Notes:
    """Counts of what was found in a recording.

    Attributes:
        gaps_s: begin and end of each gap, s; the first hundred.
        bridged: single samples that were missing and are the mean of their neighbours.
        repeated: samples equal to the one before although the device moved, by three counts or more, before and after.
        uneven: periods that are more than a tenth off the others.
    """

    rows: int = 0
    unusable_rows: int = 0
    gaps_s: list[tuple[float, float]] = field(default_factory=list)
    gaps: int = 0
    missing_s: float = 0.0
    bridged: int = 0
    repeated: int = 0
    uneven: int = 0
    remarks: list[str] = field(default_factory=list)

    def gap(self, from_s: float, to_s: float) -> None:
        self.gaps, self.missing_s = self.gaps + 1, self.missing_s + to_s - from_s
        if len(self.gaps_s) < 100:
            self.gaps_s.append((from_s, to_s))
