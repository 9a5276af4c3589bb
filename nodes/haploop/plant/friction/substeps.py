"""One plant step with dry friction: every switch found by halving the step, every piece exact."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from haploop.plant.chain.chain import Chain
from haploop.plant.chain.history import StickSlipState
from haploop.plant.chain.transition import ChainTransition
from haploop.plant.friction.stick_slip import Friction, StickSlip
from haploop.protocol.scene.scene import Scene

# A piece is halved this often to find when friction switches: to 2e-14 s at 10 kHz.
_HALVINGS = 32
# No piece is longer than this part of a radian of the fastest mode, so that no reversal hides between its ends.
_RADIANS = 0.5
_MOST_PIECES = 1_000_000
# More parts of a plant step than this are no way to simulate: the plant rate is too low.
MOST_PARTS = 4096


class Step(NamedTuple):
    """Course of a plant step in which body 0 may stick and slip.

    Attributes:
        mode, z, z_comp: at the end; what rounding left of the states z.
        friction, is_stuck: friction in N, and whether body 0 was stuck, at the start.
        pieces: rows of ``pieces_record``, none where the step is one piece.
    """

    mode: StickSlipState
    z: np.ndarray
    z_comp: np.ndarray
    friction: float
    is_stuck: bool
    pieces: list[list[float]]


class SubstepSolver:
    """Solver of a plant step in which body 0 may stick and slip.

    A piece of the step is moved by the exact transition. If the mode no longer holds at its end, or may have ceased
    within it, the piece is halved, until the switch lies within h / 2^32; there the mode changes, and v is set to
    exactly 0.0. The kinetic energy which that throws away, of the order of 1e-20 of what moves, is heat of friction.
    With a Stribeck velocity every piece has the friction of the speed foreseen for its middle: second order in h.

    Attributes:
        whole_steps: whether a step in which nothing switches is one piece, with the same friction at every speed.
    """

    def __init__(
        self, chain: Chain, stick_slip: StickSlip, free: ChainTransition, clamped: ChainTransition, step_s: float
    ) -> None:
        self._chain, self._stick_slip, self._friction = chain, stick_slip, stick_slip.friction
        self._v, self._mass_kg = chain.count, chain.masses_kg[0]
        self._coarsest = parts_of_a_step(chain, step_s).bit_length() - 1
        self._finest = self._coarsest + _HALVINGS
        self.whole_steps = not self._coarsest and self._friction.is_constant
        self._acting = np.zeros(len(chain.states) + 4)
        self._tables = {stuck: of.halves(self._finest + 1) for stuck, of in ((False, free), (True, clamped))}

    def through(
        self, mode: StickSlipState, step: int, z: np.ndarray, z_comp: np.ndarray, command: float, load: float,
        rise: float,
    ) -> Step:  # fmt: skip
        """Solves plant step number ``step`` from its start, under a command and a load with its rise over it, N.

        Raises:
            ArithmeticError: friction switched so often that it took a million pieces.
        """
        mode = self._stick_slip.decide_at_rest(mode, z, command, load)
        whole = left = 1 << self._finest
        level, hunted_to, pieces = self._coarsest, -1, []
        while left:
            level = max(level, self._finest - left.bit_length() + 1)
            rest = left - (1 << self._finest - level)
            load_now, load_then = load + rise * (1.0 - left / whole), load + rise * (1.0 - rest / whole)
            friction = self._friction_over(mode, level, z, z_comp, command, load_now, rise)
            next_z, next_comp = self._moved(mode, level, z, z_comp, command, friction, load_now, rise)
            begin, end = z.tolist(), next_z.tolist()
            holds = self._stick_slip.holds_through(mode, end, command, load_then) or not math.isfinite(end[self._v])
            if level < self._finest:
                if not holds:
                    level, hunted_to = level + 1, rest if hunted_to < 0 else hunted_to
                    continue
                if self._stick_slip.may_switch_within(
                    mode, begin, end, command, load_now, load_then, friction, 0.5**level
                ):
                    level += 1
                    continue
            piece = [step, level, mode.is_stuck, friction, load_now, 0.0, *begin, *z_comp[: self._v].tolist()]
            pieces.append(piece)
            left, z, z_comp = rest, next_z, next_comp
            if not holds:
                z, z_comp, piece[5] = self._at_rest(z, z_comp)
                mode = self._stick_slip.decide_at_rest(mode, z, command, load_then)
            if not holds or left <= hunted_to:
                level, hunted_to = self._coarsest, -1
            elif hunted_to >= 0:
                level = min(level + 1, self._finest)
            if len(pieces) > _MOST_PIECES:
                raise ArithmeticError(
                    f"Friction switched so often in plant step {step} that it took {_MOST_PIECES} pieces; "
                    "raise clock.plant_rate."
                )
        return Step(mode, z, z_comp, pieces[0][3], pieces[0][2], pieces if len(pieces) > 1 else [])

    def _friction_over(
        self, mode: StickSlipState, level: int, z: np.ndarray, z_comp: np.ndarray, command: float, load: float,
        rise: float,
    ) -> float:  # fmt: skip
        if mode.is_stuck:
            return 0.0
        v, direction = float(z[self._v]), mode.direction
        if not self._friction.is_constant:
            begun = -direction * self._friction.at(v)
            v = float(self._moved(mode, level + 1, z, z_comp, command, begun, load, rise)[0][self._v])
        return -direction * self._friction.at(v)

    def _moved(
        self, mode: StickSlipState, level: int, z: np.ndarray, z_comp: np.ndarray, command: float, friction: float,
        load: float, rise: float,
    ) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
        """Returns states and what rounding left of them after h / 2^level."""
        acting = self._acting
        acting[:-4], acting[-4], acting[-3], acting[-2], acting[-1] = z, command, friction, load, rise
        change = np.add.reduce(self._tables[mode.is_stuck][level] * acting[:, None]) + z_comp
        moved = z + change
        return moved, change - (moved - z)

    def _at_rest(self, z: np.ndarray, z_comp: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        """Returns states with body 0 at rest and all others as they move, and the energy in J that it lost."""
        z, z_comp, v = z.copy(), z_comp.copy(), float(z[self._v])
        if self._chain.count > 1:
            z[self._v + 1] += v
        z[self._v] = z_comp[self._v] = 0.0
        return z, z_comp, 0.5 * self._mass_kg * v * v


def pieces_record(chain: Chain, pieces: list[list[float]]) -> dict[str, np.ndarray]:
    """Returns the pieces of steps that were cut, ``pieces.<name>``, in order.

    step, level (a piece lasts h / 2^level), stuck, friction and load at its start (N), snap_J (what setting v to 0
    threw away at its end), every state at its start, and what rounding left of each length.
    """
    names = ["step", "level", "stuck", "friction", "load", "snap_J", *chain.states]
    names += [f"{name}_low" for name in chain.positions]
    rows = np.array(pieces, float).reshape(-1, len(names))
    return {f"pieces.{name}": np.ascontiguousarray(rows[:, i]) for i, name in enumerate(names)}


def goes_by_whole_steps(scene: Scene) -> bool:
    """Tells whether a step in which nothing switches is one piece; see ``SubstepSolver.whole_steps``."""
    is_slow = parts_of_a_step(Chain.from_scene(scene), 1.0 / scene.clock.plant_rate) == 1
    return bool(is_slow and scene.friction and Friction(scene.friction).is_constant)


def parts_of_a_step(chain: Chain, step_s: float) -> int:
    """Returns into how many pieces, a power of two, a plant step is cut so that none is longer than half a radian."""
    rates = [chain.rates(stuck)[:, : len(chain.states)].astype(float) for stuck in (False, True)]
    fastest = max(float(np.abs(np.linalg.eigvals(matrix).imag).max()) for matrix in rates)
    return 1 << max(0, math.ceil(math.log2(max(fastest * step_s / _RADIANS, 1.0))))
