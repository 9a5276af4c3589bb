"""Device and hand as one mass, moved by the exact transition from one change of force to the next."""

from __future__ import annotations

from array import array
from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import Any, NamedTuple

import numpy as np

from haploop.plant.line.base import Hold
from haploop.plant.motion.forced_response import ForcedResponse
from haploop.plant.motion.hand_force import make_hand_force
from haploop.plant.motion.mechanics import Mechanics
from haploop.plant.motion.transition import make_foh_transition, make_zoh_transitions
from haploop.protocol.arrays import rows_of
from haploop.protocol.ticks import Timebase
from haploop.protocol.trees import tree_select

# What is noted of the beginning of a hold: count, x, v, x_comp, v_comp, force, command.
_NOTED = 7


class OneMassState(NamedTuple):
    """Position in m and velocity in m/s, and what rounding left of each (compensated addition).

    Floats, or arrays of shape (members,).
    """

    x: Any
    v: Any
    x_comp: Any
    v_comp: Any


def advance(over: Any, state: OneMassState, holds: Sequence[Hold], drive: Any) -> tuple[OneMassState, list[Any]]:
    """Moves one mass through an interval.

    Over a hold of i steps y+ = y + (e^{A i h} - I) y + (integral of e^{A s} ds) f / m, for floats, arrays of NumPy or
    of jax.

    Args:
        over: coefficients of ``make_zoh_transitions``, indexed by the number of steps.
        state: at the start of the interval.
        holds: forces held in the interval.
        drive: what the forced response adds to (x, v) by the end of the interval.

    Returns:
        The state at the end, and of every hold the seven entries (steps, x, v, x_comp, v_comp, force, command) at its
        beginning, one after the other.
    """
    x, v, x_comp, v_comp = state
    noted: list[Any] = []
    last = holds[-1]
    for hold in holds:
        count, force, command = hold
        noted += (count, x, v, x_comp, v_comp, force, command)
        x_x, x_v, x_force, v_x, v_v, v_force = over[count]
        dx = x_x * x + x_v * v + x_force * force + x_comp
        dv = v_x * x + v_v * v + v_force * force + v_comp
        if hold is last:
            drive_x, drive_v = drive
            dx += drive_x
            dv += drive_v
        next_x, next_v = x + dx, v + dv
        x_comp, v_comp = dx - (next_x - x), dv - (next_v - v)
        x, v = next_x, next_v
    return OneMassState(x, v, x_comp, v_comp), noted


def change_over(held: Any, response: Any, x: Any, v: Any, force: Any, comp: Any) -> Any:
    """Returns what the plant steps of holds add to x or v, from the beginning of each hold, one hold an interval.

    Args:
        held: coefficients of x, v and force over these steps, shape (steps, 3).
        response: the forced response at these steps of every interval, shape (intervals, steps).
        x, v: at the beginning of every hold, shape (intervals, 1).
        force: held, N, shape (intervals, 1).
        comp: what rounding left of x or v at the beginning, shape (intervals, 1).

    Returns:
        Shape (intervals, steps); all shapes may have one more axis, for the members of a batch.
    """
    return held[:, 0] * x + held[:, 1] * v + held[:, 2] * force + comp + response


