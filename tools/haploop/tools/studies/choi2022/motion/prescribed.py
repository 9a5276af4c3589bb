"""The program's own controller on prescribed samples: what a wall or an element takes out of a given motion."""

from __future__ import annotations

from typing import Any

import numpy as np

from haploop.controller.controller import Controller
from haploop.controller.dissipation import registry
from haploop.protocol.ticks import Timebase

PERIOD_S = 1e-3
# What each kind is given by default: the paper's numbers.
_PARAMETERS = {
    "damping": {"damping": 0.8},
    "bidirectional-inertia": {"mass": 0.01},
    "unidirectional-inertia": {"mass": 0.01},
}
SPRING = "spring"
KINDS = (SPRING, "damping", "bidirectional-inertia", "unidirectional-inertia")
STIFFNESS_N_M, DAMPING_N_S_M, MASS_KG = 150.0, 0.8, 0.01


def forces(x_m: np.ndarray, kind: str, cutoff_Hz: float | None = None) -> np.ndarray:
    """The force at every sample of the wall's spring or of an element that always acts, N.

    Args:
        x_m: samples 1 ms apart, shape (ticks, loops); a spring's wall is above 0 and is never left.
        kind: "spring", or the kind of an element, with the paper's parameter.
        cutoff_Hz: of a low-pass over the acceleration.

    Returns:
        Shape (ticks, loops).
    """
    scene: dict[str, Any] = {}
    if kind == SPRING:
        scene["wall"] = {"position": 1e3, "stiffness": STIFFNESS_N_M, "occupies": "below"}
    else:
        scene["dissipation"] = [{"kind": kind, "acts": "always", **_PARAMETERS[kind]}]
    if cutoff_Hz:
        scene["acceleration"] = {"source": "encoder", "cutoff": cutoff_Hz}
    clock = {"plant_rate": 1000, "control_rate": 1000, "round_trip_delay": 0.0}
    controller = Controller(scene, Timebase.from_clock(clock, len(x_m) * PERIOD_S), registry())
    answered = controller.answer([(row,) for row in x_m])
    offset = STIFFNESS_N_M * 1e3 if kind == SPRING else 0.0
    return np.array([np.broadcast_to(force, x_m.shape[1:]) for force in answered]) - offset


def taken_J(x_m: np.ndarray, force_N: np.ndarray, late: int = 0) -> np.ndarray:
    """Energy taken in each step, -f[k-1-late] (x[k] - x[k-1]) (Choi et al. 2022, eq. 4), 0 where there is no force yet.

    With prescribed samples it is the true book too, since the force is held from sample to sample.

    Returns:
        Shape of ``x_m``.
    """
    acting = np.zeros_like(force_N)
    acting[1 + late :] = force_N[: len(force_N) - 1 - late]
    return -acting * np.diff(x_m, axis=0, prepend=x_m[:1])


def positions(v_m_s: np.ndarray) -> np.ndarray:
    """Samples with these velocities as their backward differences, shape (velocities, ...), from 0 on."""
    return np.cumsum(v_m_s, axis=0) * PERIOD_S


def closed_form(kind: str, theta: np.ndarray, late: int) -> np.ndarray:
    """Mean energy taken a sample under x[k] = A sin(k theta + phase), in units of A^2 (theta = omega T).

        spring   (K / 2) (cos((d+1) theta) - cos(d theta))
        damping  (2 B / T) sin^2(theta / 2) cos((d+1) theta)
        inertia  (2 m / T^2) sin^2(theta / 2) (cos((d+1) theta) - cos((d+2) theta))

    The last from eq. 8: V = (2 A / T) sin(theta / 2) is the amplitude of v, and the mean of v[k] v[k-j] is
    V^2 cos(j theta) / 2. So inertia takes while (2 d + 3) theta < 2 pi: below fs / (2 d + 3), 333 Hz without delay.
    """
    d, half = late, np.sin(theta / 2.0) ** 2
    match kind:
        case "spring":
            return STIFFNESS_N_M / 2.0 * (np.cos((d + 1) * theta) - np.cos(d * theta))
        case "damping":
            return 2.0 * DAMPING_N_S_M / PERIOD_S * half * np.cos((d + 1) * theta)
        case "bidirectional-inertia":
            return 2.0 * MASS_KG / PERIOD_S**2 * half * (np.cos((d + 1) * theta) - np.cos((d + 2) * theta))
    raise ValueError(f"There is no closed form for {kind!r}.")


def mean_taken(
    kind: str, theta: np.ndarray, late: int, cutoff_Hz: float | None = None, ticks: int = 4000
) -> np.ndarray:
    """The same by running the program's controller: mean over the second half of so many samples of A = 1.

    The mean is weighted by a Hann window, which makes little of where in its swing the sine is cut. The frequencies
    should be ones at which the samples do not repeat soon, so that they meet all phases.
    """
    x = np.sin(np.arange(ticks)[:, None] * theta)
    weights = np.hanning(ticks - ticks // 2)
    return weights @ taken_J(x, forces(x, kind, cutoff_Hz), late)[ticks // 2 :] / weights.sum()
