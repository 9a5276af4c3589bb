"""One tick of many loops as a function of numbers alone: the loop's own objects, run on a compiler's placeholders."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from haploop.controller.controller import Controller
from haploop.controller.recorder import BatchRecorder
from haploop.launch.batch.jax.rows import Rows
from haploop.launch.batch.jax.stand_ins import Outside, rounded
from haploop.launch.batch.jax.state import Leaves
from haploop.logger.books.one_mass import OneMassBooks
from haploop.plant.line.actuator import ActuatedLine
from haploop.plant.motion.forced_response import forced_response
from haploop.plant.motion.one_mass import OneMassMotion, OneMassState, advance, sensed_acceleration
from haploop.plant.motion.record import NOTED, change_over
from haploop.plant.random.streams import Draw
from haploop.plant.sensing.encoder import PositionSensor, make_encoder
from haploop.plant.sensing.noise import NoisyPositionSensor


class NoTick(Exception):
    """The loop's objects are no function that could be compiled."""


class PlantTree(NamedTuple):
    """Numbers of the plants of a batch that a tick reads and changes.

    Attributes:
        state: of the motion.
        acting: force in effect at the start of an interval, N.
        held, mechanics, transition, rest_N: parameters of the motion.
        actuator: its parameters, or None.
        saturated: commands clipped so far, or None.
        encoder: the resolved ``[encoder]`` table, or None.
        noise, last_noise: parameters of the noise of the position, and the noise at the last tick; or None.
    """

    state: OneMassState
    acting: Any
    held: Any
    mechanics: Any
    transition: Any
    rest_N: Any
    actuator: Any
    saturated: Any
    encoder: Any
    noise: Any
    last_noise: Any


class Ticked(NamedTuple):
    """What a tick tells besides the state it leaves.

    Attributes:
        x, v, x_low: at the steps of the interval and at its end, n + 1 rows.
        held: (steps, force in N) of every hold.
        row: the controller's: x, v, a, wall, total, in_contact and more.
        forces: force of every element's book.
        wall: its position, stiffness and direction.
        tau: of the hand at the steps and at the end, N, n + 1 rows.
    """

    x: Rows
    v: Rows
    x_low: Rows
    held: list[tuple[int, Any]]
    row: dict[str, Any]
    forces: dict[int, Any]
    wall: tuple[Any, Any, Any]
    tau: Rows


