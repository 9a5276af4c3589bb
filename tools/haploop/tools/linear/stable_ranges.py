"""At which stiffnesses an eigenvalue of a one-tick map can cross the unit circle."""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigvals, matrix_balance

# Roots this near the unit circle are tried; what is no crossing among them is harmless.
_NEAR = 1e-3


def crossings(without_wall: np.ndarray, pushed: np.ndarray) -> list[float]:
    """Every K > 0 for which M = A - K p q' may have an eigenvalue on the unit circle, rising; q' w = w[0].

    det(z - M) = det(z - A) (1 + K G(z)) with G(z) = q' (z - A)^-1 p, so that on the circle G must be real there:
    G(z) = G(1/z), which is a generalised eigenvalue problem in z, and K = -1 / G(z). Being exact it also finds windows
    of stability however narrow. The list may hold more than crossings: what touches, and what rounding moves.

    Args:
        without_wall: A, shape (w, w).
        pushed: p, shape (w,).
    """
    a, b, c = _balanced(without_wall, pushed)
    found = []
    for z in [*_real_on_the_circle(a, b, c), -1.0]:
        try:
            gain = c @ np.linalg.solve(z / abs(z) * np.eye(len(a)) - a, b)
        except np.linalg.LinAlgError:
            continue  # a pole of the loop without a wall: K = 0
        if gain.real < 0.0:
            found.append(float(-1.0 / gain.real))
    return sorted(found)


def _balanced(without_wall: np.ndarray, pushed: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A, p, q in coordinates in which their numbers are of like size, the size of G kept."""
    a, (scales, _) = matrix_balance(without_wall, permute=False, separate=True)
    b, c = pushed / scales, np.zeros(len(pushed))
    c[0] = scales[0]
    return a, b, c


def _real_on_the_circle(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> list[complex]:
    """The z near the unit circle, not below the real axis, with c (z - A)^-1 b = c z (1 - z A)^-1 b."""
    n = len(a)
    size = np.abs(b).max()
    weight = np.abs(c).max()
    of_z, constant = np.zeros((2, 2 * n + 1, 2 * n + 1))
    of_z[:n, :n], of_z[n:-1, n:-1], of_z[-1, n:-1] = np.eye(n), -a, -c / weight
    constant[:n, :n], constant[n:-1, n:-1], constant[-1, :n] = a, -np.eye(n), -c / weight
    constant[:-1, -1] = np.tile(b, 2) / size
    roots = eigvals(constant, of_z)
    return [z for z in roots[np.isfinite(roots)] if abs(abs(z) - 1.0) < _NEAR and z.imag >= 0.0]
