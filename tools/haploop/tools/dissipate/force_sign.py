"""The sign of a recorded force, by how its slow part stands to the position: that of a wall pushes back."""

from __future__ import annotations

import numpy as np

from haploop.tools.dissipate.recording.samples import Floats

# A buzz averages out of means over so long, s; fewer of them, or ones that agree less, tell nothing.
_BLOCK_S, _LEAST_BLOCKS, _AGREE = 0.25, 8, 0.7
# Share of the variance of the force that its means must hold: an inertia's force is that of the fastest motion.
_SLOW = 0.1


class ForceSign:
    """Correlates means of force and position over a quarter of a second each.

    The force of a wall or a spring is the larger the further in the device is, and pushes it out: they go against each
    other. A damper's goes with neither; an inertia's goes with the position, but little of it is slow.
    """

    def __init__(self, period_s: float) -> None:
        self._samples = max(2, round(_BLOCK_S / period_s))
        self._left = np.empty((2, 0))
        self._means: list[Floats] = []
        self._squares_N2 = 0.0

    def add(self, x_m: Floats, force_N: Floats, begins: bool) -> None:
        """Adds samples in order, shape (samples,) each; ``begins``: after the beginning, or a gap."""
        rows = np.concatenate([self._left[:, : 0 if begins else None], [x_m, force_N]], axis=1)
        whole = rows.shape[1] // self._samples * self._samples
        blocks = rows[:, :whole].reshape(2, -1, self._samples)
        self._means.append(blocks.mean(axis=2))
        self._squares_N2 += float((blocks[1] ** 2).sum())
        self._left = rows[:, whole:]

    @property
    def pushes_back(self) -> bool | None:
        """Whether the force pushes back, as one of a wall does, or pulls further in; None where neither is seen."""
        x, force = np.concatenate([np.empty((2, 0)), *self._means], axis=1)
        if len(x) < _LEAST_BLOCKS or not np.ptp(x) or not np.ptp(force):
            return None
        variance_N2 = self._squares_N2 / (len(x) * self._samples) - force.mean() ** 2
        agree = float(np.corrcoef(x, force)[0, 1])
        return agree < 0.0 if force.var() >= _SLOW * variance_N2 and abs(agree) >= _AGREE else None
