"""The work of a recorded force: the sum F v T that is often taken for it, and its passivity by its true book."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np

from haploop.tools.dissipate.recording.samples import Floats, Samples

Passivity = Literal["passive", "fed the buzz", "generated", "other sign", "unresolved", "begins loaded"]
# Share of the terms of a sum that rounding leaves over where they cancel.
_ROUNDING = 1e-12
# A wall takes energy before it gives any: the sign of a force that took less than this share of what it gave is in
# doubt.
_TOOK_FIRST = 0.01


class ForceRows(NamedTuple):
    """A recorded force at some samples, N, and the energy it has taken out of the device so far, J; (samples,)."""

    force_N: Floats
    true_J: Floats
    naive_J: Floats


class ForceBook:
    """The naive sum of a recorded force, and how much more energy it gave out than it had taken.

    naive  E += -F[k] v[k] T for every sample whose hold is booked; with v from a backward difference each force is
           multiplied by the displacement that led to it, not by the displacement over which it acts: a sampled spring
           K pushed in to x and let out at a speed v generates K x v T, and this sum says that it dissipated as much.

    A force generates energy where it has given out more than it took since it was last known to be at rest: since the
    beginning, or the end of a gap, with F = 0. Rounding positions to counts of q changes the energy up to a sample by
    at most q/2 (sum |dF| + |F|) (summed by parts), so anything below that may be due to rounding.

    Args:
        delay_s: from a sample to its force; after a gap, forces still in flight are not known.

    Attributes:
        naive_J: the sum, positive: taken out of the device.
        excess_J: the most given out beyond what had been taken.
    """

    def __init__(self, period_s: float, delay_s: float) -> None:
        self._period_s, self._is_late = period_s, delay_s > 0.0
        self.naive_J = self.excess_J = self._beyond_doubt_J = self._magnitude_J = 0.0
        self._most_J = self._most_before_J = 0.0
        self._is_first, self._any_loaded, self._resolution_m = True, False, np.inf

    def add(self, piece: Samples, v_m_s: Floats, added_J: Floats, true_J: Floats) -> ForceRows:
        """Adds a piece.

        Args:
            v_m_s: velocity at its samples.
            added_J: gain of the force's true book over the period before each sample; 0 at the beginning.
            true_J: the value of that book at each sample.
        """
        force, x = piece.force_N, piece.true_x_m
        assert force is not None
        if piece.begins:
            self._loaded = bool(force[0]) or (self._is_late and not self._is_first)
            self._any_loaded |= self._loaded
            self._waiting_J = np.empty(0)
            self._since_J, self._travel_N, self._last_N, self._last_x = 0.0, 0.0, force[0], x[0]
            self._is_first = False
        holds = np.append(self._waiting_J, -force * v_m_s * self._period_s)
        counted = np.append(np.zeros(1 - len(self._waiting_J)), holds[:-1])
        naive = self.naive_J + np.cumsum(counted)
        self.naive_J, self._waiting_J = float(naive[-1]), holds[-1:]
        self._judge(force, x, added_J, exact=piece.taken_J is not None)
        return ForceRows(force, true_J, naive)

    def finish(self, added_J: float) -> None:
        """Adds the period after the last sample, in which the true book gained ``added_J``."""
        self.naive_J += float(self._waiting_J.sum())
        self._judge(np.array([self._last_N]), np.array([self._last_x]), np.array([added_J]), exact=True)

    @property
    def passivity(self) -> Passivity:
        """Whether it generated energy, or why that cannot be told."""
        least_J = _ROUNDING * self._magnitude_J
        if self._beyond_doubt_J > least_J:
            return "generated" if self._most_before_J > _TOOK_FIRST * self.excess_J else "other sign"
        if self._any_loaded:
            return "begins loaded"
        return "unresolved" if self.excess_J > least_J else "passive"

    def _judge(self, force: Floats, x: Floats, added_J: Floats, exact: bool) -> None:
        steps = np.abs(np.diff(x, prepend=self._last_x))
        seen = np.minimum.accumulate(np.append(self._resolution_m, np.where(steps > 0.0, steps, np.inf)))[1:]
        energy = self._since_J + np.cumsum(added_J)
        travel = self._travel_N + np.cumsum(np.abs(np.diff(force, prepend=self._last_N)))
        doubt = 0.0 if exact else 0.5 * np.where(np.isfinite(seen), seen, 0.0) * (travel + np.abs(force))
        if not self._loaded:
            worst = int(np.argmin(energy))
            if -energy[worst] > self.excess_J:
                self.excess_J = -float(energy[worst])
                self._most_before_J = max(self._most_J, float(energy[: worst + 1].max()))
            self._most_J = max(self._most_J, float(energy.max()))
            self._beyond_doubt_J = max(self._beyond_doubt_J, -float((energy + doubt).min()))
        self._magnitude_J += float(np.abs(added_J).sum())
        self._since_J, self._travel_N = float(energy[-1]), float(travel[-1])
        self._last_N, self._last_x, self._resolution_m = force[-1], x[-1], float(seen[-1])
