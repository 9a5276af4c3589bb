"""Velocity and acceleration by a Kalman filter of a mass whose jerk is white noise, in its steady state.

Between ticks the model is x''' = w, E[w(t) w(s)] = S delta(t - s), S = ``jerk_density`` squared, so that

    | x |        | 1  T  T^2/2 | | x |                     | T^5/20  T^4/8  T^3/6 |
    | v | [k+1] =| 0  1  T     | | v | [k] + noise, Q = S  | T^4/8   T^3/3  T^2/2 |
    | a |        | 0  0  1     | | a |                     | T^3/6   T^2/2  T     |

Measured are x with white noise of standard deviation sigma and, if the accelerometer is used, a with its own noise
(Bar-Shalom, Li, Kirubarajan 2001, section 6.2; Belanger et al. 1998 for encoders).

With w0 = (S / (sigma^2 T))^(1/6) and w0 T << 1 the filter of positions alone has the poles of a third-order Butterworth
low-pass of corner w0 rad/s, and errors, jerk and noise together, of sqrt(3 w0^3 T) sigma in v and sqrt(2 w0^5 T) sigma
in a. A desired corner thus needs ``jerk_density`` = w0^3 sigma sqrt(T). Constant acceleration is followed without
error or delay; at a constant jerk a is late by g_v / g_a - T / 2, g the gains: by 2 / w0 when w0 T << 1.
Rounding is not white where the device hardly moves, and band-limited noise is not white either: the filter is then no
longer the best, but just as stable. An accelerometer's bias, delay and bandwidth are not in the model.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from haploop.controller.estimators.base import Estimator, Sample
from haploop.protocol.arrays import each
from haploop.protocol.scene.effects import Accelerometer
from haploop.protocol.scene.estimators import Velocity
from haploop.protocol.scene.scene import Scene

if TYPE_CHECKING:
    import numpy as np

Memory = tuple[Any, Any, Any]
# Decimals kept of a gain times the least surprise it meets: LAPACK's last bits, which differ between machines, lie
# beyond.
_DECIMALS = 12


@dataclass(frozen=True)
class Kalman(Estimator):
    """The velocity from positions alone; ``acceleration`` gives the a found with it.

    The prediction starts at the first sample, at rest, so that v[0] = a[0] = 0.

    Memory: (x, v as the model predicts them at the next tick; a, which it holds until then).

    Attributes:
        gain: g_x (1), g_v (1/s) and g_a (1/s^2) of the position, shape (3, 1): from prediction to estimate.
        period_s, half_s2: the control period T, and T^2 / 2.
    """

    name: ClassVar[str] = "kalman"
    does: ClassVar[str] = "that of a Kalman filter of position, velocity and acceleration"
    tables: ClassVar[tuple[str, ...]] = ("velocity",)
    needs: ClassVar[tuple[str, ...]] = ("jerk_density",)
    takes: ClassVar[tuple[str, ...]] = ("measurement_noise", "accelerometer", "accelerometer_noise")
    needs_without: ClassVar[Mapping[str, tuple[str, ...]]] = {"measurement_noise": ("encoder", "noise")}
    gain: tuple[tuple[Any, ...], ...]
    period_s: float
    half_s2: float

    @classmethod
    def from_scene(cls, scene: Scene, of: str, period_s: float) -> Kalman:
        """Makes the filter of a scene's ``[velocity]`` table, fused with the accelerometer if that is asked for."""
        noises = assumed_noises(scene, period_s).values()
        density = (scene.velocity or Velocity()).jerk_density
        gain = each(lambda jerk, *noises: steady_state(jerk, list(noises), period_s)[0], density, *noises)
        entries = gain.tolist() if gain.ndim == 2 else gain
        return (FusedKalman if len(noises) > 1 else Kalman)(
            tuple(map(tuple, entries)), period_s, period_s * period_s / 2.0
        )

    def start(self, u: Any, sample: Sample) -> Memory:
        return u, 0.0 * u, 0.0 * u

    def step(self, memory: Memory, u: Any, sample: Sample) -> tuple[Memory, Any]:
        (g_x,), (g_v,), (g_a,) = self.gain
        x, v, a = memory
        surprise = u - x
        v, a = v + g_v * surprise, a + g_a * surprise
        return (x + g_x * surprise + self.period_s * v + self.half_s2 * a, v + self.period_s * a, a), v

    def acceleration(self, memory: Memory) -> Any:
        return memory[2]


