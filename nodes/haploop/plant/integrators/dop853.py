"""The motion of a chain of bodies by scipy's DOP853, from one change of force to the next."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from haploop.plant.chain.chain import Chain
from haploop.plant.chain.history import ChainHistory, Interval
from haploop.plant.line import Hold
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase

Rates = Callable[[float, np.ndarray], np.ndarray]
Event = Callable[[float, np.ndarray], float]
# Relative tolerance of a step, and the speed that counts as rest for it, m/s.
_TOLERANCE, _STILL_M_S = 1e-10, 1e-3


class Dop853Motion(ChainHistory):
    """z' = A z + B (command, friction, load) by an explicit Runge-Kutta method of order 8 with steps of its own choice.

    The method is that of Dormand and Prince, at a relative tolerance of 1e-10 a step (Hairer, Norsett and Wanner 1993,
    II.10). It restarts where a force or its slope changes; plant steps are read off its dense output. The error is that
    of the tolerance, whatever ``clock.plant_rate``. Digits below the rounding of a float are not kept.
    """

    _mode: Any = None  # of friction

    def __init__(self, scene: Scene, time: Timebase) -> None:
        super().__init__(scene, time)
        self._free = System(self.chain, stuck=False)
        self._absolute = (_TOLERANCE * _STILL_M_S / self.chain.scales(self._step_s)[: len(self.state.z)]).astype(float)

    def advance(self, tick: int, holds: list[Hold]) -> float:
        interval = self._begin(holds)
        interval.comps[:] = 0.0
        loads = self.loads(tick * self._n, (tick + 1) * self._n + 1)
        bends = np.abs(np.diff(loads, 2)) > 1e-12 * np.abs(loads).max()
        cuts = np.flatnonzero(bends | (np.diff(interval.held[:, 0]) != 0.0)) + 1
        for first, last in zip([0, *cuts.tolist()], [*cuts.tolist(), self._n], strict=True):
            slope = float(loads[last] - loads[first]) / ((last - first) * self._step_s)
            self._through(interval, first, last, float(loads[first]), slope)
        return self._accept(tick, interval, self._mode)

    def _through(self, interval: Interval, first: int, last: int, load: float, slope: float) -> None:
        """Moves through steps ``first`` ... ``last`` under one command, while the load (N) rises by ``slope`` N/s."""
        rates = self._free.under(float(interval.held[first, 0]), load, slope, first * self._step_s)
        ends = np.arange(first + 1, last + 1) * self._step_s
        found = self._solved(rates, (first * self._step_s, ends[-1]), interval.states[first], ends)
        interval.states[first + 1 : last + 1] = found.y.T

    def _solved(
        self, rates: Rates, span: tuple[float, float], z: np.ndarray, ends: np.ndarray, events: Sequence[Event] = ()
    ) -> Any:
        """Returns the motion over a span of time in s, with the states at ``ends``.

        Raises ArithmeticError if the steps become too small to continue.
        """
        from scipy.integrate import solve_ivp  # half a second to import

        found = solve_ivp(
            rates, span, z, "DOP853", t_eval=ends, events=events or None, rtol=_TOLERANCE, atol=self._absolute
        )
        if found.status < 0:
            raise ArithmeticError(f"DOP853 could not continue: {found.message}")
        return found


class System:
    """The rates of a chain in the form that ``solve_ivp`` asks for."""

    def __init__(self, chain: Chain, stuck: bool) -> None:
        size, rates = len(chain.states), chain.rates(stuck).astype(float)
        self._matrix = np.ascontiguousarray(rates[:, :size])
        self._of_command, self.of_friction, self._of_load = rates[:, size:].T.copy()

    def under(self, command: float, load: float, slope: float, start: float) -> Rates:
        """Returns z' as a function of (t, z), under a held command and load + slope (t - start)."""
        matrix, rise = self._matrix, slope * self._of_load
        push = command * self._of_command + load * self._of_load - start * rise
        return lambda t, z: matrix @ z + push + t * rise
