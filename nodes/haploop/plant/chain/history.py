"""The states of a chain of bodies from one plant step to the next, and their record."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from haploop.plant.chain.chain import Chain
from haploop.plant.chain.sensed_acceleration import SensedAcceleration
from haploop.plant.line import Hold
from haploop.plant.motion.hand_force import make_hand_force
from haploop.protocol.arrays import first_row, rows_of
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
from haploop.protocol.trees import tree_select

HELD = ("force", "command")


class StickSlipState(NamedTuple):
    """Mode of the first body: stuck, or slipping in the direction +1.0 or -1.0 (stuck: the last one).

    In a batch both are arrays of shape (members,).
    """

    is_stuck: Any
    direction: Any


class ChainState(NamedTuple):
    """State of a chain at a tick; in a batch every array has one more axis, the last, for the members.

    Attributes:
        z: all states of the chain, shape (states,).
        z_comp: their compensation, the digits that rounding left over (compensated addition), shape (states,).
        held: force in N, command tick (and anything else) held last, shape (columns,).
        sensed: accelerations at the last plant steps that a delayed sensor has yet to report, m/s^2, the oldest first.
        mode: whether body 0 sticks or slips; None without friction.
    """

    z: np.ndarray
    z_comp: np.ndarray
    held: np.ndarray
    sensed: tuple[Any, ...]
    mode: StickSlipState | None = None


class Interval(NamedTuple):
    """Course of an interval; in a batch every array has one more axis, the last, for the members.

    Attributes:
        course: all of the following, side by side, shape (n + 1, columns); the row of the end has states alone.
        states, comps: the states and their compensation at every plant step and at the end, shape (n + 1, states).
        held: force, command tick (and anything else) held over every step, shape (n, columns).
        at_ends: friction in N and whether body 0 is stuck at the end of every step, shape (n, 2).
    """

    course: np.ndarray
    states: np.ndarray
    comps: np.ndarray
    held: np.ndarray
    at_ends: np.ndarray

    @classmethod
    def of(cls, course: np.ndarray, states: int) -> Interval:
        """Returns the parts of a course with this number of states."""
        of_steps = course[:-1, 2 * states :]
        return cls(course, course[:, :states], course[:, states : 2 * states], of_steps[:, :-2], of_steps[:, -2:])


class ChainHistory(ABC):
    """State and record of a chain; the classes derived from this one move it.

    It is made from the arguments of ``OneMassMotion`` and has its properties and methods.
    """

    held_names = HELD

    def __init__(self, scene: Scene, time: Timebase, members: int | None = None) -> None:
        self.chain = chain = Chain.from_scene(scene)
        self._n, self._v, self._step_s, self._members = time.steps_per_tick, chain.count, time.step_s, members
        self._tau = make_hand_force(scene, time.plant_rate, members)
        self._rest_N = chain.spring[0] * chain.spring[1]
        self._done: list[Interval] = []
        self._forces: list[Any] = []
        tail = [] if members is None else [members]
        z = chain.start_state(*tail)
        held, mode = self._begun(z)
        self._sensor = SensedAcceleration(scene, chain, time, self.loads, members)
        at_end = np.append(held[2:], np.zeros((2, *tail)), axis=0)[None, :2]
        sensed = self._sensor.after(self._sensor.none, np.stack([z, z]), held[:1], at_end, 0)
        self.state = ChainState(z, np.zeros_like(z), held, sensed, mode)

    def _begun(self, z: np.ndarray) -> tuple[np.ndarray, StickSlipState | None]:
        """Returns (what is held at the start, before any command has come, shape (columns,); the mode of friction)."""
        return np.multiply.outer([0.0, -1.0], np.ones(z.shape[1:])), None

    @property
    def x(self) -> Any:
        return first_row(self.state.z)

    @property
    def v(self) -> Any:
        return first_row(self.state.z[self._v :])

    @property
    def last(self) -> Hold:
        """The hold last in effect, with 0 for its steps."""
        return 0, first_row(self.state.held), int(self.state.held[1].flat[0])

    def restore(self, state: Any, _last: Any) -> None:
        """Continues from a state, whose arrays may be lists."""
        z, z_comp, held, sensed, mode = state
        arrays = np.array(z), np.array(z_comp), np.array(held)
        self.state = ChainState(*arrays, tuple(sensed), StickSlipState(*mode) if mode else None)

    def loads(self, first: int, last: int) -> np.ndarray:
        """Returns the load on the last body at the steps first ... last - 1, N."""
        return self._tau.at_steps(first, last) + self._rest_N

    def _begin(self, holds: list[Hold]) -> Interval:
        """Returns an interval with the start, and what is held in it, filled in."""
        z, z_comp, *_ = self.state
        size, first = len(z), 0
        course = np.empty((self._n + 1, 2 * size + len(self.held_names) + 2, *z.shape[1:]))
        course[0, :size], course[0, size : 2 * size], course[:, -2:] = z, z_comp, 0.0
        for count, force, command in holds:
            course[first : first + count, 2 * size] = force
            course[first : first + count, 2 * size + 1] = command
            first += count
        if self._members is not None:
            self._forces += [force for _, force, _ in holds]
        return Interval.of(course, size)

    @abstractmethod
    def advance(self, tick: int, holds: list[Hold]) -> Any:
        """Moves through interval ``tick`` under the forces held in it; returns x at its end, m."""

    def _accept(self, tick: int, interval: Interval, mode: StickSlipState | None = None) -> Any:
        """Accepts the interval as what happened; returns x at its end, m."""
        self._done.append(interval)
        _, states, comps, held, at_ends = interval
        sensed = self._sensor.after(self.state.sensed, states, held[:, 0], at_ends, tick * self._n + 1)
        self.state = ChainState(states[-1], comps[-1], held[-1], sensed, mode)
        return self.x

    def acceleration(self, _tick: int) -> Any:
        """Returns the acceleration felt at the present tick by a sensor with the scene's bandwidth and delay, m/s^2."""
        return self.state.sensed[0] if self.state.sensed else 0.0

    def take_record(self, tick: int, *, positions_only: bool = False) -> dict[str, np.ndarray]:
        """Returns the record as ``OneMassMotion`` does, of every state (of x alone with ``positions_only``).

        Its columns are the states, the compensation of each length (``*_low``), and what was held, by name.
        """
        done, self._done = self._done, []
        chain, (z, z_comp, held, *_) = self.chain, self.state
        states = _columns([one.states[:-1] for one in done], z, 1 if positions_only else len(z))
        record: dict[str, np.ndarray] = dict(zip(chain.states, states, strict=False))
        if not positions_only:
            comps = _columns([one.comps[:-1] for one in done], z_comp, chain.count)
            record |= {f"{name}_low": comp for name, comp in zip(chain.positions, comps, strict=True)}
        record |= zip(self.held_names, _columns([one.held for one in done], held, len(held)), strict=True)
        if self._members is not None:
            record["command"] = record["command"][:, 0]
            record["held_N"] = rows_of(self._forces, z.shape[-1])
            self._forces = []
        return record

    def forget_record(self) -> None:
        """Drops what ``take_record`` would return."""
        self._done, self._forces = [], []

    def select(self, kept: np.ndarray) -> None:
        self.state, self._rest_N = tree_select((self.state, self._rest_N), kept)
        self._tau.select(kept)
        self._sensor.select(kept)


def _columns(parts: list[np.ndarray], end: np.ndarray, count: int) -> Iterable[np.ndarray]:
    """Returns the first ``count`` columns of parts of shape (rows, columns[, members]), joined, and of their end.

    In a batch each column is contiguous.
    """
    if end.ndim == 1:
        return np.concatenate([*parts, end[None]]).T[:count]
    return (np.concatenate([*(part[:, at] for part in parts), end[at, None]]) for at in range(count))
