"""Noise of recorded positions, found from their fastest changes, and the same positions with as much noise added."""

from __future__ import annotations

from dataclasses import replace
from math import comb

import numpy as np

from haploop.tools.dissipate.recording.samples import Samples

# The eighth difference of white noise has binomial(16, 8) times its variance; of a motion at a tenth of the sampling
# rate it leaves 0.02 of the amplitude, and of slower ones nothing.
_ORDER = 8
_GAIN = comb(2 * _ORDER, _ORDER)


class PositionNoise:
    """Estimates the white noise of positions, as that of a sensor or of counts that are crossed in every sample.

    An element's energy is about a quadratic form of the positions, to which noise adds its own energy: as much noise
    again adds as much energy again, in the mean. The change that it causes is therefore the change that the noise has
    already caused.
    """

    def __init__(self) -> None:
        self._square_m2, self._count = 0.0, 0
        self._random = np.random.default_rng(0)

    @property
    def deviation_m(self) -> float:
        """The standard deviation over all pieces so far, m."""
        return (self._square_m2 / max(1, self._count) / _GAIN) ** 0.5

    def added_to(self, piece: Samples) -> Samples:
        """Returns the piece with noise added that is as strong as that found so far, in this piece and before."""
        fast = np.diff(piece.x_m, _ORDER)
        self._square_m2, self._count = self._square_m2 + float(fast @ fast), self._count + len(fast)
        x = piece.x_m + self.deviation_m * self._random.standard_normal(len(piece.x_m))
        return replace(piece, x_m=x, true_x_m=x)
