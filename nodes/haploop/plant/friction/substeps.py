"""One plant step with dry friction: every switch found by halving the step, every piece exact."""

from __future__ import annotations

import math
from itertools import groupby
from typing import Any, NamedTuple

import numpy as np

from haploop.plant.chain.chain import Chain
from haploop.plant.chain.history import StickSlipState
from haploop.plant.chain.transition import of_device
from haploop.plant.friction.stick_slip import (
    Row,
    StickSlip,
    creeps,
    decide_at_rest,
    friction_at,
    holds_against,
    may_switch_within,
    row_on,
)
from haploop.protocol.scene.scene import Scene

# A piece is halved this often to find when friction switches: to 2e-14 s at 10 kHz.
_HALVINGS = 32
# No piece is longer than this fraction of a radian of the fastest mode, so that no reversal hides between its ends.
_RADIANS = 0.5
# Five times what the stiffest chain that a scene may have takes; half a second of work.
_MOST_PIECES = 40_000
# If a plant step has to be cut into more parts than this, the plant rate is too low to simulate.
MOST_PARTS = 4096


class Halving(NamedTuple):
    """How a plant step is cut: no piece lasts longer than h / 2^coarsest, or shorter than h / 2^finest."""

    coarsest: int
    finest: int


class Step(NamedTuple):
    """Course of a plant step in which body 0 may stick and slip.

    Attributes:
        mode: at the end.
        friction, is_stuck: friction in N, and whether body 0 was stuck, at the start.
    """

    mode: StickSlipState
    friction: float
    is_stuck: bool


# What follows is computed as it is, or by machine code, in which these few functions are loops over arrays. A place
# among the tables is (whether body 0 is stuck, level); states come with their compensation.

Pieces = list[list[float]]
Place = tuple[int, int]
numbers = np.ndarray.tolist


def moved(
    tables: Any, of: Place, z: list[float], z_comp: list[float], command: float, friction: float, load: float,
    rise: float, after: np.ndarray, comp: np.ndarray,
) -> None:  # fmt: skip
    """Fills in the states after a transition, and their compensation."""
    table = tables[of[0]][of[1]]
    change = np.add.reduce(table * np.array((*z, command, friction, load, rise))[:, None])
    change += z_comp
    np.add(z, change, out=after)
    np.subtract(change, after - z, out=comp)


def one_moved(
    tables: Any, of: Place, at: int, z: list[float], z_comp: list[float], command: float, friction: float, load: float,
    rise: float,
) -> float:  # fmt: skip
    """Returns one of the states that ``moved`` fills in, to the same bits."""
    total = 0.0
    for factor, acts in zip(tables[of[0]][of[1]][:, at].tolist(), (*z, command, friction, load, rise), strict=True):
        total += factor * acts
    return z[at] + (total + z_comp[at])


def force_moved(
    row: Row, tables: Any, of: Place, z: list[float], z_comp: list[float], command: float, friction: float, load: float,
    rise: float, end_load: float,
) -> float:  # fmt: skip
    """Returns the value of a linear form after a transition; see ``row_on``."""
    force = row.of_command * command + row.of_load * end_load
    for i, factor in row.of_states:
        force = force + factor * one_moved(tables, of, i, z, z_comp, command, friction, load, rise)
    return force


def take_over(z: np.ndarray, z_comp: np.ndarray, next_z: np.ndarray, next_comp: np.ndarray) -> None:
    z[:], z_comp[:] = next_z, next_comp


def read(values: list[float], z: np.ndarray) -> None:
    """Reads the numbers of an array into a list."""
    values[:] = z.tolist()


def count_of(pieces: Pieces) -> int:
    return len(pieces)


def note(pieces: Pieces, of: StickSlip, head: tuple[float, ...], begin: list[float], comp: list[float]) -> None:
    """Records a piece: a row of ``pieces_record``."""
    pieces.append([*head, *begin, *comp[: of.v]])


def drop_last(pieces: Pieces) -> None:
    pieces.pop()