class OneMassMotion:
    """m a + b v + k x = f + tau + k x_rest, f held, tau piecewise linear between plant steps.

    The motion is a sum z = y + D. D, the forced response to tau and the spring's rest from zero at the start of an
    interval, does not depend on the controller and is made beforehand for every plant step. y starts as z and follows
    the held forces. So a hold costs one step whatever its length, and the plant steps within it are filled in when
    they are recorded.

    Args:
        scene: a resolved scene; in a batch a stacked one, whose numbers are floats, or arrays of shape (members,).
        time: the integers of the run; in a batch those all members share, whose delay does not change.
        members: of a batch; None for one run.

    Attributes:
        mechanics: masses, dampers and spring.
        held: coefficients of ``make_zoh_transitions``; in a batch with a last axis, of length 1 where all share them.
        response: forced response.
        state: at the end of the last interval.
        last: hold in effect last.
    """

    def __init__(self, scene: dict[str, Any], time: Timebase, members: int | None = None) -> None:
        self.mechanics = m = Mechanics.from_scene(scene)
        self._steps = time.steps_per_tick
        system = m.mass_kg, m.damping, m.stiffness, time.step_s
        tau = make_hand_force(scene, time.plant_rate, members)
        self.response = ForcedResponse(make_foh_transition(*system), tau, m.stiffness * m.rest_m, self._steps)
        self.held = make_zoh_transitions(*system, self._steps)
        if members is None:
            self.state = OneMassState(*m.start, 0.0, 0.0)
        else:
            self.held = self.held[..., None] if self.held.ndim == 2 else self.held
            self.state = OneMassState(*(np.full(members, start) for start in (*m.start, 0.0, 0.0)))
        self.last: Hold = (0, 0.0, -1)
        self._noted: list[Any] = []
        self._prepare()

    def _prepare(self) -> None:
        rows = self.held.tolist() if self.held.ndim == 2 else self.held
        self._over = [tuple(row) for row in rows]
        self._ends: list[Any] = []
        self._ends_first = self._ends_last = 0

    @property
    def x(self) -> Any:
        """Position at the end of the last interval, m."""
        return self.state.x

    @property
    def v(self) -> Any:
        """Velocity at the end of the last interval, m/s."""
        return self.state.v

    def advance(self, tick: int, holds: list[Hold]) -> Any:
        """Moves through interval ``tick`` under the forces held in it; returns x at its end, m."""
        if not self._ends_first <= tick < self._ends_last:
            self._ends_first, self._ends = self.response.ends(tick)
            self._ends_last = self._ends_first + len(self._ends)
        self.state, noted = advance(self._over, self.state, holds, self._ends[tick - self._ends_first])
        self._noted += noted
        self.last = holds[-1]
        return self.state.x

    def acceleration(self, tick: int) -> Any:
        """Returns the acceleration at the present tick under the force held over the step that ends there, m/s^2."""
        step = tick * self._steps
        tau = self.response.tau.at_steps(step, step + 1)[0]
        return sensed_acceleration(self.mechanics, self.state, self.last[1], tau if tau.shape else float(tau))

    # The record of every plant step

    def take_record(self, tick: int, *, positions_only: bool = False) -> dict[str, np.ndarray]:
        """Returns the record from interval ``tick`` on, and starts a new one: every plant step and the present state.

        Its columns are x, v, x_low (x_comp), force and command.

        Args:
            tick: the first interval of the record.
            positions_only: leave v, x_low and force out.

        Returns:
            Shape (steps + 1,) each; in a batch (steps + 1, members), but for ``command``, which all members share,
            and beside them ``held_N``, the force of every hold, shape (holds, members).
        """
        noted, self._noted = self._noted, []
        width = self._width(noted, 0)
        cut = noted[:width:_NOTED]
        if noted[::_NOTED] == cut * (len(noted) // (width or 1)):
            parts = [self._filled(tick, cut, noted, positions_only)]
        else:
            parts = list(self._filled_by_cuts(tick, noted, positions_only))
        record = parts[0]
        if len(parts) > 1:
            record = {name: np.concatenate([*(part[name][:-1] for part in parts), [0.0]]) for name in record}
        end = {"x": self.state.x, "v": self.state.v, "x_low": self.state.x_comp}
        end |= {"force": self.last[1], "command": self.last[2]}
        for name in record.keys() & end.keys():
            record[name][-1] = end[name]
        return record

    def _width(self, noted: list[Any], at: int) -> int:
        """Returns the number of entries noted of the interval that begins at an entry."""
        steps, end = 0, at
        while steps < self._steps and end < len(noted):
            steps += noted[end]
            end += _NOTED
        return end - at

    def _filled_by_cuts(self, tick: int, noted: list[Any], positions_only: bool) -> Iterator[dict[str, np.ndarray]]:
        """Yields the records of all runs of intervals that are cut alike."""
        intervals, at = [], 0
        while at < len(noted):
            intervals.append(noted[at : at + self._width(noted, at)])
            at += len(intervals[-1])
        for cut, alike in groupby(intervals, key=lambda interval: interval[::_NOTED]):
            some = [entry for interval in alike for entry in interval]
            yield self._filled(tick, cut, some, positions_only)
            tick += len(some) // (_NOTED * len(cut))

    def _filled(self, tick: int, cut: list[int], noted: list[Any], positions_only: bool) -> dict[str, np.ndarray]:
        """Returns the record of intervals that are cut alike, from interval ``tick`` on, with room for its end.

        Step i of a hold that began at y is y plus the transition of i steps, plus the forced response. The i-th holds
        of all intervals are filled in at once. An interval begins with a known state: where the one before ended.
        """
        ticks, n, tail = len(noted) // (_NOTED * (len(cut) or 1)), self._steps, np.shape(self.state.x)
        response = self.response.between(tick, ticks)
        names = ("x",) if positions_only else ("x", "v", "x_low", "force")
        record = {name: np.empty((ticks * n + 1, *tail)) for name in names}
        columns = {name: column[:-1].reshape(ticks, n, *tail) for name, column in record.items()}
        command, forces, first = np.empty((ticks, n)), [], 0
        for index, count in enumerate(cut):
            x, v, x_comp, v_comp, force = (self._column(noted, len(cut), index, entry) for entry in range(1, 6))
            known, end = int(not first), first + count
            held, during = self.held[known:count], (slice(None), slice(first + known, end))
            dx = change_over(held[:, :3], response[(0, *during)], x, v, force, x_comp)
            at_x = np.add(x, dx, out=columns["x"][during])
            begin = {"x": x, "v": v, "x_low": x_comp}
            if not positions_only:
                dv = change_over(held[:, 3:], response[(1, *during)], x, v, force, v_comp)
                np.add(v, dv, out=columns["v"][during])
                np.subtract(dx, at_x - x, out=columns["x_low"][during])
                columns["force"][:, first:end] = force
            if known:
                for name in columns.keys() & begin.keys():
                    columns[name][:, :1] = begin[name]
            command[:, first:end] = np.array(noted[_NOTED * index + 6 :: _NOTED * len(cut)], float)[:, None]
            forces.append(force[:, 0])
            first = end
        record["command"] = np.append(command.ravel(), -1.0)
        return record | ({"held_N": np.concatenate(forces)} if tail else {})

    def _column(self, noted: list[Any], holds: int, index: int, entry: int) -> np.ndarray:
        """Returns an entry of the ``index``-th hold of every interval, shape (intervals, 1[, members])."""
        values = noted[_NOTED * index + entry :: _NOTED * holds]
        tail = np.shape(self.state.x)
        return rows_of(values, *tail)[:, None] if tail else np.frombuffer(array("d", values))[:, None]

    def select(self, kept: np.ndarray) -> None:
        """Drops the members of a batch that are not kept, shape (members,); the record must have been taken."""
        self.mechanics, self.held, self.state, self.last = tree_select(
            (self.mechanics, self.held, self.state, self.last), kept
        )
        self.response.select(kept)
        self._prepare()


def sensed_acceleration(mechanics: Mechanics, state: OneMassState, force: Any, tau: Any) -> Any:
    """Returns the acceleration in a state under a force of the actuator and one of the hand in N, m/s^2."""
    m = mechanics
    return (force + tau - m.damping * state.v - m.stiffness * (state.x - m.rest_m)) / m.mass_kg
