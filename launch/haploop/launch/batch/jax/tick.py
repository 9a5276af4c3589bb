"""One tick of many loops as a function of numbers alone: the loop's own objects, run on a compiler's placeholders."""

from __future__ import annotations

from collections.abc import Callable
from types import MethodWrapperType, SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from haploop.controller.controller import Controller
from haploop.controller.recorder import BatchRecorder
from haploop.launch.batch.jax.rows import Rows
from haploop.launch.batch.jax.stand_ins import Drawn, Given, Outside, rounded
from haploop.launch.batch.jax.state import Leaves
from haploop.launch.batch.object_state import replace
from haploop.logger.books.one_mass import OneMassBooks
from haploop.plant.motion.one_mass import change_over
from haploop.plant.motion.one_mass_batch import LinearMotionArray
from haploop.plant.motion.transition import HeldFlow
from haploop.plant.random.streams import Draw
from haploop.plant.random.streams_batch import Draws


class NoTick(Exception):
    """The loop's objects are no function that could be compiled."""


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
        self, at: int, motion: LinearMotionArray, line: Any, quantise: Any, feels: bool, controller: Controller,
        rows: BatchRecorder, books: OneMassBooks | None,
    ) -> None:  # fmt: skip
        self.at, self._motion, self._line, self._quantise, self._feels = at, motion, line, quantise, feels
        self._controller, self._rows = controller, rows
        self.steps = motion._steps
        self.draws: list[Draw] = []
        self._drawn: list[Drawn] = []
        self._stand_in_for_draws(quantise)
        self.tau, motion._tau = motion._tau, None  # pyright: ignore[reportAttributeAccessIssue]
        self._pieces, motion._pieces = motion._pieces, {}
        self._span = motion._response_first, motion._response_end
        motion._response, motion._over = [], []
        load = np.shape(self.tau.at_steps(0, 1) + motion._spring_at_origin_N)
        self.is_shared = motion._held.coefficients.shape[-1] == load[-1] == 1
        self._line.forget_before(at)
        # Apart from the force of the hand, which comes from outside.
        self.books: Any = books and SimpleNamespace(params=books.params, names=books.names, is_limited=books.is_limited)
        while hasattr(line, "_line"):
            line = line._line
        self._forces: list[Any] = line._forces
        self.commands, self._forces[:] = list(self._forces), [None] * len(self._forces)
        self._by_itself = [quantise, controller, self.books]
        self._root = [motion, self._line, *self._by_itself]
        self.leaves = Leaves(self._root)

    def _stand_in_for_draws(self, quantise: Any) -> None:
        def stand_in(draws: Draw) -> Drawn:
            self.draws.append(draws)
            self._drawn.append(Drawn())
            return self._drawn[-1]

        replace(quantise, (Draws, MethodWrapperType), stand_in)

    def responses(self, first: int, ticks: int) -> np.ndarray:
        """What the hand does to all loops in these intervals, as ``Outside`` has it."""
        motion = self._motion
        motion._tau, motion._pieces = self.tau, self._pieces
        size = motion._piece_ticks
        pieces = range(first // size, (first + ticks - 1) // size + 1)
        joined = np.concatenate([motion._responses(piece) for piece in pieces])
        motion._tau, motion._pieces = None, {}  # pyright: ignore[reportAttributeAccessIssue]
        start = first - pieces.start * size
        return joined[start : start + ticks]

    def release(self, data: list[Any], whole: list[int], commands: list[Any], ticks: int) -> None:
        """Give the objects back, after so many ticks more, with these leaves and with these commands on the line."""
        motion, draws = self._motion, iter(self.draws)
        self.leaves.put(data, whole)
        self._forces[:] = commands
        self._controller.tick += ticks
        motion._over = motion._held.by_count()
        motion._tau, motion._pieces = self.tau, self._pieces
        motion._response_first = motion._response_end = 0
        replace(self._quantise, Drawn, lambda _: next(draws))

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
        tick, motion, whole = self.at, self._motion, list(self.leaves.whole)
        self.leaves.put(data, whole)
        counted = Leaves(self._by_itself).whole
        start = self._begin(tick, outside)
        x_m = rounded(self._quantise(motion.x), outside.zero)
        forces = self._controller.answer([(x_m, motion.acceleration(tick)) if self._feels else (x_m,)])
        self._line.receive(forces)
        motion.advance(tick, self._line.holds(tick))
        (row,) = self._rows.take_rows()
        told = self._told(*start, row)
        reported = report(told)
        self._end(tick)
        if Leaves(self._by_itself).whole != counted:
            raise NoTick("an element or an estimator counts ticks by itself")
        after = Leaves(self._root)
        if len(after.data) != len(data) or len(after.whole) != len(whole):
            raise NoTick("what the loop remembers grows from tick to tick")
        self.leaves.put(self.leaves.data, whole)
        return after.data, after.whole, reported

    def _begin(self, tick: int, outside: Outside) -> tuple[Any, Rows]:
        motion = self._motion
        n = motion._steps
        tau = Rows(list(outside.tau))
        given = Given(tick * n, tau)
        motion._tau = given  # pyright: ignore[reportAttributeAccessIssue]
        self._forces[:2] = outside.commands[: len(self._forces)]
        for drawn, row in zip(self._drawn, outside.noise, strict=True):
            drawn.row = row
        motion._over = HeldFlow(motion._held.coefficients).by_count()
        if outside.response is None:
            load = tau + motion._spring_at_origin_N
            steps = list(motion._driven(load[:-1], load[1:] - load[:-1]))
            response = Rows([(0.0 * steps[0][0], 0.0 * steps[0][1]), *steps])
        else:
            response = Rows(list(outside.response))
        motion._response, motion._response_first, motion._response_end = [response[-1]], tick, tick + 1
        return response, tau

    def _told(self, response: Any, tau: Rows, row: Any) -> Ticked:
        motion = self._motion
        starts, motion._starts = motion._starts, []
        x_rows, v_rows, x_low_rows, held_forces = [], [], [], []
        for index, (first, count) in enumerate(motion._cuts):
            x, x_low, v, v_low, force, _ = starts[6 * index : 6 * index + 6]
            known = int(not first)
            held, during = Rows(list(motion._held.coefficients[known:count])), slice(first + known, first + count)
            dx = change_over(held[:, :3], response[during, 0], x, v, force, x_low)
            dv = change_over(held[:, 3:], response[during, 1], x, v, force, v_low)
            at_x = x + dx
            x_rows += [x] * known + at_x.rows
            v_rows += [v] * known + (v + dv).rows
            x_low_rows += [x_low] * known + (dx - (at_x - x)).rows
            held_forces.append((count, force))
        x, v, x_low = Rows([*x_rows, motion.x]), Rows([*v_rows, motion.v]), Rows([*x_low_rows, motion._x_low])
        wall = self._controller.params.wall
        place = wall.position, wall.stiffness, wall.inward
        return Ticked(x, v, x_low, held_forces, row.columns, row.forces, place, tau)

    def _end(self, tick: int) -> None:
        self._line.forget_before(tick + 1)
        self._forces[:] = [None] * len(self._forces)
        self._controller.tick = tick
        self._motion._response = []
        self._motion._over = []
        self._motion._tau = None  # pyright: ignore[reportAttributeAccessIssue]
        for drawn in self._drawn:
            drawn.row = None
