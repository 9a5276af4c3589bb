"""One plant step with dry friction: every switch found by halving the step, every piece exact."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from haploop.plant.chain.chain import Chain
from haploop.plant.chain.history import StickSlipState
from haploop.plant.friction.stick_slip import StickSlip, decide_at_rest, friction_at, holds_through, may_switch_within
from haploop.protocol.scene.scene import Scene

# A piece is halved this often to find when friction switches: to 2e-14 s at 10 kHz.
_HALVINGS = 32
# No piece is longer than this part of a radian of the fastest mode, so that no reversal hides between its ends.
_RADIANS = 0.5
_MOST_PIECES = 1_000_000
# More parts of a plant step than this are no way to simulate: the plant rate is too low.
MOST_PARTS = 4096


class Halving(NamedTuple):
    """What a plant step is cut by: no piece lasts longer than h / 2^coarsest, or shorter than h / 2^finest."""

    coarsest: int
    finest: int


class Step(NamedTuple):
    """Course of a plant step in which body 0 may stick and slip.

    Attributes:
        mode, z, z_comp: at the end; what rounding left of the states z.
        friction, is_stuck: friction in N, and whether body 0 was stuck, at the start.
    """

    mode: StickSlipState
    z: np.ndarray
    z_comp: np.ndarray
    friction: float
    is_stuck: bool


# What follows is computed as it stands, or by machine code, where these few functions are loops over arrays.

Pieces = list[list[float]]
numbers = np.ndarray.tolist


def moved(
    table: np.ndarray, z: np.ndarray, z_comp: np.ndarray, command: float, friction: float, load: float, rise: float
) -> tuple[np.ndarray, np.ndarray]:
    """Returns states and what rounding left of them by the transition of a table."""
    acting = np.append(z, (command, friction, load, rise))
    change = np.add.reduce(table * acting[:, None]) + z_comp
    after = z + change
    return after, change - (after - z)


def count_of(pieces: Pieces) -> int:
    return len(pieces)


def note(pieces: Pieces, of: StickSlip, head: tuple[float, ...], begin: list[float], comp: np.ndarray) -> None:
    """Notes a piece: a row of ``pieces_record``."""
    pieces.append([*head, *begin, *comp[: of.v].tolist()])


def drop_last(pieces: Pieces) -> None:
    pieces.pop()


def is_full(pieces: Pieces, first: int, step: int) -> bool:
    """Tells whether no further piece can be noted; raises ArithmeticError for a million in a step."""
    if len(pieces) - first > _MOST_PIECES:
        raise ArithmeticError(
            f"Friction switched so often in plant step {step} that it took {_MOST_PIECES} pieces; "
            "raise clock.plant_rate."
        )
    return False


def solve_step(
    of: StickSlip, halving: Halving, tables: Any, mode: StickSlipState, step: int, z: np.ndarray, z_comp: np.ndarray,
    command: float, load: float, rise: float, pieces: Any,
) -> Step:  # fmt: skip
    """Solves plant step number ``step`` in which body 0 may stick and slip, under a command and a load, N.

    A piece of the step is moved by the exact transition. If the mode no longer holds at its end, or may have ceased
    within it, the piece is halved, until the switch lies within h / 2^32; there the mode changes, and v is set to
    exactly 0.0. The kinetic energy which that throws away, of the order of 1e-20 of what moves, is heat of friction.
    With a Stribeck velocity every piece has the friction of the speed foreseen for its middle: second order in h.

    Args:
        tables: transitions over h / 2^level by whether body 0 is stuck and by level.
        rise: of the load over the step, N.
        pieces: takes the pieces of the step, none where it is one piece.

    Raises:
        ArithmeticError: friction switched so often that it took a million pieces.
    """
    mode = decide_at_rest(of, mode, z, command, load)
    first = count_of(pieces)
    whole = left = 1 << halving.finest
    level, hunted_to = halving.coarsest, -1
    begun_with, was_stuck = 0.0, mode.is_stuck
    while left:
        while 1 << (halving.finest - level) > left:
            level += 1
        rest = left - (1 << (halving.finest - level))
        load_now, load_then = load + rise * (1.0 - left / whole), load + rise * (1.0 - rest / whole)
        table = tables[int(mode.is_stuck)]
        friction = friction_over(of, mode, table[level + 1], z, z_comp, command, load_now, rise)
        next_z, next_comp = moved(table[level], z, z_comp, command, friction, load_now, rise)
        begin, end = numbers(z), numbers(next_z)
        holds = holds_through(of, mode, end, command, load_then) or not math.isfinite(end[of.v])
        if level < halving.finest:
            if not holds:
                level, hunted_to = level + 1, rest if hunted_to < 0 else hunted_to
                continue
            if may_switch_within(of, mode, begin, end, command, load_now, load_then, friction, 0.5**level):
                level += 1
                continue
        if left == whole:
            begun_with, was_stuck = friction, mode.is_stuck
        snap_J, begun = 0.0, z_comp
        stuck_in_it = mode.is_stuck
        left, z, z_comp = rest, next_z, next_comp
        if not holds:
            z, z_comp, snap_J = at_rest(of, z, z_comp)
            mode = decide_at_rest(of, mode, z, command, load_then)
        note(pieces, of, (step, level, stuck_in_it, friction, load_now, snap_J), begin, begun)
        if not holds or left <= hunted_to:
            level, hunted_to = halving.coarsest, -1
        elif hunted_to >= 0:
            level = min(level + 1, halving.finest)
        if is_full(pieces, first, step):
            break
    if count_of(pieces) == first + 1:
        drop_last(pieces)
    return Step(mode, z, z_comp, begun_with, was_stuck)


def friction_over(
    of: StickSlip, mode: StickSlipState, half: np.ndarray, z: np.ndarray, z_comp: np.ndarray, command: float,
    load: float, rise: float,
) -> float:  # fmt: skip
    """Returns the friction force in a piece, N; ``half`` is the transition over half of it."""
    if mode.is_stuck:
        return 0.0
    v, direction = float(z[of.v]), mode.direction
    if of.law.stribeck_m_s != 0.0:
        begun = -direction * friction_at(of.law, v)
        v = float(moved(half, z, z_comp, command, begun, load, rise)[0][of.v])
    return -direction * friction_at(of.law, v)


def at_rest(of: StickSlip, z: np.ndarray, z_comp: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Returns states with body 0 at rest and all others as they move, and the energy in J that it lost."""
    z, z_comp, v = z.copy(), z_comp.copy(), float(z[of.v])
    if of.v > 1:
        z[of.v + 1] += v
    z[of.v] = z_comp[of.v] = 0.0
    return z, z_comp, 0.5 * of.mass_kg * v * v


