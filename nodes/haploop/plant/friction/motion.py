"""The motion of a chain whose first body sticks and slips."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from haploop.plant.chain.history import ChainState, Interval, StickSlipState
from haploop.plant.chain.motion import ChainMotion, follow
from haploop.plant.chain.transition import PIECE_TICKS, halves_of
from haploop.plant.friction.stick_slip import (
    Friction,
    RubbingHistory,
    StickSlip,
    creeps,
    decide_at_rest,
    holds_against,
    holds_through,
    may_switch_within,
    row_on,
    slipping,
    slipping_at,
)
from haploop.plant.friction.substeps import goes_by_whole_steps, halving_of, pieces_record, solve_step
from haploop.plant.line import Hold
from haploop.plant.where_it_pays import WhereItPays
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase

if TYPE_CHECKING:
    from haploop.plant.friction.course import Course
    from haploop.plant.friction.loops import Loops


# They pay from this many intervals in all.
LOOPS = WhereItPays("haploop.plant.friction.course", 20_000)


class FrictionMotion(RubbingHistory, ChainMotion):
    """Exact transition between the instants at which friction switches; halving the step finds these instants.

    Body 0 slips in a direction +-1 under friction -direction F, or is stuck: then it is clamped, v is exactly 0.0 and
    x stays, while the rest of the chain follows the clamped system. It slips until v changes sign; there it sticks if
    the other forces on it are within the breakaway force, or else slips in the direction of their pull; where it
    ``creeps``, it sticks, too. It is stuck until these forces exceed the breakaway force. An interval in which nothing
    switches is one linear motion, as without friction. Any other interval is solved step by step, and so is every
    interval of a scene that is too stiff, or has too curved a law of friction, for that.
    """

    _course: Course | None = None

    def __init__(self, scene: Scene, time: Timebase, *, by_loop: bool = True) -> None:
        super().__init__(scene, time)
        self._clamped = self._response(stuck=True)
        self._pieces: list[Any] = []
        self._piece = -1
        self.halving, self.goes_by_whole_steps = halving_of(self.chain, self._step_s), goes_by_whole_steps(scene)
        levels = self.halving.finest + 1
        self._tables = [halves_of(self.chain, self._step_s, levels, stuck) for stuck in (False, True)]
        if by_loop and (loops := loops_for([self], time.ticks)):
            self._course = LOOPS.module().Course(loops, self.friction, self._n)

    @property
    def state(self) -> ChainState:
        """The state at the end of the last interval; the motion continues from one that is set."""
        if self._is_behind and self._course:
            self._state, self._is_behind = self._course.end(self._sensed), False
        return self._state

    @state.setter
    def state(self, state: ChainState) -> None:
        self._state, self._sensed, self._is_behind = state, state.sensed, False
        if self._course:
            self._hand_over()
            self._course.row = -1

    def _hand_over(self) -> None:
        """Moves what is new in the course into the record."""
        if self._course:
            rows, pieces = self._course.take()
            if len(rows):
                self._done.append(Interval.of(rows, len(self.chain.states)))
            if len(pieces):
                self._pieces.append(pieces)

    def acceleration(self, _tick: int) -> Any:
        return self._sensed[0] if self._sensed else 0.0

    def rub_by(self, law: Friction) -> None:
        """Changes the law of friction to that of one member of a batch, for the calls that follow."""
        self.stick_slip = self.stick_slip._replace(law=law)

    def tables(self) -> tuple[np.ndarray, np.ndarray]:
        """Returns the transitions over h / 2^level, and those over 1 ... n steps, by whether body 0 is stuck."""
        return np.stack(self._tables), np.stack([of.held for of in (self._free, self._clamped)])

    def advance(self, tick: int, holds: list[Hold]) -> Any:
        if self._course and (x := self._by_loop(self._course, tick, holds)) is not None:
            return x
        loads = self.loads(tick * self._n, (tick + 1) * self._n + 1)
        forced = self._free.of_interval(tick), self._clamped.of_interval(tick)
        return self.advance_under(loads, forced, tick, holds)

    def advance_under(
        self, loads: np.ndarray, forced: tuple[np.ndarray, np.ndarray], tick: int, holds: list[Hold]
    ) -> Any:
        """Moves through an interval with NumPy, under given loads, shape (n + 1,), and their responses."""
        interval, mode = self._begin(holds), self.state.mode
        step = 0
        assert mode
        while step < self._n:
            if self.goes_by_whole_steps:
                mode = decide_at_rest(self.stick_slip, mode, interval.states[step], interval.held[step, 0], loads[step])
                step = self._follow(mode, interval, step, holds, loads, forced[mode.is_stuck])
            if step < self._n:
                mode = self._solve(mode, interval, step, tick, loads)
                step += 1
        return self._accept(tick, interval, mode)

    def _by_loop(self, course: Course, tick: int, holds: list[Hold]) -> float | None:
        """Returns x at the end of an interval moved by the loop; None where it cannot."""
        piece, at = divmod(tick, PIECE_TICKS)
        if piece != self._piece or course.row < 0:
            self._hand_over()
            first, self._piece = piece * PIECE_TICKS * self._n, piece
            forced = np.stack([self._free.of_piece(piece), self._clamped.of_piece(piece)], axis=1)
            course.begin(self.state, forced, self.loads(first, first + PIECE_TICKS * self._n + 1))
        x = course.advance(at, tick * self._n, holds)
        if x is None:  # perhaps the pieces of other intervals took all the room
            self._hand_over()
            if (x := course.advance(at, tick * self._n, holds)) is None:
                return None
        self._is_behind = True
        if self._sensed:
            self._sensed = self._sensor.after(self._sensed, *course.interval(), tick * self._n + 1)
        return x

    def _follow(
        self, mode: StickSlipState, interval: Interval, begin: int, holds: list[Hold], loads: np.ndarray,
        forced: np.ndarray,
    ) -> int:  # fmt: skip
        """Follows a mode from step ``begin`` on; returns the first step in which it does not hold."""
        friction = slipping(self.stick_slip, mode)
        follow((self._clamped if mode.is_stuck else self._free).held, forced, interval, begin, holds, friction)
        interval.held[begin:, 2:] = interval.at_ends[begin:] = friction, mode.is_stuck
        lasts = holds_in_steps(self.stick_slip, mode, interval, begin, friction, loads)
        return self._n if lasts.all() else begin + int(lasts.argmin())

    def _solve(
        self, mode: StickSlipState, interval: Interval, step: int, tick: int, loads: np.ndarray
    ) -> StickSlipState:
        """Fills in one step, whatever happens in it; returns the mode at its end."""
        _, states, comps, held, at_ends = interval
        load, rise = float(loads[step]), float(loads[step + 1] - loads[step])
        number, command = tick * self._n + step, float(held[step, 0])
        z, z_comp, *room = np.stack([states[step], comps[step]] * 2)
        mode, held[step, 2], held[step, 3] = solve_step(
            self.stick_slip, self.halving, self._tables, mode, number, z, z_comp, command, load, rise, self._pieces,
            *room,
        )  # fmt: skip
        states[step + 1], comps[step + 1] = z, z_comp
        at_ends[step] = slipping_at(self.stick_slip, mode, states[step + 1, self._v]), mode.is_stuck
        return mode

    def take_record(self, tick: int, *, positions_only: bool = False) -> dict[str, np.ndarray]:
        """Returns the record as without friction, and in addition the pieces of steps that were cut."""
        self._hand_over()
        pieces = pieces_record(self.chain, self.take_pieces())
        return super().take_record(tick, positions_only=positions_only) | pieces

    def take_pieces(self) -> list[Any]:
        """Returns the pieces of the steps within which friction switched; see ``pieces_record``."""
        pieces, self._pieces = self._pieces, []
        return pieces

    def take_interval(self) -> Interval:
        """Returns the last interval and removes it from the record."""
        return self._done.pop()

    def forget_record(self) -> None:
        self._hand_over()
        super().forget_record()
        self._pieces = []


def holds_in_steps(
    of: StickSlip, mode: StickSlipState, interval: Interval, begin: int, friction: Any, loads: np.ndarray
) -> np.ndarray:
    """Tells whether a mode holds throughout each step from ``begin`` on; in a batch, along the last axis."""
    states, command = interval.states.swapaxes(0, 1), interval.held[begin:, 0]
    starts, ends, load, end_load = states[:, begin:-1], states[:, begin + 1 :], loads[begin:-1], loads[begin + 1 :]
    holds = holds_through(of, mode, ends, command, end_load)
    if mode.is_stuck:
        holds &= holds_through(of, mode, starts, command, load)
    elif (slow := creeps(of, mode, ends[of.v])).any():
        holds &= ~(slow & holds_against(of.law, row_on(of.force, ends, command, end_load)))
    return holds & ~may_switch_within(of, mode, starts, ends, command, load, end_load, friction, 1.0)


def loops_for(devices: Sequence[FrictionMotion], intervals: int) -> Loops | None:
    """Returns machine-code loops for chains of these devices if they pay for so many intervals; else None."""
    if not (module := LOOPS.module_for(intervals)):
        return None
    one, (tables, held) = devices[0], map(np.stack, zip(*(device.tables() for device in devices), strict=True))
    of = [device.stick_slip for device in devices]
    return module.Loops(of, one.halving, one.goes_by_whole_steps, tables, held)
