"""Theory of a virtual inertia with the gate of eq. 9, and of linear elements, without a single run.

At one frequency: the mass and the damping that the device feels from an inertia. In a contact: the largest stiffness
that the loop withstands with each element at its best size. For linear elements that is where the one-tick map of the
loop has the spectral radius 1; for unidirectional inertia, where the same map, switched by the gate, begins to grow.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from haploop.plant.chain.chain import Chain
from haploop.protocol.scene.estimators import Acceleration
from haploop.protocol.scene.scene import ElementTable, Scene
from haploop.tools.linear.one_tick import OneTickMap
from haploop.tools.search.bisect import bisect_many
from haploop.tools.studies.choi2022.device import KINDS, UNITS, VELOCITIES, Setup, elements_of
from haploop.tools.studies.choi2022.sampled import PERIOD_S

FREQUENCIES_HZ = np.linspace(2.0, 498.0, 249)
# Age of a reading of an MPU-9250 at its setting of 420 Hz.
OLD_S = 1.38e-3
DELAYS_S = np.linspace(0.0, 3e-3, 121)
# Sizes tried first for every element: from almost nothing to beyond what any loop here withstands. N s/m, and kg.
DAMPINGS = np.geomspace(0.1, 40.0, 16)
MASSES = np.geomspace(3e-4, 0.08, 16)
_SOFTEST, _STIFFEST, _COARSE, _HALVINGS = 50.0, 60e3, 30, 4
# Around this many of the best sizes, this many more on either side, this many times.
_PEAKS, _FINER, _ZOOMS = 2, 2, 3
# A mass that adds nothing but keeps its place in the map, and one that gives the slope of the map; kg.
_NO_MASS, _SOME_MASS = 1e-15, 1e-3
_STARTS, _TICKS, _SETTLED, _RESCALED_EVERY = 3, 1200, 400, 50


def bidirectional(frequency_Hz: ArrayLike, *, reading_s: float, delay_s: ArrayLike) -> np.ndarray:
    """Returns the effect of f = -m a on a device that swings at w: felt mass / m - j felt damping / (m w).

    Late by psi = w (reading + delay + T / 2), from the age of the reading, the extra delay and half a period of the
    hold, it is felt as the mass m cos(psi) and the damping m w sin(psi): late inertia damps, most at a quarter of a
    period, and drives from half a period on.
    """
    w = 2.0 * np.pi * np.asarray(frequency_Hz, float)
    return np.exp(-1j * w * (reading_s + np.asarray(delay_s) + PERIOD_S / 2.0))


def unidirectional(
    frequency_Hz: ArrayLike, *, reading_s: float, delay_s: ArrayLike, velocity_s: ArrayLike = PERIOD_S / 2.0
) -> np.ndarray:
    """Returns the effect of f = -m a[k] while v[k] a[k-1] >= 0 (Choi et al. 2022, eq. 9), as ``bidirectional`` does.

    Against the reading a[k], the velocity (a difference, T / 2 old) lags by p = pi/2 + w (velocity - reading), a[k-1]
    by q = w T. With d = p - q folded into [0, pi] the gate is open around (p + q) / 2 for the share 1 - d / pi, and
        N = (2 h + e^(-j (p + q)) sin 2 h) / pi,    2 h = pi - d,
    is what is left of the reading's fundamental, which then lags like that of a bidirectional inertia. Without any lag
    d = pi/2 and N = 1/2 - j/pi: half the mass, and a damping of m w / pi. Where w (T/2 + reading) nears pi/2, v and
    a[k-1] swing together and the gate never closes: there it is a bidirectional inertia. Beyond, the gate opens while
    the motion slows. The phase of the ticks is averaged over: no frequency is locked to the rate.

    Args:
        reading_s: age of the acceleration's reading.
        delay_s: extra delay of the loop.
        velocity_s: age of the velocity; for a low-passed one by frequency, see ``low_passed_s``.
    """
    w = 2.0 * np.pi * np.asarray(frequency_Hz, float)
    p, q = np.pi / 2.0 + w * (np.asarray(velocity_s) - reading_s), w * PERIOD_S
    open_rad = np.pi - np.arccos(np.cos(p - q))
    left = (open_rad + np.exp(-1j * (p + q)) * np.sin(open_rad)) / np.pi
    return left * bidirectional(frequency_Hz, reading_s=reading_s, delay_s=delay_s)


def low_passed_s(frequency_Hz: np.ndarray, cutoff_Hz: float | None, age_s: float) -> np.ndarray:
    """Returns the age of a signal behind a first-order low-pass, atan(f / cutoff) / w more than before."""
    f = np.asarray(frequency_Hz, float)
    return age_s + (np.arctan(f / cutoff_Hz) / (2.0 * np.pi * f) if cutoff_Hz else np.zeros_like(f))


def always_open_Hz(*, reading_s: float) -> float:
    """Returns the lowest frequency at which the gate never closes, Hz: w (T + reading - T / 2) = pi / 2."""
    return 0.25 / (PERIOD_S / 2.0 + reading_s)


def damps(reading_s: float) -> np.ndarray:
    """Returns which inertia damps, an index from 0 to 3 into the colours, shape (delays, frequencies)."""
    delay, frequency = np.meshgrid(DELAYS_S, FREQUENCIES_HZ, indexing="ij")
    two, one = (of(frequency, reading_s=reading_s, delay_s=delay) for of in (bidirectional, unidirectional))
    return (np.imag(two) < 0.0) + 2 * (np.imag(one) < 0.0)


def felt_damping(setup: Setup, frequency_Hz: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns damping / (m w) of bi- and unidirectional inertia with a setup's delay, unit and low-passed velocity."""
    bandwidth, late = UNITS[setup.unit]
    reading_s = late + (1.0 / (2.0 * np.pi * bandwidth) if bandwidth else 0.0)
    velocity_s = low_passed_s(frequency_Hz, VELOCITIES[setup.velocity], PERIOD_S / 2.0)
    two = bidirectional(frequency_Hz, reading_s=reading_s, delay_s=setup.delay_s)
    one = unidirectional(frequency_Hz, reading_s=reading_s, delay_s=setup.delay_s, velocity_s=velocity_s)
    return -np.imag(two), -np.imag(one)