def is_full(pieces: Pieces, first: int, step: int) -> bool:
    """Tells whether no further piece can be recorded; raises ArithmeticError for too many in a step."""
    if len(pieces) - first > _MOST_PIECES:
        raise ArithmeticError(
            f"Friction switched so often in plant step {step} that it took {_MOST_PIECES} pieces. Raise "
            "clock.plant_rate where a body swings many times in a plant step; where none does, this is a "
            "bug in haploop: report the scene."
        )
    return False


def solve_step(
    of: StickSlip, halving: Halving, tables: Any, mode: StickSlipState, step: int, z: np.ndarray, z_comp: np.ndarray,
    command: float, load: float, rise: float, pieces: Any, next_z: np.ndarray, next_comp: np.ndarray,
) -> Step:  # fmt: skip
    """Solves plant step number ``step`` in which body 0 may stick and slip, under a command and a load, N.

    A piece of the step is moved by the exact transition. If the mode no longer holds at its end, or may have ceased
    within it, the piece is halved, until the switch lies within 2^-32 of the coarsest piece; there the mode changes,
    and v is set to exactly 0.0. The kinetic energy that this removes, of the order of 1e-20 of what moves, is heat of
    friction.
    A search for a switch ends with one: if at its end the pieces say that the mode still holds, and the one long piece
    said that it does not, the two differ by rounding, and v, or the force that friction could still hold, is no more
    than that. (With a Stribeck velocity long pieces have larger errors: a slip then continues.) A slip that ``creeps``
    stops, too, where friction holds the other forces.
    With a Stribeck velocity every piece has the friction of the speed predicted for its middle: second order in h.
    A few states tell whether the mode holds at the end of a piece, so that only a piece that is kept is moved as a
    whole.

    Args:
        tables: transitions over h / 2^level by whether body 0 is stuck and by level.
        z, z_comp: states and their compensation at the start of the step, taken to its end in place.
        rise: of the load over the step, N.
        pieces: receives the pieces of the step; none if it is one piece.
        next_z, next_comp: room for intermediate states.

    Raises:
        ArithmeticError: friction switched so often that it took 40 000 pieces.
    """
    mode = decide_at_rest(of, mode, z, command, load)
    first = count_of(pieces)
    whole = left = 1 << halving.finest
    level, hunted_to = halving.coarsest, -1
    begun_with, was_stuck = 0.0, mode.is_stuck
    begin, comp, end = numbers(z), numbers(z_comp), numbers(next_z)
    while left:
        while 1 << (halving.finest - level) > left:
            level += 1
        rest = left - (1 << (halving.finest - level))
        load_now, load_then = load + rise * (1.0 - left / whole), load + rise * (1.0 - rest / whole)
        piece = int(mode.is_stuck), level
        friction = friction_over(of, mode, tables, level + 1, begin, comp, command, load_now, rise)
        holds = holds_after(of, mode, tables, piece, begin, comp, command, friction, load_now, rise, load_then)
        if not holds and level < halving.finest:
            level, hunted_to = level + 1, rest
            continue
        moved(tables, piece, begin, comp, command, friction, load_now, rise, next_z, next_comp)
        read(end, next_z)
        if (of.law.holds_N > 0.0 and level < halving.finest) and may_switch_within(
            of, mode, begin, end, command, load_now, load_then, friction, 1.0 / (1 << level)
        ):
            level += 1
            continue
        if left == whole:
            begun_with, was_stuck = friction, mode.is_stuck
        stuck_in_it, snap_J = mode.is_stuck, 0.0
        if hunted_to < 0 and creeps(of, mode, end[of.v]):
            holds = holds and not holds_against(of.law, row_on(of.force, end, command, load_then))
        elif rest == hunted_to:
            holds = holds and not stuck_in_it and of.law.stribeck_m_s != 0.0
        if not holds:
            snap_J = at_rest(of, next_z, next_comp)
            mode = decide_at_rest(of, mode, next_z, command, load_then)
            mode = StickSlipState(mode.is_stuck and not stuck_in_it, mode.direction)
        note(pieces, of, (step, level, stuck_in_it, friction, load_now, snap_J), begin, comp)
        left = rest
        take_over(z, z_comp, next_z, next_comp)
        read(begin, z)
        read(comp, z_comp)
        if not holds or left <= hunted_to:
            level, hunted_to = halving.coarsest, -1
        elif hunted_to >= 0:
            while level < halving.finest and 2 << (halving.finest - level) > left - hunted_to:
                level += 1
        if is_full(pieces, first, step):
            break
    if not left and count_of(pieces) == first + 1:  # one that was broken off for lack of room is not done
        drop_last(pieces)
    return Step(mode, begun_with, was_stuck)


