"""The motion of a chain whose first body sticks and slips."""

from __future__ import annotations

from typing import Any

import numpy as np

from haploop.plant.chain.history import HELD, Interval
from haploop.plant.chain.motion import ChainMotion, follow
from haploop.plant.chain.transition import ChainTransition
from haploop.plant.friction.stick_slip import Friction, StickSlip, StickSlipState
from haploop.plant.friction.substeps import SubstepSolver, pieces_record
from haploop.plant.line.base import Hold
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase


class FrictionMotion(ChainMotion):
    """Exact transition between the instants at which friction switches, and these instants by halving the step.

    Body 0 slips in a direction +-1 under friction -direction F, or is stuck: then it is clamped, v is exactly 0.0 and
    x stays, while the rest of the chain follows the clamped system. It slips until v changes its sign; there it sticks
    if the other forces on it are within the breakaway force, else it slips where they pull. It is stuck until they
    exceed the breakaway force. An interval in which nothing switches is one linear motion, as without friction; any
    other, and every one of a scene too stiff or with too curved a law for that, is solved step by step.
    """

    held_names = (*HELD, "friction", "stuck")

    def __init__(self, scene: Scene, time: Timebase, members: int | None = None) -> None:
        assert scene.friction
        self.friction = Friction(scene.friction)
        super().__init__(scene, time, members)
        self._clamped = self._response(stuck=True)
        self._pieces: list[list[float]] = []
        free, clamped = (ChainTransition(self.chain, self._step_s, self._n, stuck) for stuck in (False, True))
        self._solver = SubstepSolver(self.chain, self._stick_slip, free, clamped, self._step_s)

    def _begun(self, z: np.ndarray) -> tuple[np.ndarray, StickSlipState | None]:
        self._stick_slip = StickSlip(self.chain, self.friction, self._step_s)
        mode = self._stick_slip.begin(z, float(self.loads(0, 1)[0]))
        friction = self._stick_slip.friction_at(mode, z[self._v])
        return np.array([0.0, -1.0, friction, float(mode.is_stuck)]), mode

    def _mode_of(self, mode: Any) -> StickSlipState:
        return StickSlipState(*mode)

    def advance(self, tick: int, holds: list[Hold]) -> Any:
        """Moves through interval ``tick`` under the forces held in it; returns x at its end, m."""
        interval, mode = self._begin(holds), self.state.mode
        loads = self.loads(tick * self._n, (tick + 1) * self._n + 1)
        step = 0
        assert mode
        while step < self._n:
            if self._solver.whole_steps:
                mode = self._stick_slip.decide_at_rest(mode, interval.states[step], interval.held[step, 0], loads[step])
                step = self._follow(mode, interval, step, holds, tick, loads)
            if step < self._n:
                mode = self._solve(mode, interval, step, tick, loads)
                step += 1
        return self._accept(tick, interval, mode)

    def _follow(
        self, mode: StickSlipState, interval: Interval, begin: int, holds: list[Hold], tick: int, loads: np.ndarray
    ) -> int:
        """Follows a mode from step ``begin`` on; returns the first step in which it does not hold."""
        friction = self._stick_slip.slipping(mode)
        follow(self._clamped if mode.is_stuck else self._free, interval, begin, holds, tick, friction)
        interval.held[begin:, 2:] = interval.at_ends[begin:] = friction, mode.is_stuck
        holds_through = self.holds_through(mode, interval, begin, friction, loads)
        return self._n if holds_through.all() else begin + int(holds_through.argmin())

    def holds_through(
        self, mode: StickSlipState, interval: Interval, begin: int, friction: Any, loads: np.ndarray
    ) -> np.ndarray:
        """Tells whether a mode holds throughout each step from ``begin`` on; in a batch on the last axis."""
        of, states, command = self._stick_slip, interval.states.swapaxes(0, 1), interval.held[begin:, 0]
        starts, ends, load, end_load = states[:, begin:-1], states[:, begin + 1 :], loads[begin:-1], loads[begin + 1 :]
        holds = of.holds_through(mode, ends, command, end_load)
        if mode.is_stuck:
            holds &= of.holds_through(mode, starts, command, load)
        return holds & ~of.may_switch_within(mode, starts, ends, command, load, end_load, friction, 1.0)

    def _solve(
        self, mode: StickSlipState, interval: Interval, step: int, tick: int, loads: np.ndarray
    ) -> StickSlipState:
        """Fills in one step, whatever happens in it; returns the mode at its end."""
        states, comps, held, at_ends = interval
        load, rise = float(loads[step]), float(loads[step + 1] - loads[step])
        number, command = tick * self._n + step, float(held[step, 0])
        mode, states[step + 1], comps[step + 1], held[step, 2], held[step, 3], pieces = self._solver.through(
            mode, number, states[step], comps[step], command, load, rise
        )
        self._pieces += pieces
        at_ends[step] = self._stick_slip.friction_at(mode, states[step + 1, self._v]), mode.is_stuck
        return mode

    def take_record(self, tick: int, *, positions_only: bool = False) -> dict[str, np.ndarray]:
        """Returns the record as without friction; the pieces of the steps within which friction switched, ``pieces.*``,
        come beside."""
        return super().take_record(tick, positions_only=positions_only) | self.take_pieces()

    def take_pieces(self) -> dict[str, np.ndarray]:
        """Returns the pieces of steps since the last call; see ``pieces_record``."""
        pieces, self._pieces = self._pieces, []
        return pieces_record(self.chain, pieces)

    def take_interval(self) -> Interval:
        """Returns the last interval, which is then in no record."""
        return self._done.pop()
