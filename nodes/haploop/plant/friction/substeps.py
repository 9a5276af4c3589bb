"""Through one plant step with dry friction: every switch found by halving the step, every piece exact."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from haploop.plant.chain.chain import Chain
from haploop.plant.chain.transition import ChainFlow
from haploop.plant.friction.law import Friction
from haploop.plant.friction.stick_slip import Mode

# A piece is halved this often to find when friction switches: to 2e-14 s at 10 kHz.
_HALVINGS = 32
# No piece is longer than this part of a radian of the fastest mode, so that no reversal hides between its ends.
_RADIANS = 0.5
_MOST_PIECES = 1_000_000
# More parts of a plant step than this are no way to simulate: the plant rate is too low.
MOST_PARTS = 4096


class Walk:
    """The way through a plant step in which body 0 may stick and slip.

    A piece of the step is moved by the exact flow. If the mode no longer holds at its end, or may have ceased within
    it, the piece is halved, until the switch lies within h / 2^32; there the mode changes, and v is set to exactly 0.0.
    The kinetic energy which that throws away, of the order of 1e-20 of what moves, is heat of friction. With a Stribeck
    velocity every piece has the friction of the speed foreseen for its middle: second order in h.

    Attributes:
        mode: whether body 0 sticks or slips.
        whole_steps: whether a step in which nothing switches is one piece, with the same friction at every speed.
    """

    def __init__(self, chain: Chain, friction: Friction, step_s: float) -> None:
        self._chain, self._friction = chain, friction
        self._v, self._mass_kg = chain.count, chain.masses_kg[0]
        self.mode = Mode(chain, friction, step_s)
        self._coarsest = parts_of_a_step(chain, step_s).bit_length() - 1
        self._finest = self._coarsest + _HALVINGS
        self.whole_steps = not self._coarsest and friction.is_constant
        self._acting = np.zeros(len(chain.states) + 4)
        self._pieces: list[list[float]] = []

    def halve(self, free: ChainFlow, clamped: ChainFlow) -> None:
        """Prepare the flows of all pieces."""
        self._flows = {stuck: flow.halves(self._finest + 1) for stuck, flow in ((False, free), (True, clamped))}

    def through(
        self, step: int, z: np.ndarray, low: np.ndarray, command: float, load: float, rise: float
    ) -> tuple[np.ndarray, np.ndarray, float, bool]:
        """Through plant step ``step``; load in N at its start, rise over it.

        Returns:
            States and what rounding left of them at the end; friction in N and whether stuck at the start.

        Raises:
            ArithmeticError: friction switched so often that it took a million pieces.
        """
        mode = self.mode
        mode.decide_at_rest(z, command, load)
        whole = left = 1 << self._finest
        level, hunted_to, pieces = self._coarsest, -1, []
        while left:
            level = max(level, self._finest - left.bit_length() + 1)
            rest = left - (1 << self._finest - level)
            load_now, load_then = load + rise * (1.0 - left / whole), load + rise * (1.0 - rest / whole)
            friction = self._friction_over(level, z, low, command, load_now, rise)
            next_z, next_low = self._moved(level, z, low, command, friction, load_now, rise)
            begin, end = z.tolist(), next_z.tolist()
            goes_on = mode.goes_on(end, command, load_then) or not math.isfinite(end[self._v])
            if level < self._finest:
                if not goes_on:
                    level, hunted_to = level + 1, rest if hunted_to < 0 else hunted_to
                    continue
                if mode.may_pause(begin, end, command, load_now, load_then, friction, 0.5**level):
                    level += 1
                    continue
            piece = [step, level, mode.is_stuck, friction, load_now, 0.0, *begin, *low[: self._v].tolist()]
            pieces.append(piece)
            left, z, low = rest, next_z, next_low
            if not goes_on:
                z, low, piece[5] = self._at_rest(z, low)
                mode.decide_at_rest(z, command, load_then)
            if not goes_on or left <= hunted_to:
                level, hunted_to = self._coarsest, -1
            elif hunted_to >= 0:
                level = min(level + 1, self._finest)
            if len(pieces) > _MOST_PIECES:
                raise ArithmeticError(
                    f"Friction switched so often in plant step {step} that it took {_MOST_PIECES} pieces; "
                    "raise clock.plant_rate."
                )
        if len(pieces) > 1:
            self._pieces += pieces
        return z, low, pieces[0][3], pieces[0][2]

    def _friction_over(
        self, level: int, z: np.ndarray, low: np.ndarray, command: float, load: float, rise: float
    ) -> float:
        """The friction force held over a piece, N."""
        if self.mode.is_stuck:
            return 0.0
        v, direction = float(z[self._v]), self.mode.direction
        if not self._friction.is_constant:
            begun = -direction * self._friction.at(v)
            v = float(self._moved(level + 1, z, low, command, begun, load, rise)[0][self._v])
        return -direction * self._friction.at(v)

    def _moved(
        self, level: int, z: np.ndarray, low: np.ndarray, command: float, friction: float, load: float, rise: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """States and what rounding left of them after h / 2^level."""
        acting = self._acting
        acting[:-4], acting[-4], acting[-3], acting[-2], acting[-1] = z, command, friction, load, rise
        change = np.add.reduce(self._flows[self.mode.is_stuck][level] * acting[:, None]) + low
        moved = z + change
        return moved, change - (moved - z)

    def _at_rest(self, z: np.ndarray, low: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        """The same with body 0 at rest, all others as they move; and the energy in J that it lost."""
        z, low, v = z.copy(), low.copy(), float(z[self._v])
        if self._chain.count > 1:
            z[self._v + 1] += v
        z[self._v] = low[self._v] = 0.0
        return z, low, 0.5 * self._mass_kg * v * v

    def take_pieces(self) -> dict[str, np.ndarray]:
        """The pieces of all steps that were cut since the last call, ``pieces.<name>``, in order.

        step, level (a piece lasts h / 2^level), stuck, friction and load at its start (N), snap_J (what setting v to
        0 threw away at its end), every state at its start, and what rounding left of each length.
        """
        chain = self._chain
        names = ["step", "level", "stuck", "friction", "load", "snap_J", *chain.states]
        names += [f"{name}_low" for name in chain.positions]
        rows = np.array(self._pieces, float).reshape(-1, len(names))
        self._pieces = []
        return {f"pieces.{name}": np.ascontiguousarray(rows[:, i]) for i, name in enumerate(names)}


def goes_by_whole_steps(scene: dict[str, Any]) -> bool:
    """Whether a step in which nothing switches is one piece; see ``Walk.whole_steps``."""
    is_slow = parts_of_a_step(Chain.of(scene), 1.0 / scene["clock"]["plant_rate"]) == 1
    return is_slow and Friction(scene["friction"]).is_constant


def parts_of_a_step(chain: Chain, step_s: float) -> int:
    """Pieces, a power of two, that a plant step is cut into so that none is longer than half a radian of any swing."""
    fastest = max(_fastest_mode(chain, stuck) for stuck in (False, True))
    return 1 << max(0, math.ceil(math.log2(max(fastest * step_s / _RADIANS, 1.0))))


def _fastest_mode(chain: Chain, stuck: bool) -> float:
    """The highest frequency with which the chain can swing, rad/s."""
    rates = chain.rates(stuck)[:, : len(chain.states)].astype(float)
    return float(np.abs(np.linalg.eigvals(rates).imag).max())