def friction_over(
    of: StickSlip, mode: StickSlipState, tables: Any, half: int, z: Any, z_comp: Any, command: float, load: float,
    rise: float,
) -> float:  # fmt: skip
    """Returns the friction force in a piece, N; ``half`` is the level of half of it."""
    if mode.is_stuck:
        return 0.0
    v, direction = z[of.v], mode.direction
    if of.law.stribeck_m_s != 0.0:
        begun = -direction * friction_at(of.law, v)
        v = one_moved(tables, (0, half), of.v, z, z_comp, command, begun, load, rise)
    return -direction * friction_at(of.law, v)


def holds_after(
    of: StickSlip, mode: StickSlipState, tables: Any, piece: Place, z: Any, z_comp: Any, command: float,
    friction: float, load: float, rise: float, end_load: float,
) -> bool:  # fmt: skip
    """Tells whether the mode still holds at the end of a piece, as ``holds_through``, or v is not a finite number.

    Where friction is 0 there is nothing to switch.
    """
    if of.law.holds_N == 0.0:
        return True
    v = one_moved(tables, piece, of.v, z, z_comp, command, friction, load, rise)
    if not mode.is_stuck:
        return mode.direction * v > 0.0 or not math.isfinite(v)
    force = force_moved(of.force, tables, piece, z, z_comp, command, friction, load, rise, end_load)
    return holds_against(of.law, force) or not math.isfinite(v)


def at_rest(of: StickSlip, z: np.ndarray, z_comp: np.ndarray) -> float:
    """Puts body 0 at rest and leaves the motion of all others unchanged; returns the energy in J that it lost."""
    v = float(z[of.v])
    if of.v > 1:
        z[of.v + 1] += v
    z[of.v] = z_comp[of.v] = 0.0
    return 0.5 * of.mass_kg * v * v


def pieces_record(chain: Chain, pieces: list[Any]) -> dict[str, np.ndarray]:
    """Returns the pieces of steps that were cut, given row by row or in tables, as ``pieces.<name>``, in order.

    The names are step, level (a piece lasts h / 2^level), stuck, friction and load at its start (N), snap_J (the energy
    that setting v to 0 removed at its end), every state at its start, and the compensation of each length.
    """
    names = ["step", "level", "stuck", "friction", "load", "snap_J", *chain.states]
    names += [f"{name}_low" for name in chain.positions]
    tables = [[np.array([*of])] if kind is list else [*of] for kind, of in groupby(pieces, type)]
    rows = np.concatenate([np.zeros((0, len(names))), *(table for of in tables for table in of)])
    return {f"pieces.{name}": np.ascontiguousarray(rows[:, i]) for i, name in enumerate(names)}


def halving_of(chain: Chain, step_s: float) -> Halving:
    """Returns how the plant steps of a chain are cut."""
    coarsest = parts_of_a_step(chain, step_s).bit_length() - 1
    return Halving(coarsest, coarsest + _HALVINGS)


def goes_by_whole_steps(scene: Scene) -> bool:
    """Tells whether a step in which nothing switches is one piece, with the same friction at every speed."""
    is_slow = parts_of_a_step(Chain.from_scene(scene), 1.0 / scene.clock.plant_rate) == 1
    return bool(is_slow and scene.friction and not scene.friction.stribeck_velocity)


@of_device
def parts_of_a_step(chain: Chain, step_s: float) -> int:
    """Returns the number of pieces, a power of two, of a plant step cut so that none is longer than half a radian."""
    rates = [chain.rates(stuck)[:, : len(chain.states)].astype(float) for stuck in (False, True)]
    fastest = max(float(np.abs(np.linalg.eigvals(matrix).imag).max()) for matrix in rates)
    return 1 << max(0, math.ceil(math.log2(max(fastest * step_s / _RADIANS, 1.0))))
