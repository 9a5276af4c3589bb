"""Device and hand as one mass, moved by the exact transition from one change of force to the next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from haploop.plant.line import Hold
from haploop.plant.motion.forced_response import ForcedResponse
from haploop.plant.motion.hand_force import make_hand_force
from haploop.plant.motion.record import Fill, record_of_holds
from haploop.plant.motion.transition import make_foh_transition, make_zoh_transitions
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
from haploop.protocol.trees import tree_select


@dataclass(frozen=True)
class Mechanics:
    """The device with the hand rigidly attached (Choi et al. 2022, eq. 10 and 11 added), or the device alone.

    Attributes:
        dampers: physical dampers by name, N s/m; their sum is b.
        stiffness, rest_m: k_h, N/m; x_rest.
        start: initial position in m and velocity in m/s.
    """

    mass_kg: float
    dampers: dict[str, float]
    stiffness: float
    rest_m: float
    start: tuple[float, float]

    @classmethod
    def from_scene(cls, scene: Scene) -> Mechanics:
        device, hand = scene.device, scene.hand
        start = device.position, device.velocity
        if hand is None:
            return cls(device.mass, {"device": device.damping}, 0.0, 0.0, start)
        dampers = {"device": device.damping, "hand": hand.damping}
        return cls(device.mass + hand.mass, dampers, hand.stiffness, hand.rest, start)

    @property
    def damping(self) -> float:
        """b, N s/m."""
        return sum(self.dampers.values())

    def kinetic_J(self, v):
        """Kinetic energy at velocity v (m/s)."""
        return 0.5 * self.mass_kg * v * v

    def spring_J(self, x):
        """Energy in the hand's spring at position x (m)."""
        return 0.5 * self.stiffness * (x - self.rest_m) * (x - self.rest_m)


class OneMassState(NamedTuple):
    """Position in m and velocity in m/s, and the digits that rounding left over of each (compensated addition).

    Floats, or arrays of shape (members,).
    """

    x: Any
    v: Any
    x_comp: Any
    v_comp: Any


def advance(over: Any, state: tuple[Any, ...], holds: Sequence[Hold], drive: Any, noted: list[Any]) -> tuple[Any, ...]:
    """Moves one mass through an interval: returns the entries of ``OneMassState`` at its end.

    Over a hold of i steps y+ = y + (e^{A i h} - I) y + (integral of e^{A s} ds) f / m, for floats, and for arrays of
    NumPy or jax.

    Args:
        over: coefficients of ``make_zoh_transitions``, indexed by the number of steps.
        drive: what the forced response adds to (x, v) by the end of the interval.
        noted: receives seven entries for every hold: steps, x, v, x_comp and v_comp at its beginning, force, command.
    """
    x, v, x_comp, v_comp = state
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
    return x, v, x_comp, v_comp


class OneMassMotion:
    """m a + b v + k x = f + tau + k x_rest, f held, tau piecewise linear between plant steps.

    The motion is a sum z = y + D. D, the forced response to tau and the spring's rest position from zero at the start
    of an interval, does not depend on the controller and is computed beforehand for every plant step. y starts equal to
    z and follows the held forces. A hold thus costs one step whatever its length, and the plant steps within it are
    filled in when they are recorded.

    Args:
        scene: a resolved scene; in a batch a stacked one, whose numbers are floats, or arrays of shape (members,).
        time: the timebase of the run; in a batch the one that all members share, whose delay does not change.
        members: of a batch; None for one run.

    Attributes:
        held: coefficients of ``make_zoh_transitions``; in a batch with a last axis, of length 1 if all share them.
        fill: fills in the record of a batch in place of ``fill_steps``.
    """

    fill: Fill | None = None

    def __init__(self, scene: Scene, time: Timebase, members: int | None = None) -> None:
        self.mechanics = m = Mechanics.from_scene(scene)
        self._steps = time.steps_per_tick
        system = m.mass_kg, m.damping, m.stiffness, time.step_s
        tau = make_hand_force(scene, time.plant_rate, members)
        self.response = ForcedResponse(make_foh_transition(*system), tau, m.stiffness * m.rest_m, self._steps)
        self.held = make_zoh_transitions(*system, self._steps)
        self._state: tuple[Any, ...] = (*m.start, 0.0, 0.0)
        if members is not None:
            self.held = self.held[..., None] if self.held.ndim == 2 else self.held
            self._state = tuple(np.full(members, start) for start in self._state)
        self.last: Hold = (0, 0.0, -1)
        self._noted: list[Any] = []
        self._prepare()

    def _prepare(self) -> None:
        rows = self.held.tolist() if self.held.ndim == 2 else self.held
        self._over = [tuple(row) for row in rows]
        self._ends: list[Any] = []
        self._ends_first = self._ends_last = 0

    @property
    def state(self) -> OneMassState:
        return OneMassState(*self._state)

    @state.setter
    def state(self, state: OneMassState) -> None:
        self._state, self._ends_last = tuple(state), 0

    @property
    def x(self) -> Any:
        return self._state[0]

    @property
    def v(self) -> Any:
        return self._state[1]

    def restore(self, state: Sequence[Any], last: Sequence[Any]) -> None:
        count, force, command = last
        self.state, self.last = OneMassState(*state), (count, force, command)

    def advance(self, tick: int, holds: list[Hold]) -> Any:
        """Moves through interval ``tick`` under the forces held in it; returns x at its end, m."""
        if tick >= self._ends_last:
            self._ends_first, self._ends = self.response.ends(tick)
            self._ends_last = self._ends_first + len(self._ends)
        drive = self._ends[tick - self._ends_first]
        self._state = state = advance(self._over, self._state, holds, drive, self._noted)
        self.last = holds[-1]
        return state[0]

    def acceleration(self, tick: int) -> Any:
        """Returns the acceleration at the present tick under the force held over the step that ends there, m/s^2."""
        step = tick * self._steps
        tau = self.response.tau.at_steps(step, step + 1)[0]
        return sensed_acceleration(self.mechanics, self.state, self.last[1], tau if tau.shape else float(tau))

    def take_record(self, tick: int, *, positions_only: bool = False) -> dict[str, np.ndarray]:
        """Returns the record from interval ``tick`` on, and starts a new one: every plant step and the present state.

        Returns:
            x, v, x_low (x_comp), force and command; x and command alone with ``positions_only``; shape (steps + 1,)
            each. In a batch (steps + 1, members), except ``command``, which all members share, and in addition
            ``held_N``, the force of every hold, shape (holds, members).
        """
        noted, self._noted = self._noted, []
        held, response, tail = self.held, self.response, np.shape(self._state[0])
        record = record_of_holds(noted, held, response, tick, tail, positions_only=positions_only, fill=self.fill)
        (x, v, x_comp, _), (_, force, command) = self._state, self.last
        for name, end in (("x", x), ("v", v), ("x_low", x_comp), ("force", force), ("command", command)):
            if name in record:
                record[name][-1] = end
        return record

    def forget_record(self) -> None:
        """Drops what ``take_record`` would return."""
        self._noted = []

    def select(self, kept: np.ndarray) -> None:
        self.mechanics, self.held, self.state, self.last = tree_select(
            (self.mechanics, self.held, self.state, self.last), kept
        )
        self.response.select(kept)
        self._prepare()


def sensed_acceleration(mechanics: Mechanics, state: OneMassState, force: Any, tau: Any) -> Any:
    """Returns the acceleration in a state, m/s^2, under a force of the actuator and one of the hand, N."""
    m = mechanics
    return (force + tau - m.damping * state.v - m.stiffness * (state.x - m.rest_m)) / m.mass_kg
