"""The motion of a chain whose first body sticks and slips, alone and in a batch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from haploop.plant.chain.history import ChainState, Interval, StickSlipState
from haploop.plant.chain.motion import ChainMotion, follow
from haploop.plant.chain.transition import PIECE_TICKS, ChainTransition
from haploop.plant.friction.stick_slip import (
    Friction,
    RubbingHistory,
    StickSlip,
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
from haploop.protocol.trees import tree_member, tree_select, tree_take

if TYPE_CHECKING:
    from haploop.plant.friction.loops import Loops


# For so many intervals in all.
LOOPS = WhereItPays("haploop.plant.friction.loops", 20_000)


class FrictionMotion(RubbingHistory, ChainMotion):
    """Exact transition between the instants at which friction switches, and these instants by halving the step.

    Body 0 slips in a direction +-1 under friction -direction F, or is stuck: then it is clamped, v is exactly 0.0 and
    x stays, while the rest of the chain follows the clamped system. It slips until v changes its sign; there it sticks
    if the other forces on it are within the breakaway force, else it slips where they pull. It is stuck until they
    exceed the breakaway force. An interval in which nothing switches is one linear motion, as without friction; any
    other, and every one of a scene too stiff or with too curved a law for that, is solved step by step.
    """

    def __init__(self, scene: Scene, time: Timebase) -> None:
        super().__init__(scene, time)
        self._clamped = self._response(stuck=True)
        self._pieces: list[Any] = []
        self._piece, self._ahead = -1, list[np.ndarray]()
        self._halving, self._whole_steps = halving_of(self.chain, self._step_s), goes_by_whole_steps(scene)
        levels = self._halving.finest + 1
        self._tables = [
            ChainTransition(self.chain, self._step_s, self._n, stuck).halves(levels) for stuck in (False, True)
        ]
        self._loops, self._laws = self.loops_for(time.ticks), np.array(self.friction)[:, None]

    def rub_by(self, law: Friction) -> StickSlip:
        """Goes on by another law: of one member of a batch, or of some, for what is asked of them next."""
        self._stick_slip = self._stick_slip._replace(law=law)
        return self._stick_slip

    def loops_for(self, intervals: int) -> Loops | None:
        """Returns loops of machine code where they pay for so many intervals; they serve a batch of this chain, too."""
        if not (module := LOOPS.module_for(intervals)):
            return None
        held = np.stack([of.held for of in (self._free, self._clamped)])
        return module.Loops(self._stick_slip, self._halving, self._whole_steps, np.stack(self._tables), held)

    def advance(self, tick: int, holds: list[Hold]) -> Any:
        if self._loops and (found := self._by_loops(self._loops, tick, holds)):
            return self._accept(tick, *found)
        loads = self.loads(tick * self._n, (tick + 1) * self._n + 1)
        return self.advance_under(loads, self._forced(tick), tick, holds)

    def _forced(self, tick: int) -> tuple[np.ndarray, np.ndarray]:
        """Returns the forced response of interval ``tick`` while the first body slips, and while it is stuck."""
        return self._free.of_interval(tick), self._clamped.of_interval(tick)

    def advance_under(
        self, loads: np.ndarray, forced: tuple[np.ndarray, np.ndarray], tick: int, holds: list[Hold]
    ) -> Any:
        """Moves through an interval by NumPy, under given loads, shape (n + 1,), and their responses."""
        interval, mode = self._begin(holds), self.state.mode
        step = 0
        assert mode
        while step < self._n:
            if self._whole_steps:
                mode = decide_at_rest(
                    self._stick_slip, mode, interval.states[step], interval.held[step, 0], loads[step]
                )
                step = self._follow(mode, interval, step, holds, loads, forced[mode.is_stuck])
            if step < self._n:
                mode = self._solve(mode, interval, step, tick, loads)
                step += 1
        return self._accept(tick, interval, mode)

    def _by_loops(self, loops: Loops, tick: int, holds: list[Hold]) -> tuple[Interval, StickSlipState] | None:
        """Returns the interval by loops of machine code, and the mode at its end; None where they cannot."""
        interval, mode, n, (piece, at) = self._begin(holds), self.state.mode, self._n, divmod(tick, PIECE_TICKS)
        assert mode
        if piece != self._piece:
            first = piece * PIECE_TICKS * n
            loads = self.loads(first, first + PIECE_TICKS * n + 1)
            self._piece, self._ahead = (
                piece,
                [of[..., None] for of in (self._free.of_piece(piece), self._clamped.of_piece(piece), loads)],
            )
        free, clamped, loads = self._ahead
        of_this = (free[at], clamped[at]), loads[at * n : (at + 1) * n + 1]
        modes = np.array(((mode.is_stuck,), (mode.direction,)), float)
        pieces = loops.advance(interval.course[..., None], *of_this, holds, tick * n, modes, self._laws)
        if pieces is None:
            return None
        self._pieces += [rows for _, rows in pieces]
        return interval, StickSlipState(modes.item(0) > 0.0, modes.item(1))

    def _follow(
        self, mode: StickSlipState, interval: Interval, begin: int, holds: list[Hold], loads: np.ndarray,
        forced: np.ndarray,
    ) -> int:  # fmt: skip
        """Follows a mode from step ``begin`` on; returns the first step in which it does not hold."""
        friction = slipping(self._stick_slip, mode)
        follow((self._clamped if mode.is_stuck else self._free).held, forced, interval, begin, holds, friction)
        interval.held[begin:, 2:] = interval.at_ends[begin:] = friction, mode.is_stuck
        lasts = self.holds_in_steps(mode, interval, begin, friction, loads)
        return self._n if lasts.all() else begin + int(lasts.argmin())

    def holds_in_steps(
        self, mode: StickSlipState, interval: Interval, begin: int, friction: Any, loads: np.ndarray
    ) -> np.ndarray:
        """Tells whether a mode holds throughout each step from ``begin`` on; in a batch on the last axis."""
        of, states, command = self._stick_slip, interval.states.swapaxes(0, 1), interval.held[begin:, 0]
        starts, ends, load, end_load = states[:, begin:-1], states[:, begin + 1 :], loads[begin:-1], loads[begin + 1 :]
        holds = holds_through(of, mode, ends, command, end_load)
        if mode.is_stuck:
            holds &= holds_through(of, mode, starts, command, load)
        return holds & ~may_switch_within(of, mode, starts, ends, command, load, end_load, friction, 1.0)

    def _solve(
        self, mode: StickSlipState, interval: Interval, step: int, tick: int, loads: np.ndarray
    ) -> StickSlipState:
        """Fills in one step, whatever happens in it; returns the mode at its end."""
        _, states, comps, held, at_ends = interval
        load, rise = float(loads[step]), float(loads[step + 1] - loads[step])
        number, command = tick * self._n + step, float(held[step, 0])
        z, z_comp, *room = np.stack([states[step], comps[step]] * 2)
        mode, held[step, 2], held[step, 3] = solve_step(
            self._stick_slip, self._halving, self._tables, mode, number, z, z_comp, command, load, rise, self._pieces,
            *room,
        )  # fmt: skip
        states[step + 1], comps[step + 1] = z, z_comp
        at_ends[step] = slipping_at(self._stick_slip, mode, states[step + 1, self._v]), mode.is_stuck
        return mode

    def take_record(self, tick: int, *, positions_only: bool = False) -> dict[str, np.ndarray]:
        """Returns the record as without friction, and beside it the pieces of steps that were cut."""
        pieces = pieces_record(self.chain, self.take_pieces())
        return super().take_record(tick, positions_only=positions_only) | pieces

    def take_pieces(self) -> list[Any]:
        """Returns the pieces of the steps within which friction switched; see ``pieces_record``."""
        pieces, self._pieces = self._pieces, []
        return pieces

    def take_interval(self) -> Interval:
        """Returns the last interval, which is then in no record."""
        return self._done.pop()


class BatchFrictionMotion(RubbingHistory, ChainMotion):
    """``FrictionMotion`` of the members of a batch with the same chain; loads and what friction measures may differ.

    In an interval all members go as far as they would if nothing switched, those that stick and those that slip apart.
    Most do. For each of the others the interval is solved anew by the motion of one run.
    """

    def __init__(self, scene: Scene, time: Timebase, members: int) -> None:
        self._one = FrictionMotion(tree_member(scene, 0), time)
        self._pieces: list[tuple[int, Any]] = []
        super().__init__(scene, time, members)
        self._stick_slip = StickSlip.of(self.chain, self.friction, self._step_s)
        self._clamped = self._response(stuck=True)
        self._loops = self._one.loops_for(time.ticks * members)

    def _begun(self, z: np.ndarray) -> tuple[np.ndarray, StickSlipState | None]:
        loads = np.broadcast_to(self.loads(0, 1)[0], z.shape[1:]).tolist()
        begun = []
        for place, (start, load) in enumerate(zip(z.T, loads, strict=True)):
            self._one.rub_by(tree_member(self.friction, place))
            begun.append(self._one.begun_under(start, load))
        held, modes = zip(*begun, strict=True)
        return np.stack(held, axis=-1), StickSlipState(*map(np.array, zip(*modes, strict=True)))

    def advance(self, tick: int, holds: list[Hold]) -> Any:
        interval, loads = self._begin(holds), self.loads(tick * self._n, (tick + 1) * self._n + 1)
        forced = self._free.of_interval(tick), self._clamped.of_interval(tick)
        if self._loops and (mode := self.state.mode):
            modes = np.stack([mode.is_stuck, mode.direction])
            laws = np.stack(np.broadcast_arrays(*(np.atleast_1d(number) for number in self.friction)))
            found = self._loops.advance(interval.course, forced, loads, holds, tick * self._n, modes, laws)
            if found is not None:
                self._pieces += found
                return self._accept(tick, interval, StickSlipState(modes[0] > 0.0, modes[1]))
        is_stuck, direction = self._decided(interval, loads)
        lasts = np.empty(is_stuck.shape, bool)
        for kind in (False, True):
            places = np.flatnonzero(is_stuck == kind)
            if len(places):
                mode = StickSlipState(kind, direction[places])
                of_these = tree_take((loads, forced[kind]), places)
                lasts[places] = self._follow(mode, interval, places, tree_take(holds, places), *of_these)
        for place in np.flatnonzero(~lasts).tolist():
            of_this = tree_member((loads, forced), place)
            is_stuck[place], direction[place] = self._solve(interval, place, tick, tree_member(holds, place), *of_this)
        return self._accept(tick, interval, StickSlipState(is_stuck, direction))

    def _decided(self, interval: Interval, loads: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns the modes at the beginning; see ``decide_at_rest``."""
        z, mode = interval.states[0], self.state.mode
        assert mode
        force, is_at_rest = row_on(self._stick_slip.force, z, interval.held[0, 0], loads[0]), z[self._v] == 0.0
        is_stuck = np.where(is_at_rest, holds_against(self.friction, force), mode.is_stuck)
        return is_stuck, np.where(is_at_rest, np.copysign(1.0, force), mode.direction)

    def _follow(
        self, mode: StickSlipState, interval: Interval, places: np.ndarray, holds: list[Hold], loads: np.ndarray,
        forced: np.ndarray,
    ) -> np.ndarray:  # fmt: skip
        """Lets some members, of which all stick or all slip, follow their mode; returns which of them it holds for."""
        some = Interval.of(np.ascontiguousarray(interval.course[..., places]), len(self.state.z))
        friction = slipping(self._one.rub_by(tree_take(self.friction, places)), mode)
        follow((self._clamped if mode.is_stuck else self._free).held, forced, some, 0, holds, friction)
        some.held[:, 2], some.held[:, 3] = friction, mode.is_stuck
        some.at_ends[:, 0], some.at_ends[:, 1] = friction, mode.is_stuck
        interval.course[..., places] = some.course
        return np.all(self._one.holds_in_steps(mode, some, 0, friction, loads), axis=0)

    def _solve(
        self, interval: Interval, place: int, tick: int, holds: list[Hold], loads: np.ndarray,
        forced: tuple[np.ndarray, np.ndarray],
    ) -> StickSlipState:  # fmt: skip
        """Takes one member through the interval alone; returns its mode at the end."""
        one, state = self._one, self.state
        one.rub_by(tree_member(self.friction, place))
        held, mode = one.state.held, tree_member(state.mode, place)
        one.state = ChainState(state.z[:, place].copy(), state.z_comp[:, place].copy(), held, one.state.sensed, mode)
        one.advance_under(loads, forced, tick, holds)
        interval.course[..., place] = one.take_interval().course
        if pieces := one.take_pieces():
            self._pieces.append((place, np.array(pieces)))
        assert one.state.mode
        return one.state.mode

    def take_record(self, tick: int, *, positions_only: bool = False) -> dict[str, Any]:
        """Returns the record as without friction, and beside it ``pieces``, member by member.

        These are (members that have any, how many each, ``pieces_record`` of all of them one after the other).
        """
        pieces, self._pieces = sorted(self._pieces, key=lambda piece: piece[0]), []
        record = super().take_record(tick, positions_only=positions_only)
        if positions_only:
            return record
        members, tables = np.array([place for place, _ in pieces], np.intp), [rows for _, rows in pieces]
        counts = np.bincount(members, [len(rows) for rows in tables]).astype(np.intp)
        places = np.flatnonzero(counts)
        return record | {"pieces": (places, counts[places], pieces_record(self.chain, tables))}

    def forget_record(self) -> None:
        super().forget_record()
        self._pieces = []

    def select(self, kept: np.ndarray) -> None:
        super().select(kept)
        self._clamped.select(kept)
        self.friction = tree_select(self.friction, kept)
