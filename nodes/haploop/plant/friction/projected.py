"""The motion of many chains under projected dry friction: one formula for all members, whatever they do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from haploop.plant.chain.motion import ChainMotion
from haploop.plant.line import Hold
from haploop.plant.where_it_pays import WhereItPays
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase

# They pay from this many ticks of members in all, which take NumPy half a second.
LOOPS = WhereItPays("haploop.plant.friction.projected_loops", 200_000)


class ProjectedFrictionMotion(ChainMotion):
    """Exact transition over every plant step under friction f = -clip(v_free / g, -F(v), F(v)), held over the step.

    v_free is the velocity of body 0 at the end of the step without friction, g what a unit of friction adds to it.
    Where f is enough, v is exactly 0.0, and a body that was at rest keeps its place to the bit. Stops and starts fall
    on plant steps, an error of order h in their times. In return members may differ in every number, those of bodies
    and friction included, and one that chatters costs no more than one at rest. The motion is made for searches and
    keeps no record; ``BatchFrictionMotion`` instead solves every stop exactly, member by member.

    Args:
        scene: the stacked scene of the members.
        kinetic, breakaway, stribeck: F(v) of each member, as in ``Friction``: N, N, m/s, shape (members,); a Stribeck
            velocity is infinite where F is the same at every speed.
    """

    def __init__(
        self, scene: Scene, time: Timebase, members: int, kinetic: np.ndarray, breakaway: np.ndarray,
        stribeck: np.ndarray,
    ) -> None:  # fmt: skip
        super().__init__(replace(scene, friction=None), time, members)
        self._law = np.stack([kinetic, breakaway, stribeck])
        self._set_up()

    def _set_up(self) -> None:
        size, members = self.state.z.shape
        self._is_constant = bool((self._law[0] == self._law[1]).all())
        step = np.broadcast_to(self._free.step, (size + 4, size, members))
        self._moves, self._of_friction = np.delete(step, size + 1, axis=0), step[size + 1].copy()

    def _most(self, speed: np.ndarray) -> np.ndarray:
        """Returns F(v), N."""
        kinetic, breakaway, stribeck = self._law
        if self._is_constant:
            return kinetic
        more = np.where(np.isfinite(stribeck), np.exp(-((speed / stribeck) ** 2)), 0.0)
        return np.where(speed == 0.0, breakaway, kinetic + (breakaway - kinetic) * more)

    @classmethod
    def of(cls, scenes: Sequence[Scene], scene: Scene, time: Timebase) -> ProjectedFrictionMotion:
        """Makes the motion of scenes with friction; ``scene`` is all of them stacked."""
        tables = [one.friction for one in scenes if one.friction]
        kinetic = np.array([table.kinetic for table in tables])
        breakaway = np.array([table.kinetic if table.breakaway is None else table.breakaway for table in tables])
        return cls(scene, time, len(scenes), kinetic, breakaway,
                   np.array([table.stribeck_velocity or np.inf for table in tables]))  # fmt: skip

    def advance(self, tick: int, holds: list[Hold]) -> Any:
        z, n, loads = self.state.z, self._n, self.loads(tick * self._n, (tick + 1) * self._n + 1)
        states, held, at_ends = np.empty((n + 1, *z.shape)), np.empty((n, z.shape[1])), np.empty((n, 2, z.shape[1]))
        states[0], first = z, 0
        for count, force, _ in holds:
            held[first : first + count] = force
            first += count
        if loops := self._is_constant and LOOPS.module_for(z.shape[1]):
            loops.move(self._moves, self._of_friction, self._law[0], self._v, loads, held, states, at_ends)
        else:
            self._move(loads, held, states, at_ends)
        sensed = self._sensor.after(self.state.sensed, states, held, at_ends, tick * n + 1)
        self.state = self.state._replace(z=states[-1], sensed=sensed)
        return self.x

    def _move(self, loads: np.ndarray, held: np.ndarray, states: np.ndarray, at_ends: np.ndarray) -> None:
        """Fills in the states at the end of every step, and friction in N and whether body 0 stops there."""
        (size, members), v = states.shape[1:], self._v
        acting, acted = np.empty((size + 3, 1, members)), np.empty((size + 3, size, members))
        for i, z in enumerate(states[:-1]):
            acting[:size, 0], acting[size], acting[-2], acting[-1] = z, held[i], loads[i], loads[i + 1] - loads[i]
            after = np.add.reduce(np.multiply(self._moves, acting, out=acted), out=states[i + 1])
            after += z
            most = self._most(z[v])
            needed = after[v] / -self._of_friction[v]
            friction = np.minimum(np.maximum(needed, -most), most)
            after += self._of_friction * friction
            stops = friction == needed
            after[v][stops] = 0.0
            np.copyto(after[0], z[0], where=stops & (z[v] == 0.0))
            at_ends[i] = np.where(stops, 0.0, friction), stops

    def select(self, kept: np.ndarray) -> None:
        super().select(kept)
        self._law = self._law[:, kept]
        self._set_up()