class Tick:
    """The tick of a group of loops whose Python objects have come to where no tick changes their structure.

    Args:
        at: the tick they are at.
        quantise: from true to measured position.
        feels: whether samples carry the acceleration.
    """

    def __init__(
        self, at: int, motion: OneMassMotion, line: Any, position: PositionSensor, feels: bool,
        controller: Controller, rows: BatchRecorder, books: OneMassBooks | None,
    ) -> None:  # fmt: skip
        self.at, self._motion, self._line, self._position, self._feels = at, motion, line, position, feels
        self._controller, self._rows = controller, rows
        self.steps = motion.held.shape[0] - 1
        is_noisy = isinstance(position, NoisyPositionSensor)
        self.draws: list[Draw] = [position.draw] if is_noisy else []
        self._measured = position.state[0] if is_noisy else 0
        self.tau, self.is_shared = motion.response.tau, motion.response.is_shared and motion.held.shape[-1] == 1
        # Apart from the force of the hand, which comes from outside.
        self.books: Any = books and SimpleNamespace(params=books.params, names=books.names, is_limited=books.is_limited)
        self._actuator = line if isinstance(line, ActuatedLine) else None
        self._delay: Any = self._actuator.line if self._actuator else line
        self.commands: list[Any] = self._delay.in_flight(at)
        self._holds = deepcopy(self._delay)
        self._by_itself = [controller, self.books]
        response, actuator = motion.response, self._actuator
        self._plant = [
            PlantTree(
                motion.state, motion.last[1], motion.held, motion.mechanics, response.transition, response.rest_N,
                actuator.actuator if actuator else None, actuator.state[3] if actuator else None, position.encoder,
                position.noise if is_noisy else None, position.state[1] if is_noisy else None,
            )
        ]  # fmt: skip
        self._root = [self._plant, *self._by_itself]
        self.leaves = Leaves(self._root)

    def responses(self, first: int, ticks: int) -> np.ndarray:
        """What the hand does to all loops in these intervals, as ``Outside`` has it."""
        return self._motion.response.between(first, ticks).transpose(2, 1, 0, 3)

    def put(self, data: list[Any], commands: list[Any], ticks: int) -> None:
        """Have the objects of the plant stand where so many ticks more have brought them."""
        self.leaves.put(data, self.leaves.whole)
        plant, end, lookahead = self._plant[0], self.at + ticks, self._delay.lookahead
        self._motion.state, newest = plant.state, end - 1 - lookahead
        self._motion.last = (0, plant.acting, newest)
        line = end - lookahead - 1, tuple(commands)
        if self._actuator:
            self._actuator.restore((line, newest, plant.acting, plant.saturated))
        else:
            self._line.restore(line)

    def release(self, data: list[Any], whole: list[int], commands: list[Any], ticks: int) -> None:
        """Give the objects back, after so many ticks more, with these leaves and with these commands on the line."""
        self.put(data, commands, ticks)
        self.leaves.put(data, whole)
        self._controller.tick += ticks
        if isinstance(self._position, NoisyPositionSensor):
            self._position.go_on(self._measured + ticks, self._plant[0].last_noise)

    def run(
        self, data: list[Any], outside: Outside, report: Callable[[Ticked], Any]
    ) -> tuple[list[Any], list[int], Any]:
        """From the data leaves of a tick to those of the next, its whole leaves, and what is reported of it.

        Args:
            data: the data leaves.
            outside: what comes from outside.
            report: makes of what the tick tells what is reported; what it reads of the objects is of this tick.

        Raises:
            NoTick: the structure of the objects is another after the tick.
        """
        tick, whole = self.at, list(self.leaves.whole)
        self.leaves.put(data, whole)
        counted = Leaves(self._by_itself).whole
        plant, response, tau = self._begin(outside)
        x, noise = plant.state.x, plant.last_noise
        if plant.noise:
            noise = plant.noise.after(noise, outside.noise[0])
            x = x + noise
        x_m = rounded(make_encoder(plant.encoder)(x), outside.zero)
        sample = (x_m,)
        if self._feels:
            sample += (sensed_acceleration(plant.mechanics, plant.state, plant.acting, outside.tau[0]),)
        forces = self._controller.answer([sample])
        newer, saturated = outside.commands[1] if len(self.commands) > 1 else forces[0], plant.saturated
        if plant.actuator:
            newer, is_saturated = plant.actuator.drive(newer)
            saturated = saturated + is_saturated
        self._holds.restore((tick - self._delay.lookahead - 1, (plant.acting, newer)))
        noted: list[Any] = []
        state = OneMassState(*advance(plant.held, plant.state, self._holds.holds(tick), response[-1], noted))
        self._plant[0] = plant._replace(state=state, acting=newer, saturated=saturated, last_noise=noise)
        (row,) = self._rows.take_rows()
        told = self._told(plant, state, noted, response, tau, row)
        reported = report(told)
        self._end(tick)
        if Leaves(self._by_itself).whole != counted:
            raise NoTick("an element or an estimator counts ticks by itself")
        after = Leaves(self._root)
        if len(after.data) != len(data) or len(after.whole) != len(whole):
            raise NoTick("what the loop remembers grows from tick to tick")
        self.leaves.put(self.leaves.data, whole)
        return after.data, after.whole, reported

    def _begin(self, outside: Outside) -> tuple[PlantTree, Rows, Rows]:
        plant, tau = self._plant[0], Rows(list(outside.tau))
        if outside.response is not None:
            return plant, Rows(list(outside.response)), tau
        load = tau + plant.rest_N
        steps = list(forced_response(plant.transition, load[:-1], load[1:] - load[:-1]))
        return plant, Rows([(0.0 * steps[0][0], 0.0 * steps[0][1]), *steps]), tau

    def _told(
        self, plant: PlantTree, end: OneMassState, noted: list[Any], response: Any, tau: Rows, row: Any
    ) -> Ticked:
        x_rows, v_rows, x_low_rows, held_forces, first = [], [], [], [], 0
        for at in range(0, len(noted), NOTED):
            count, x, v, x_comp, v_comp, force, _ = noted[at : at + NOTED]
            known = int(not first)
            held, during = Rows(list(plant.held[known:count])), slice(first + known, first + count)
            dx = change_over([held[:, i] for i in range(3)], response[during, 0], x, v, force, x_comp)
            dv = change_over([held[:, i] for i in range(3, 6)], response[during, 1], x, v, force, v_comp)
            at_x = x + dx
            x_rows += [x] * known + at_x.rows
            v_rows += [v] * known + (v + dv).rows
            x_low_rows += [x_comp] * known + (dx - (at_x - x)).rows
            held_forces.append((count, force))
            first += count
        x, v, x_low = Rows([*x_rows, end.x]), Rows([*v_rows, end.v]), Rows([*x_low_rows, end.x_comp])
        wall = self._controller.params.wall
        place = wall.position, wall.stiffness, wall.inward
        return Ticked(x, v, x_low, held_forces, row.columns, row.forces, place, tau)

    def _end(self, tick: int) -> None:
        self._controller.tick = tick