@dataclass(frozen=True)
class FusedKalman(Kalman):
    """The velocity from positions and the accelerometer's readings; a starts at the first reading.

    Attributes:
        gain: of the position, and of the reading in s^2, s and 1, shape (3, 2).
    """

    def start(self, u: Any, sample: Sample) -> Memory:
        return u, 0.0 * u, sample[1]

    def step(self, memory: Memory, u: Any, sample: Sample) -> tuple[Memory, Any]:
        (g_x, h_x), (g_v, h_v), (g_a, h_a) = self.gain
        x, v, a = memory
        surprise, surprise_a = u - x, sample[1] - a
        v, a = v + g_v * surprise + h_v * surprise_a, a + g_a * surprise + h_a * surprise_a
        x = x + g_x * surprise + h_x * surprise_a
        return (x + self.period_s * v + self.half_s2 * a, v + self.period_s * a, a), v


def assumed_noises(scene: Scene, period_s: float) -> dict[str, float]:
    """Returns the standard deviations that the filter of a scene assumes, by their keys in ``[velocity]``."""
    noises = {"measurement_noise": position_noise_m(scene)}
    if scene.velocity and scene.velocity.accelerometer:
        given = scene.velocity.accelerometer_noise
        noises["accelerometer_noise"] = _accelerometer_noise_m_s2(scene, period_s) if given is None else given
    return noises


def jerk_density_limits(noise_m: float, period_s: float) -> tuple[float, float]:
    """Returns the least and greatest ``jerk_density`` that the gain can be computed for: w0 T from 1e-5 to 1e4."""
    unit = noise_m * period_s**-2.5
    return 1e-15 * unit, 1e12 * unit


def steady_state(jerk_density: float, noises: list[float], period_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Returns the gain, shape (3, m), and the covariance of the estimate's error, shape (3, 3), both SI.

    P = A (P - P H' (H P H' + R)^-1 H P) A' + Q, gain = P H' (H P H' + R)^-1, solved with sigma as the unit of length
    and 1 / w0 or T, whichever is longer, as that of time; no number is then far from 1, however slow the filter.

    Args:
        jerk_density: root of the jerk's density S, m/s^3/Hz^0.5, within ``jerk_density_limits``.
        noises: standard deviation of the position, m, above 0, and, if it is measured, that of the acceleration, m/s^2.
    """
    import numpy as np
    from scipy.linalg import solve_discrete_are

    density = (jerk_density / noises[0]) ** 2
    unit_s = max(period_s, (density / period_s) ** (-1 / 6))
    units = np.array([1.0, 1.0 / unit_s, 1.0 / unit_s**2])
    step, process = _model(period_s / unit_s, density * unit_s**5)
    measured = [0, 2][: len(noises)]
    reads, deviation = np.eye(3)[measured], np.array(noises) / noises[0] / units[measured]
    noise = np.diag(deviation**2)
    predicted = solve_discrete_are(step.T, reads.T, process, noise)
    gain = np.linalg.solve(reads @ predicted @ reads.T + noise, reads @ predicted).T
    # Joseph's form: a sum of squares, so that no variance is below 0 where the filter removes nearly all of it.
    kept = np.eye(3) - gain @ reads
    estimated = kept @ predicted @ kept.T + gain @ noise @ gain.T
    surprise = np.maximum(deviation, 1.0)
    gain = np.round(gain * surprise, _DECIMALS) / surprise
    return gain * units[:, None] / units[measured], estimated * np.outer(units, units) * noises[0] ** 2


def _model(T: float, S: float) -> tuple[np.ndarray, np.ndarray]:
    """Returns A and Q of x''' = w over the time T."""
    import numpy as np

    step = np.array([[1.0, T, T**2 / 2], [0.0, 1.0, T], [0.0, 0.0, 1.0]])
    noise = [[T**5 / 20, T**4 / 8, T**3 / 6], [T**4 / 8, T**3 / 3, T**2 / 2], [T**3 / 6, T**2 / 2, T]]
    return step, S * np.array(noise)


def position_noise_m(scene: Scene) -> float:
    """Returns sigma: the one that ``[velocity]`` gives, or that of rounding (q / sqrt(12)) and noise together."""
    if scene.velocity and scene.velocity.measurement_noise is not None:
        return scene.velocity.measurement_noise
    rounding = scene.count_m / math.sqrt(12.0)
    return each(math.hypot, rounding, scene.noise.deviation if scene.noise else 0.0)


def _accelerometer_noise_m_s2(scene: Scene, period_s: float) -> float:
    """Returns the deviation of the accelerometer's white noise through its first-order bandwidth, and of its rounding.

    The deviation of noise of density n is n sqrt(pi B / 2) behind a corner at B Hz, n sqrt(1 / (2 T)) if unfiltered.
    """
    table = scene.accelerometer or Accelerometer()
    band_Hz = 0.5 / period_s if table.bandwidth is None else math.pi / 2.0 * table.bandwidth
    rounding = (table.resolution or 0.0) / math.sqrt(12.0)
    return math.hypot(table.noise_density * math.sqrt(band_Hz), rounding)
