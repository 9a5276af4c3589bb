"""The sign of a recorded force, from how its slow part correlates with the position: a wall's force pushes back."""

from __future__ import annotations

import numpy as np

from haploop.tools.dissipate.recording.samples import Floats

# Length of the means, s, in which a buzz averages out; fewer means than this, or a weaker correlation, show nothing.
_BLOCK_S, _LEAST_BLOCKS, _AGREE = 0.25, 8, 0.7
# Least share of the force's variance that is in its means: an inertia's force is that of the fastest motion.
_SLOW = 0.1


class ForceSign:
    """Correlates means of force and position over a quarter of a second each.

    The force of a wall or a spring grows the further in the device is, and pushes it out: force and position vary in
    opposite directions. A damper's force varies neither way with the position; an inertia's varies in the same
    direction, but little of it is slow.
    """

    def __init__(self, period_s: float) -> None:
        self._samples = max(2, round(_BLOCK_S / period_s))
        self._left = np.empty((2, 0))
        self._means: list[Floats] = []
        self._squares_N2 = 0.0

    def add(self, x_m: Floats, force_N: Floats, begins: bool) -> None:
        """Adds samples in order, shape (samples,) each; ``begins``: they are the first, or follow a gap."""
        rows = np.concatenate([self._left[:, : 0 if begins else None], [x_m, force_N]], axis=1)
        whole = rows.shape[1] // self._samples * self._samples
        blocks = rows[:, :whole].reshape(2, -1, self._samples)
        self._means.append(blocks.mean(axis=2))
        self._squares_N2 += float((blocks[1] ** 2).sum())
        self._left = rows[:, whole:]

    @property
    def pushes_back(self) -> bool | None:
        """Whether the force pushes back, as a wall's does, or pulls further in; None where neither is seen."""
        x, force = np.concatenate([np.empty((2, 0)), *self._means], axis=1)
        if len(x) < _LEAST_BLOCKS or not np.ptp(x) or not np.ptp(force):
            return None
        variance_N2 = self._squares_N2 / (len(x) * self._samples) - force.mean() ** 2
        agree = float(np.corrcoef(x, force)[0, 1])
        return agree < 0.0 if force.var() >= _SLOW * variance_N2 and abs(agree) >= _AGREE else None