class Best(NamedTuple):
    """The largest steady stiffness in N/m (0 if there is none), and the size of the element that withstands it."""

    stiffness: float
    size: float


def limits(setup: Setup) -> dict[str, Best]:
    """Returns the limit of each of ``KINDS``: exact (rho(M) = 1) for the first three, by the gated map for the last."""

    def exact(kind: str, sizes: np.ndarray) -> np.ndarray:
        return np.array([first_end(setup, kind, size) for size in sizes])

    nothing = first_end(setup, KINDS[0], 0.0)
    gated = GatedMap.from_scene(setup.linear_scene())
    return {
        KINDS[0]: Best(nothing, 0.0),
        KINDS[1]: best_size(partial(exact, KINDS[1]), DAMPINGS, nothing),
        KINDS[2]: best_size(partial(exact, KINDS[2]), MASSES, nothing),
        KINDS[3]: best_size(partial(gated_ends, gated), MASSES, nothing),
    }


def first_end(setup: Setup, kind: str, size: float) -> float:
    """Returns the end of the range of steady stiffnesses that begins at 0, N/m; 0 if there is none."""
    ranges = OneTickMap.from_scene(setup.linear_scene(elements_of(kind, float(size)))).stable_ranges()
    return min(ranges[0][1], _STIFFEST) if ranges and ranges[0][0] == 0.0 else 0.0


def swings_at_Hz(setup: Setup, stiffness: float) -> float:
    """Returns the frequency of what grows fastest, or decays slowest, without an element at a stiffness in N/m."""
    scene = setup.linear_scene()
    values = np.linalg.eigvals(OneTickMap.from_scene(scene).matrix(stiffness))
    return float(abs(np.angle(values[np.abs(values).argmax()])) / (2.0 * np.pi) * scene.clock.control_rate)


def gated_ends(gated: GatedMap, masses: np.ndarray) -> np.ndarray:
    """Returns for each mass of unidirectional inertia the stiffness at which the loop first grows, N/m."""
    coarse = np.geomspace(_SOFTEST, _STIFFEST, _COARSE)
    grows = gated.growth(coarse[:, None], masses[None, :]) >= 0.0
    first = np.where(grows.any(axis=0), grows.argmax(axis=0), len(coarse) - 1)
    ends = zip(np.where(first > 0, coarse[first - 1], 0.0).tolist(), coarse[first].tolist(), strict=True)

    def shrinks(middles: Mapping[int, float]) -> dict[int, bool]:
        growth = gated.growth(np.array(list(middles.values())), masses[list(middles)])
        return dict(zip(middles, (growth < 0.0).tolist(), strict=True))

    found = bisect_many(dict(enumerate(ends)), shrinks, most_rounds=_HALVINGS)
    return np.array([found[i][0] for i in range(len(masses))])


