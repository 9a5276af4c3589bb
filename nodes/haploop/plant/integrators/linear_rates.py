"""The rates of a chain's states, and what all one-step methods share."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from haploop.plant.chain.chain import Chain

# One row for every state: a number, or an array of numbers.
Rows = list[Any]


class LinearRates:
    """z' = A z + p of a chain of bodies, without the zeros of A.

    Args:
        stuck: whether body 0 is held where it is.

    Attributes:
        matrix: A, shape (states, states), 1/s.
        of_inputs: rates caused by a unit of command, friction and load, shape (3, states).
        count: number of bodies: rows 0 ... count - 1 of z are lengths, the next ``count`` rows their rates.
    """

    def __init__(self, chain: Chain, stuck: bool = False) -> None:
        rates, size = chain.rates(stuck), len(chain.states)
        self.matrix, self.count = rates[:, :size], chain.count
        self.of_inputs = np.ascontiguousarray(rates[:, size:].T).astype(float)
        rows = self.matrix.astype(float).tolist()
        self._rows = [[(i, factor) for i, factor in enumerate(row) if factor] for row in rows]

    def at(self, z: Rows, push: Rows) -> Rows:
        rates = []
        for row, rate in zip(self._rows, push, strict=True):
            for i, factor in row:
                rate = rate + factor * z[i]
            rates.append(rate)
        return rates


class OneStep(Protocol):
    """A method that goes from one plant step to the next by a formula, linear in z and the pushes."""

    def __init__(self, rates: LinearRates, step_s: float, /) -> None: ...

    def step(self, z: Rows, begin: Rows, middle: Rows, end: Rows, /) -> Rows:
        """Returns z at the end of a plant step; the pushes p are those at its beginning, middle and end."""
        ...


def moved(z: Rows, h: float, rates: Rows) -> Rows:
    return [a + h * rate for a, rate in zip(z, rates, strict=True)]


def response_to(push: Rows, method: OneStep) -> Rows:
    """Returns z at the end of a plant step that began at z = 0, under a push held over it."""
    return method.step([0.0] * len(push), push, push, push)
