"""Integrals over many stretches of a chain's motion at once, as exact forms of the rates at their beginnings."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from haploop.logger.books.segments import Moves
from haploop.plant.chain.chain import Chain
from haploop.plant.chain.tables import tables_of
from haploop.plant.chain.transition import ChainIntegrals


class ChainForms:
    """The integrals that the books need, of any moves; the forms of a level are made when it first occurs.

    Attributes:
        names: the integrals, in the order of the rows of ``integrals``: heat of every damper to ground and of every
            link, as ``<damper>_heat``; ``lag`` of the actuator's force behind the force held, where it has a bandwidth,
            J; and ``swing``, integral of (t - t_mid) / t_end v dt of the last body, m.
    """

    def __init__(self, chain: Chain, step_s: float) -> None:
        self._chain = chain
        self._flows = {stuck: ChainIntegrals(chain, step_s, stuck) for stuck in (False, True)}
        self._real = chain.real_for(step_s)
        self._rates = {stuck: chain.rates(stuck).astype(self._real) for stuck in (False, True)}
        self._made: dict[tuple[int, bool], tuple[np.ndarray, np.ndarray]] = {}
        bodies, rates = _velocities(chain)
        self._products = [(damping, bodies[body], bodies[body]) for body, damping in chain.grounded.values()]
        self._products += [(link.damping, *[rates[i + 1]] * 2) for i, link in enumerate(chain.links)]
        if chain.actuator_rate is not None:
            force = np.eye(len(chain.states))[chain.states.index("actuator")]
            self._products.append((1.0 / chain.actuator_rate, force, bodies[0]))
        self.names = names_of(chain)
        self._last = bodies[-1]

    def integrals(self, moves: Moves, force: np.ndarray, tau: np.ndarray, rise: np.ndarray) -> np.ndarray:
        """All integrals of all moves.

        Args:
            moves: the stretches of motion.
            force: held in each, N, shape (moves,).
            tau: of the hand, at the beginning of each, N.
            rise: by which tau rises in a whole plant step, N.

        Returns:
            Shape (integrals, moves), ordered as ``names``.
        """
        # The hand's spring pulls as far as it is from its rest; so written no digits go to where the rest lies.
        states = moves.states.copy()
        states[0] = states[0] - self._chain.spring[1] + moves.lows[0]
        acting = [of.astype(self._real, copy=False) for of in (*states, force, moves.friction, tau)]
        result = np.empty((len(self.names), *force.shape))
        for level, stuck, which in moves.groups():
            rates = [_sum_of(row, acting, which) for row in self._rates[stuck]]
            w = [*rates, rise[which]]
            products, swing = self.forms(level, stuck)
            result[:-1, which] = _forms_of(products, w)
            result[-1, which] = _sum_of(swing, w, slice(None))
        return result

    def forms(self, level: int, stuck: bool) -> tuple[np.ndarray, np.ndarray]:
        """(forms of all products, shape (products, rates, rates); form of the swing, shape (rates,))."""
        if (level, stuck) not in self._made:
            flow = self._flows[stuck]
            forms = [factor * flow.product(left, right, level) for factor, left, right in self._products]
            made = np.stack(forms), flow.lag(self._last, level)
            self._made[level, stuck] = made[0].astype(self._real), made[1].astype(self._real)
        return self._made[level, stuck]


def _velocities(chain: Chain) -> tuple[np.ndarray, np.ndarray]:
    """What picks the velocity of each body, and each relative rate, from the states' rates; (bodies, states) each."""
    rates = np.eye(len(chain.states))[: chain.count]
    return chain.absolute() @ rates, rates


class ChainFormsArray(ChainForms):
    """``ChainForms`` of many loops without friction, whose forms need no wide float; all arrays have a last axis."""

    def __init__(self, chain: Chain, step_s: float) -> None:
        def made(chain: Chain) -> tuple[np.ndarray, ...]:
            return chain.rates().astype(float), *ChainForms(chain, step_s).forms(level=0, stuck=False)

        rates, products, swing = tables_of(made, chain)
        self._chain, self._real, self.names = chain, np.float64, names_of(chain)
        self._rates, self._made = {False: rates}, {(0, False): (products, swing)}


def names_of(chain: Chain) -> list[str]:
    """What ``ChainForms.integrals`` tells, in its order."""
    heats = [f"{name}_heat" for name in (*chain.grounded, *(link.name for link in chain.links))]
    return [*heats, *["lag"] * (chain.actuator_rate is not None), "swing"]


def _sum_of(factors: np.ndarray, columns: Sequence[np.ndarray], which: slice | np.ndarray) -> np.ndarray:
    """The sum of factor times column, term by term in a fixed order (a matrix product may reorder with its size)."""
    total = np.zeros_like(columns[0][which])
    counts: Any = (factors.any(axis=-1) if factors.ndim > 1 else factors).tolist()
    for factor, column, there in zip(factors, columns, counts, strict=True):
        if there:
            total = total + factor * column[which]
    return total


def _forms_of(forms: np.ndarray, w: Sequence[np.ndarray]) -> np.ndarray:
    """w' Q w of every form Q and every column of w, in a fixed order; shape (forms, columns)."""
    total = np.zeros((len(forms), *w[0].shape), w[0].dtype)
    counts: Any = forms.any(axis=(0, *range(3, forms.ndim))).tolist()
    for i in range(len(w)):
        for j in range(i, len(w)):
            if counts[i][j]:
                entries = forms[:, i, j] if i == j else 2.0 * forms[:, i, j]
                total += entries[:, None] * (w[i] * w[j])
    return total
