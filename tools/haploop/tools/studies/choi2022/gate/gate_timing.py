"""Why eq. 9 looks at the acceleration of the sample before: what the gate gives back either way."""

from __future__ import annotations

import numpy as np

from haploop.tools.studies.choi2022.motion.prescribed import MASS_KG, PERIOD_S, forces, taken_J

_UNIDIRECTIONAL, _TICKS = "unidirectional-inertia", 4000


def returned(frequency_Hz: float, *, before: bool = True) -> float:
    """Of a sine, the energy that unidirectional inertia gives back over what it takes, 0 to 1.

    Args:
        before: whether the gate is v[k] a[k-1] >= 0, as in eq. 9 (the program's controller), or v[k] a[k] >= 0.
    """
    x = np.sin(np.arange(_TICKS) * 2.0 * np.pi * frequency_Hz * PERIOD_S)[:, None]
    taken = taken_J(x, forces(x, _UNIDIRECTIONAL) if before else _at_once(x))[_TICKS // 2 :]
    return float(-np.minimum(taken, 0.0).sum() / np.maximum(taken, 0.0).sum())


def _at_once(x_m: np.ndarray) -> np.ndarray:
    """The force with the gate of the present acceleration, N."""
    v = np.diff(x_m, axis=0, prepend=x_m[:1]) / PERIOD_S
    a = np.diff(v, axis=0, prepend=v[:1]) / PERIOD_S
    return np.where(v * a >= 0.0, -MASS_KG * a, 0.0)