def best_size(ends: Callable[[np.ndarray], np.ndarray], sizes: np.ndarray, nothing: float) -> Best:
    """Returns the size that withstands the most, possibly 0, searched between the neighbours of the best in rounds.

    The steps between neighbours, in the logarithm, shrink threefold a round. The search is around two peaks of what was
    tried, since the limit may have several peaks over the size.

    Args:
        ends: from sizes to the stiffnesses that they withstand.
        sizes: sizes tried first, increasing.
        nothing: the stiffness withstood without the element.
    """
    found = ends(sizes)
    for _ in range(_ZOOMS):
        # Nothing beyond the ends is better.
        around = np.concatenate([[-1.0], found, [-1.0]])
        peaks = np.flatnonzero((found >= around[:-2]) & (found >= around[2:]))
        peaks = peaks[np.argsort(found[peaks])][-_PEAKS:]
        pairs = {(max(i + side, 0), min(i + side + 1, len(sizes) - 1)) for i in peaks.tolist() for side in (-1, 0)}
        finer = [np.geomspace(sizes[i], sizes[j], _FINER + 2)[1:-1] for i, j in pairs if i < j]
        more = np.concatenate(finer)
        sizes, found = np.append(sizes, more), np.append(found, ends(more))
        order = np.argsort(sizes)
        sizes, found = sizes[order], found[order]
    i = int(found.argmax())
    return Best(float(found[i]), float(sizes[i])) if found[i] > nothing else Best(nothing, 0.0)


@dataclass(frozen=True)
class GatedMap:
    """The map w -> (A - K p q' + m g[k] P) w with g[k] = 1 if v[k] a[k-1] >= 0, else 0 (Choi et al. 2022, eq. 9).

    The one-tick map of a linear loop in a contact that is never left (``OneTickMap``), switched by the signs of
    v[k] = x[k] - x[k-1] and of the reading before the present one. It is homogeneous, so that a start either grows or
    decays, whatever its size; the fastest growth of a few random starts counts.

    Attributes:
        without: A, shape (w, w).
        per_kg: P, shape (w, w).
        pushed: p, shape (w,).
        states: how many entries of w are the plant's; the reading follows them.
    """

    without: np.ndarray
    per_kg: np.ndarray
    pushed: np.ndarray
    states: int

    @classmethod
    def from_scene(cls, scene: Scene) -> GatedMap:
        """Makes the map of a resolved scene without elements.

        Raises:
            ValueError: velocity or acceleration are not read as the map assumes.
            NotLinear: the rest of the loop is not a linear map.
        """
        if scene.velocity or scene.acceleration != Acceleration(source="accelerometer"):
            raise ValueError("The gate's map is that of a plain difference of positions and a raw accelerometer.")

        def map_with(mass: float) -> OneTickMap:
            inertia = ElementTable(name="bidirectional-inertia", acts="always", parameters={"mass": mass})
            return OneTickMap.from_scene(replace(scene, dissipation=(inertia,)))

        least, more = map_with(_NO_MASS), map_with(_SOME_MASS)
        per_kg = (more.without_wall - least.without_wall) / (_SOME_MASS - _NO_MASS)
        return cls(least.without_wall, per_kg, least.pushed, len(Chain.from_scene(scene).states))

    def growth(self, stiffness: ArrayLike, mass: ArrayLike) -> np.ndarray:
        """Returns ln of the factor per tick by which the fastest of some random starts finally grows, peak to peak.

        Stiffness in N/m and mass in kg are broadcast to one shape.
        """
        k, m = np.broadcast_arrays(np.asarray(stiffness, float), np.asarray(mass, float))
        shape = (_STARTS, *k.shape)
        k, m = np.tile(k.ravel(), _STARTS), np.tile(m.ravel(), _STARTS)
        # 1 m/s for every velocity and 1 mm for every length; any other state counts as a velocity.
        units = np.where(np.arange(self.states) < self.states // 2, 1e-3, 1.0)[:, None]
        w = np.zeros((len(self.without), len(k)))
        w[: self.states] = np.random.default_rng(1).normal(size=(self.states, len(k))) * units
        x_before, a_before = w[0].copy(), np.zeros(len(k))
        peak, grown, settled = np.zeros(len(k)), np.zeros(len(k)), np.zeros(len(k))
        for tick in range(1, _TICKS + 1):
            x, a = w[0].copy(), w[self.states].copy()
            gate = (x - x_before) * a_before >= 0.0
            w = self.without @ w - self.pushed[:, None] * (k * x) + self.per_kg @ (w * (m * gate))
            x_before, a_before = x, a
            np.maximum(peak, np.abs(w[: self.states] / units).max(axis=0), out=peak)
            if tick % _RESCALED_EVERY == 0:
                size = peak + 1e-300
                grown += np.log(size)
                w, x_before, a_before, peak = w / size, x_before / size, a_before / size, np.zeros(len(k))
            if tick == _SETTLED:
                settled = grown.copy()
        return ((grown - settled) / (_TICKS - _SETTLED)).reshape(shape).max(axis=0)
