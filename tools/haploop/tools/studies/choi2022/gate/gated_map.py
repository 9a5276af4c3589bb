"""How fast a loop in contact grows under unidirectional inertia: two linear maps and the gate between them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from haploop.plant.chain.chain import Chain
from haploop.tools.linear.one_tick import OneTickMap

# A mass that adds nothing but keeps its place in the map, and one to take the map's slope from; kg.
_NO_MASS, _SOME_MASS = 1e-15, 1e-3
_NO_DAMPING = 1e-12
_STARTS, _TICKS, _SETTLED, _RESCALED_EVERY = 3, 1200, 400, 50


@dataclass(frozen=True)
class GatedMap:
    """w -> (A - K p q' + m g[k] P) w with g[k] = 1 if v[k] a[k-1] >= 0, else 0 (Choi et al. 2022, eq. 9).

    The same one-tick map as of a linear loop in a contact that is never left (``OneTickMap``), switched by the signs of
    v[k] = x[k] - x[k-1] and of the reading before the present one. The map is homogeneous: twice the swing takes
    twice the course, so that a start either grows or decays, whatever its size. Which of them may depend on the start;
    the fastest growth of a few random ones counts.

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
    def of(cls, scene: dict[str, Any], damping: float = 0.0) -> GatedMap:
        """The map of a resolved scene without elements, with so much damping in N s/m beside the inertia.

        Raises:
            ValueError: velocity or acceleration are not read as the map has it.
            NotLinear: the rest of the loop is no linear map.
        """
        if scene.get("velocity") or scene.get("acceleration", {}) != {"source": "accelerometer"}:
            raise ValueError("The gate's map is that of a plain difference of positions and a raw accelerometer.")

        def map_with(mass: float) -> OneTickMap:
            damped = {"kind": "damping", "acts": "always", "damping": damping or _NO_DAMPING}
            inertia = {"kind": "bidirectional-inertia", "acts": "always", "mass": mass}
            return OneTickMap.of({**scene, "dissipation": [damped, inertia]})

        least, more = map_with(_NO_MASS), map_with(_SOME_MASS)
        per_kg = (more.without_wall - least.without_wall) / (_SOME_MASS - _NO_MASS)
        return cls(least.without_wall, per_kg, least.pushed, len(Chain.of(scene).states))

    def growth(self, stiffness: Any, mass: Any, *, seed: int = 1, ticks: int = _TICKS) -> np.ndarray:
        """ln of the factor per tick by which the fastest of some random starts grows, in the end: peak to peak.

        Args:
            stiffness, mass: N/m and kg, of the same shape or broadcast to one.
        """
        k, m = np.broadcast_arrays(np.asarray(stiffness, float), np.asarray(mass, float))
        shape = (_STARTS, *k.shape)
        k, m = np.tile(k.ravel(), _STARTS), np.tile(m.ravel(), _STARTS)
        w = self._starts(len(k), seed)
        x_before, a_before = w[0].copy(), np.zeros(len(k))
        peak, grown, settled, units = np.zeros(len(k)), np.zeros(len(k)), np.zeros(len(k)), self._units()
        for tick in range(1, ticks + 1):
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
        return ((grown - settled) / (ticks - _SETTLED)).reshape(shape).max(axis=0)

    def _starts(self, count: int, seed: int) -> np.ndarray:
        """Random positions and velocities of all bodies."""
        w = np.zeros((len(self.without), count))
        w[: self.states] = np.random.default_rng(seed).normal(size=(self.states, count)) * self._units()
        return w

    def _units(self) -> np.ndarray:
        """1 m/s of every velocity and 1 mm of every length; what else is a state counts as a velocity."""
        units = np.ones((self.states, 1))
        units[: self.states // 2] = 1e-3
        return units
