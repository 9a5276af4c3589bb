"""The motion of many chains whose first bodies stick and slip."""

from __future__ import annotations

from typing import Any

import numpy as np

from haploop.plant.chain.chain import Chain
from haploop.plant.chain.history import ChainState, Interval, StickSlipState
from haploop.plant.chain.motion import ChainMotion, follow
from haploop.plant.chain.transition import devices_of
from haploop.plant.friction.motion import FrictionMotion, holds_in_steps, loops_for
from haploop.plant.friction.stick_slip import RubbingHistory, StickSlip, holds_against, row_on, slipping
from haploop.plant.friction.substeps import pieces_record
from haploop.plant.line import Hold
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
from haploop.protocol.trees import tree_map, tree_member, tree_select, tree_take


class BatchFrictionMotion(RubbingHistory, ChainMotion):
    """``FrictionMotion`` of the members of a batch, whose numbers may all differ.

    In an interval all members first move as if nothing switched, those that stick and those that slip separately. For
    most, nothing does. For each of the others the interval is solved again by the motion of one run.
    """

    def __init__(self, scene: Scene, time: Timebase, members: int) -> None:
        places, self._device = devices_of(Chain.from_scene(scene), members)
        self._devices = [FrictionMotion(tree_member(scene, place), time, by_loop=False) for place in places]
        self._pieces: list[tuple[np.ndarray, np.ndarray]] = []
        super().__init__(scene, time, members)
        self.stick_slip = self._of_each([one.stick_slip for one in self._devices])._replace(law=self.friction)
        self._clamped = self._response(stuck=True)
        self._loops = loops_for(self._devices, time.ticks * members)

    def _of_each(self, of_devices: list[StickSlip]) -> StickSlip:
        """Returns the numbers of every member; raises ArithmeticError if a force has other terms in some devices."""

        def of_each(*numbers: Any) -> Any:
            return numbers[0] if len(set(numbers)) == 1 else np.array(numbers)[self._device]

        if len({tuple(i for row in (of.force, of.change) for i, _ in row.of_states) for of in of_devices}) > 1:
            raise ArithmeticError(
                "Devices with different states acting on their first bodies cannot be moved together."
            )
        return tree_map(of_each, *of_devices)

    def _device_of(self, place: int) -> FrictionMotion:
        """Returns the motion of one member's device, with its law of friction."""
        one = self._devices[self._device[place]]
        one.rub_by(tree_member(self.friction, place))
        return one

    def _begun(self, z: np.ndarray) -> tuple[np.ndarray, StickSlipState | None]:
        loads = np.broadcast_to(self.loads(0, 1)[0], z.shape[1:]).tolist()
        begun = []
        for place, (start, load) in enumerate(zip(z.T, loads, strict=True)):
            begun.append(self._device_of(place).begun_under(start, load))
        held, modes = zip(*begun, strict=True)
        return np.stack(held, axis=-1), StickSlipState(*map(np.array, zip(*modes, strict=True)))

    def advance(self, tick: int, holds: list[Hold]) -> Any:
        interval, loads = self._begin(holds), self.loads(tick * self._n, (tick + 1) * self._n + 1)
        forced = self._free.of_interval(tick), self._clamped.of_interval(tick)
        if self._loops and (mode := self.state.mode):
            modes = np.stack([mode.is_stuck, mode.direction])
            laws = np.stack(np.broadcast_arrays(*(np.atleast_1d(number) for number in self.friction)))
            found = self._loops.advance(
                interval.course, forced, loads, holds, tick * self._n, modes, laws, self._device
            )
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
        force, is_at_rest = row_on(self.stick_slip.force, z, interval.held[0, 0], loads[0]), z[self._v] == 0.0
        is_stuck = np.where(is_at_rest, holds_against(self.friction, force), mode.is_stuck)
        return is_stuck, np.where(is_at_rest, np.copysign(1.0, force), mode.direction)

    def _follow(
        self, mode: StickSlipState, interval: Interval, places: np.ndarray, holds: list[Hold], loads: np.ndarray,
        forced: np.ndarray,
    ) -> np.ndarray:  # fmt: skip
        """Moves some members, which all stick or all slip, in their mode; returns for which of them it holds."""
        some = Interval.of(np.ascontiguousarray(interval.course[..., places]), len(self.state.z))
        of, held = tree_take((self.stick_slip, (self._clamped if mode.is_stuck else self._free).held), places)
        friction = slipping(of, mode)
        follow(held, forced, some, 0, holds, friction)
        some.held[:, 2], some.held[:, 3] = friction, mode.is_stuck
        some.at_ends[:, 0], some.at_ends[:, 1] = friction, mode.is_stuck
        interval.course[..., places] = some.course
        return np.all(holds_in_steps(of, mode, some, 0, friction, loads), axis=0)

    def _solve(
        self, interval: Interval, place: int, tick: int, holds: list[Hold], loads: np.ndarray,
        forced: tuple[np.ndarray, np.ndarray],
    ) -> StickSlipState:  # fmt: skip
        """Moves one member through the interval alone; returns its mode at the end."""
        one, state = self._device_of(place), self.state
        held, mode = one.state.held, tree_member(state.mode, place)
        one.state = ChainState(state.z[:, place].copy(), state.z_comp[:, place].copy(), held, one.state.sensed, mode)
        one.advance_under(loads, forced, tick, holds)
        interval.course[..., place] = one.take_interval().course
        if pieces := one.take_pieces():
            self._pieces.append((np.full(len(pieces), place), np.array(pieces)))
        assert one.state.mode
        return one.state.mode

    def take_record(self, tick: int, *, positions_only: bool = False) -> dict[str, Any]:
        """Returns the record as without friction, and in addition ``pieces``, member by member.

        These are (members that have any, how many each has, ``pieces_record`` of all of them, joined).
        """
        pieces, self._pieces = self._pieces, []
        record = super().take_record(tick, positions_only=positions_only)
        if positions_only:
            return record
        members = np.concatenate([np.zeros(0, np.intp), *(of for of, _ in pieces)])
        order, counts = np.argsort(members, kind="stable"), np.bincount(members)
        tables = [np.concatenate([rows for _, rows in pieces])[order]] if pieces else []
        places = np.flatnonzero(counts)
        return record | {"pieces": (places, counts[places], pieces_record(self.chain, tables))}

    def forget_record(self) -> None:
        super().forget_record()
        self._pieces = []

    def select(self, kept: np.ndarray) -> None:
        super().select(kept)
        self._clamped.select(kept)
        self._device = self._device[kept]
        self.friction, self.stick_slip = tree_select((self.friction, self.stick_slip), kept)
