"""The energy that a wall or an element takes from prescribed samples: by the program's own controller, and in closed
form.
"""

from __future__ import annotations

import numpy as np

from haploop.controller.controller import Controller
from haploop.controller.dissipation import registry
from haploop.protocol.scene.estimators import Acceleration
from haploop.protocol.scene.scene import Clock, Device, ElementTable, Scene, Wall
from haploop.protocol.ticks import Timebase

PERIOD_S = 1e-3
# The paper's numbers.
_PARAMETERS = {
    "damping": {"damping": 0.8},
    "bidirectional-inertia": {"mass": 0.01},
    "unidirectional-inertia": {"mass": 0.01},
}
SPRING = "spring"
KINDS = (SPRING, "damping", "bidirectional-inertia", "unidirectional-inertia")
STIFFNESS_N_M, DAMPING_N_S_M, MASS_KG = 150.0, 0.8, 0.01
_TICKS = 4000


def forces(x_m: np.ndarray, kind: str, cutoff_Hz: float | None = None) -> np.ndarray:
    """Returns the force of the wall's spring, or of an element that always acts, N, shape (ticks, batch) as ``x_m``.

    Samples are 1 ms apart, numbers are the paper's; the spring's wall is above 0 and is never left. The cutoff is that
    of a low-pass over the acceleration.
    """
    element = ElementTable(name=kind, acts="always", parameters=_PARAMETERS.get(kind, {}))
    scene = Scene(
        title="prescribed samples",
        duration=len(x_m) * PERIOD_S,
        clock=Clock(plant_rate=1000),
        device=Device(mass=1.0, damping=0.0),
        wall=Wall(position=1e3, stiffness=STIFFNESS_N_M) if kind == SPRING else None,
        dissipation=() if kind == SPRING else (element,),
        acceleration=Acceleration(cutoff=cutoff_Hz) if cutoff_Hz else None,
    )
    controller = Controller(scene, Timebase.from_scene(scene), registry())
    answered = controller.answer([(row,) for row in x_m])
    offset = STIFFNESS_N_M * 1e3 if kind == SPRING else 0.0
    return np.array([np.broadcast_to(force, x_m.shape[1:]) for force in answered]) - offset


def taken_J(x_m: np.ndarray, force_N: np.ndarray, late: int = 0) -> np.ndarray:
    """Returns the energy taken in each step, -f[k-1-late] (x[k] - x[k-1]) (Choi et al. 2022, eq. 4); shape of ``x_m``.

    With prescribed samples it is also the true energy, since the force is held from sample to sample.
    """
    acting = np.zeros_like(force_N)
    acting[1 + late :] = force_N[: len(force_N) - 1 - late]
    return -acting * np.diff(x_m, axis=0, prepend=x_m[:1])


def steps_J(v_m_s: np.ndarray, mass_kg: float) -> np.ndarray:
    """Returns the energy taken in each sample, m v[k] (v[k-1] - v[k-2]) (Choi et al. 2022, eq. 8); 0 in the first 2."""
    taken = np.zeros_like(v_m_s)
    taken[2:] = mass_kg * v_m_s[2:] * (v_m_s[1:-1] - v_m_s[:-2])
    return taken


def positions(v_m_s: np.ndarray) -> np.ndarray:
    """Returns samples, from 0 on, whose backward differences are these velocities, shape (velocities, ...)."""
    return np.cumsum(v_m_s, axis=0) * PERIOD_S


def closed_form(kind: str, theta: np.ndarray, late: int) -> np.ndarray:
    """Returns the mean energy taken per sample under x[k] = A sin(k theta + phase), in units of A^2 (theta = omega T).

        spring   (K / 2) (cos((d+1) theta) - cos(d theta))
        damping  (2 B / T) sin^2(theta / 2) cos((d+1) theta)
        inertia  (2 m / T^2) sin^2(theta / 2) (cos((d+1) theta) - cos((d+2) theta))

    The last from eq. 8: V = (2 A / T) sin(theta / 2) is the amplitude of v, and the mean of v[k] v[k-j] is
    V^2 cos(j theta) / 2. Inertia takes energy while (2 d + 3) theta < 2 pi: below fs / (2 d + 3), 333 Hz without delay.
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
    kind: str, theta: np.ndarray, late: int, cutoff_Hz: float | None = None, ticks: int = _TICKS
) -> np.ndarray:
    """Returns the mean energy taken per sample under a sine of A = 1 by running the program's controller.

    The mean is over the second half, with a Hann window, which reduces the effect of where a swing is cut. At the given
    frequencies the samples should not repeat soon, so that they meet all phases.
    """
    x = np.sin(np.arange(ticks)[:, None] * theta)
    weights = np.hanning(ticks - ticks // 2)
    return weights @ taken_J(x, forces(x, kind, cutoff_Hz), late)[ticks // 2 :] / weights.sum()


def bidirectional_J(frequency_Hz: np.ndarray, age_s: float | None) -> np.ndarray:
    """Returns the mean energy per sample that 1 kg takes from a sine of 1 m: |a| sin(theta / 2) sin(w (age + T / 2)).

    |a| = w^2, and f[k-1] = -|a| sin(w (t[k] - T - age)) times x[k] - x[k-1], which goes as cos(w (t[k] - T / 2)).
    The older the reading, the more it takes: all of what is moved at a quarter of a swing. Without an age the reading
    is a difference of differences: T old, and |a| = (2 / T)^2 sin^2(theta / 2).
    """
    w = 2.0 * np.pi * np.asarray(frequency_Hz, float)
    half = np.sin(w * PERIOD_S / 2.0)
    size = w**2 if age_s is not None else (2.0 / PERIOD_S * half) ** 2
    return size * half * np.sin(w * ((PERIOD_S if age_s is None else age_s) + PERIOD_S / 2.0))


def returned(frequency_Hz: float, *, before: bool = True) -> float:
    """Returns the ratio of the energy that unidirectional inertia gives back to a sine to what it takes, 0 to 1.

    The gate is v[k] a[k-1] >= 0 if ``before``, as in eq. 9 (the program's controller), else v[k] a[k] >= 0.
    """
    x = np.sin(np.arange(_TICKS) * 2.0 * np.pi * frequency_Hz * PERIOD_S)[:, None]
    v = np.diff(x, axis=0, prepend=x[:1]) / PERIOD_S
    a = np.diff(v, axis=0, prepend=v[:1]) / PERIOD_S
    force_N = forces(x, "unidirectional-inertia") if before else np.where(v * a >= 0.0, -MASS_KG * a, 0.0)
    taken = taken_J(x, force_N)[_TICKS // 2 :]
    return float(-np.minimum(taken, 0.0).sum() / np.maximum(taken, 0.0).sum())