def pieces_record(chain: Chain, pieces: list[Any]) -> dict[str, np.ndarray]:
    """Returns the pieces of steps that were cut, given row by row or in tables, as ``pieces.<name>``, in order.

    step, level (a piece lasts h / 2^level), stuck, friction and load at its start (N), snap_J (what setting v to 0
    threw away at its end), every state at its start, and what rounding left of each length.
    """
    names = ["step", "level", "stuck", "friction", "load", "snap_J", *chain.states]
    names += [f"{name}_low" for name in chain.positions]
    rows = np.concatenate([np.zeros((0, len(names))), *(np.reshape(of, (-1, len(names))) for of in pieces)])
    return {f"pieces.{name}": np.ascontiguousarray(rows[:, i]) for i, name in enumerate(names)}


def halving_of(chain: Chain, step_s: float) -> Halving:
    """Returns how the plant steps of a chain are cut."""
    coarsest = parts_of_a_step(chain, step_s).bit_length() - 1
    return Halving(coarsest, coarsest + _HALVINGS)


def goes_by_whole_steps(scene: Scene) -> bool:
    """Tells whether a step in which nothing switches is one piece, with the same friction at every speed."""
    is_slow = parts_of_a_step(Chain.from_scene(scene), 1.0 / scene.clock.plant_rate) == 1
    return bool(is_slow and scene.friction and not scene.friction.stribeck_velocity)


def parts_of_a_step(chain: Chain, step_s: float) -> int:
    """Returns into how many pieces, a power of two, a plant step is cut so that none is longer than half a radian."""
    rates = [chain.rates(stuck)[:, : len(chain.states)].astype(float) for stuck in (False, True)]
    fastest = max(float(np.abs(np.linalg.eigvals(matrix).imag).max()) for matrix in rates)
    return 1 << max(0, math.ceil(math.log2(max(fastest * step_s / _RADIANS, 1.0))))
