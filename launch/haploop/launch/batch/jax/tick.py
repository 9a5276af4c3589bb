"""One tick of a whole batch as a function of numbers alone, for a compiler: plant, controller, delay line, books."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import accumulate
from operator import add
from typing import Any, NamedTuple

import jax

from haploop.controller.tick import ControllerParams, StateTuple, tick
from haploop.launch.batch.jax.rows import Rows
from haploop.logger.books.ideal_wall import CAUSES, DISSIPATED, dissipated, ideal_walls
from haploop.logger.books.one_mass import OneMassParams, Steps, Ticks, increments
from haploop.logger.books.work import displacement, sampled_work, sum_rows
from haploop.plant.motion.forced_response import forced_response
from haploop.plant.motion.one_mass import OneMassState, advance, sensed_acceleration
from haploop.plant.motion.record import NOTED, change_over
from haploop.plant.sensing.encoder import make_encoder
from haploop.protocol.walls.wall import Wall

# Force of the wall and of every element at one tick.
Forces = dict[str, jax.Array]
# Returns what a function returns, computed once for all that need it.
Apart = Callable[[Callable[[], Any]], Any]


class NotCompilable(Exception):
    """A batch whose tick is not a function that could be compiled; the message says why."""


class BatchParams(NamedTuple):
    """Parameters of a batch that a tick reads: a tree of numbers, shared by all members or with a number for each.

    Attributes:
        held, mechanics, transition, rest_N: those of the motion of one mass.
        noise: noise of the position, or None.
        feels: whether samples carry the acceleration.
        lookahead, late_steps: L and r of a round-trip delay of L n + r plant steps.
        books: parameters of the books of the plant; None without books.
    """

    held: Any
    mechanics: Any
    transition: Any
    rest_N: Any
    actuator: Any
    encoder: Any
    noise: Any
    feels: bool
    lookahead: int
    late_steps: int
    controller: ControllerParams
    books: Any


class BatchState(NamedTuple):
    """Everything that a batch remembers from tick to tick except commands in flight; arrays of shape (members,).

    Attributes:
        acting: force held at the end of the last interval, N.
        saturated: commands clipped so far.
        noise: noise of the position at the last tick, m.
    """

    motion: OneMassState
    acting: Any
    saturated: Any
    noise: Any
    controller: StateTuple


class TickInputs(NamedTuple):
    """Everything that comes to a tick from outside.

    Attributes:
        tau: hand force at the steps of the interval and at its end, N, shape (n + 1, 1 or members).
        response: forced response in the interval, shape (n + 1, 2, 1), if all members have the same; else None.
        noise: standard normal numbers, shape (members,) or (); None without noise.
        zero: a whole number that the compiler cannot know.
    """

    tau: Any
    response: Any
    noise: Any
    zero: Any

    def at(self, tick: Any, n: int) -> TickInputs:
        """Returns the inputs of one of many ticks, each of n steps."""
        tau = jax.lax.dynamic_slice_in_dim(self.tau, tick * n, n + 1)
        response = None if self.response is None else self.response[tick]
        return TickInputs(tau, response, None if self.noise is None else self.noise[tick], self.zero)


class Decided(NamedTuple):
    """Outcome of a tick up to the controller's command.

    Attributes:
        noise: noise of the position, m.
        controller: state of the controller after the tick.
        row: x, total and in_contact of the controller.
        forces: those of the wall and of every element, N, by the names of their accounts, and the "command".
    """

    noise: Any
    controller: StateTuple
    row: dict[str, jax.Array]
    forces: Forces


class Moved(NamedTuple):
    """The interval after a tick.

    Attributes:
        x, v, x_comp: values at the steps of the interval and at its end, n + 1 rows.
        tau: force of the hand at these steps, N, n + 1 rows.
        held: (steps, force in N) of every hold.
    """

    x: Rows
    v: Rows
    x_comp: Rows
    tau: Rows
    held: list[tuple[int, Any]]


def decided(params: BatchParams, state: BatchState, inputs: TickInputs) -> Decided:
    """Returns what the sensor tells the controller at a tick, and how the controller answers."""
    x, noise = state.motion.x, state.noise
    if params.noise is not None:
        noise = params.noise.after(noise, inputs.noise)
        x = x + noise
    sample = (rounded(make_encoder(params.encoder)(x), inputs.zero),)
    if params.feels:
        sample += (sensed_acceleration(params.mechanics, state.motion, state.acting, inputs.tau[0]),)
    controller, row = tick(params.controller, state.controller, sample)
    forces = {str(active.book): force for active, force in zip(params.controller.elements, row[4:-2], strict=True)}
    told = {"x": row[0], "total": row[-2], "in_contact": row[-1]}
    return Decided(noise, controller, told, {"wall": row[3], **forces, "command": row[-2]})


def moved(
    params: BatchParams, state: BatchState, inputs: TickInputs, after: Decided, command: Any
) -> tuple[BatchState, Moved]:
    """Returns the state at the end of the interval after a tick, and how the plant got there.

    Args:
        command: the command computed L ticks ago, N, which acts from r steps after the tick on.
    """
    newer, saturated = command, state.saturated
    if params.actuator is not None:
        newer, is_saturated = params.actuator.drive(newer)
        saturated = saturated + is_saturated
    response, tau = _response(params, inputs), Rows(list(inputs.tau))
    late, n = params.late_steps, len(params.held) - 1
    holds = [*([(late, state.acting, 0)] if late else []), (n - late, newer, 1)]
    noted: list[Any] = []
    motion = OneMassState(*advance(params.held, state.motion, holds, response[-1], noted))
    told = Moved(
        *_filled(params.held, noted, response, motion),
        tau,
        [(count, force) for count, force, _ in holds],
    )
    return BatchState(motion, newer, saturated, after.noise, after.controller), told


def _response(params: BatchParams, inputs: TickInputs) -> Rows:
    """Returns the forced response at the steps of the interval and at its end."""
    if inputs.response is not None:
        return Rows(list(inputs.response))
    load = Rows(list(inputs.tau)) + params.rest_N
    steps = list(forced_response(params.transition, load[:-1], load[1:] - load[:-1]))
    return Rows([(0.0 * steps[0][0], 0.0 * steps[0][1]), *steps])


def _filled(held: Any, noted: list[Any], response: Rows, end: OneMassState) -> tuple[Rows, Rows, Rows]:
    """Returns x, v and x_comp at the steps of the interval and at its end, from what was noted of its holds."""
    x_rows, v_rows, x_comp_rows, first = [], [], [], 0
    for at in range(0, len(noted), NOTED):
        count, x, v, x_comp, v_comp, force, _ = noted[at : at + NOTED]
        known = int(not first)
        over, during = Rows(list(held[known:count])), slice(first + known, first + count)
        dx = change_over([over[:, i] for i in range(3)], response[during, 0], x, v, force, x_comp)
        dv = change_over([over[:, i] for i in range(3, 6)], response[during, 1], x, v, force, v_comp)
        at_x = x + dx
        x_rows += [x] * known + at_x.rows
        v_rows += [v] * known + (v + dv).rows
        x_comp_rows += [x_comp] * known + (dx - (at_x - x)).rows
        first += count
    return Rows([*x_rows, end.x]), Rows([*v_rows, end.v]), Rows([*x_comp_rows, end.x_comp])


def rounded(value: Any, zero: Any) -> Any:
    """Returns the value itself, which a compiler cannot merge with what is computed from it into one rounding.

    A measured position may lie on the face of the wall, and is in contact if it is off by a last bit.
    """
    bits = jax.lax.bitcast_convert_type(value, zero.dtype)
    return jax.lax.bitcast_convert_type(bits ^ zero, value.dtype)


def added_in_tick(
    params: OneMassParams, names: Sequence[str], told: Moved, now: Forces, acting: Sequence[Forces], before: Forces,
    x_m: Sequence[Any], wall: Wall | None, step_s: float, apart: Apart,
) -> dict[str, jax.Array]:  # fmt: skip
    """Returns what a tick adds to each book, J, by the names of ``Books``; shape (members,).

    Args:
        now, before: forces of wall and elements computed at the tick, and at the tick before.
        acting: forces computed with the two newest commands that act in its interval.
        x_m: measured position at the tick before and at this one, m.
        apart: computes once what several books need; a compiler would compute it again for each of them.
    """
    x, v, tau = told.x, told.v, told.tau
    n, summed = len(x) - 1, partial(_sum_steps, apart)
    moved = displacement(x, told.x_comp, None, summed)
    counts, applied = zip(*told.held, strict=True)
    in_effect = {account: [forces[account] for forces in acting[2 - len(counts) :]] for account in now}
    force = Rows(_of_steps(counts, applied))
    commanded = [Rows(_of_steps(counts, forces)) for forces in in_effect.values()] if "actuator" in names else None
    steps = Steps(x[:-1], v[:-1], force, tau[:-1], tau[1:] - tau[:-1], moved.by_step)
    ticks = Ticks(x[::n], v[::n], moved.by_tick)
    flows: dict[str, Any] = dict(zip(names, increments(params, steps, ticks, commanded, summed), strict=True))
    ways = [moved.by_tick]
    if len(counts) > 1:
        ends = list(accumulate(counts))
        ways = [summed(moved.by_step, end - count, end) for count, end in zip(counts, ends, strict=True)]
    for account, forces in in_effect.items():
        flows[f"{account}.true"] = sum_rows(-force * way for force, way in zip(forces, ways, strict=True))
    flows["moved"] = 0.5 * sum_rows(abs(flow) for flow in flows.values())
    if wall:
        flows |= zip(CAUSES, ideal_walls(wall, x[::n], v[::n], moved.by_tick, Rows([now["wall"]])), strict=True)
        if wall.dissipates:
            flows[DISSIPATED] = summed(dissipated(wall, x, v, step_s))
    positions: Any = Rows(x_m)
    for account in now:
        flows[f"{account}.sampled"] = sampled_work(positions, before[account])
    return {name: flow[0] for name, flow in flows.items()}


def _sum_steps(apart: Apart, flow: Rows, first: int = 0, end: int | None = None) -> Rows:
    """Returns ``sum_steps`` of one tick, computed once."""
    return Rows([apart(lambda: flow[first:end].over(add))])


def _of_steps(counts: Sequence[int], forces: Sequence[Any]) -> list[Any]:
    return [force for count, force in zip(counts, forces, strict=True) for _ in range(count)]
