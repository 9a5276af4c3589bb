"""Integrals over many stretches of a chain's motion at once, as exact forms of the rates at their beginnings."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from haploop.logger.books.segments import Segments
from haploop.plant.chain.chain import Chain
from haploop.plant.chain.transition import ChainIntegrals, make_tables
from haploop.protocol.trees import tree_select


class ChainForms:
    """The integrals that the books need, of any segments; the forms of a level are made when it first occurs.

    Args:
        chain: of a resolved scene, or of a batch, whose numbers may be arrays of shape (members,).
        step_s: duration of a plant step, s.
        of_batch: whether members have chains of their own: then without friction, whose forms need no wide float.

    Attributes:
        names: the integrals, in the order of the rows of ``integrals``: heat of every damper to ground and of every
            link, as ``<damper>_heat``; ``lag`` of the actuator's force behind the force held, where it has a bandwidth,
            J; and ``lag_integral``, integral of (t - t_mid) / t_end v dt of the last body, m.
    """

    def __init__(self, chain: Chain, step_s: float, *, of_batch: bool = False) -> None:
        self._chain = chain
        heats = [f"{name}_heat" for name in (*chain.grounded, *(link.name for link in chain.links))]
        self.names = [*heats, *["lag"] * (chain.actuator_rate is not None), "lag_integral"]
        self._made: dict[tuple[int, bool], tuple[np.ndarray, np.ndarray]] = {}
        self._of_batch = of_batch
        if of_batch:
            rates, *forms = make_tables(lambda one: _tables(one, step_s), chain, has_members=True)
            self._real: Any = np.float64
            self._rates, self._made[0, False] = {False: rates}, (forms[0], forms[1])
            return
        self._flows = {stuck: ChainIntegrals(chain, step_s, stuck) for stuck in (False, True)}
        self._real = chain.real_for(step_s)
        self._rates = {stuck: chain.rates(stuck).astype(self._real) for stuck in (False, True)}
        rates = np.eye(len(chain.states))[: chain.count]
        bodies = chain.absolute() @ rates  # what picks the velocity of each body from the rates of the states
        self._products = [(damping, bodies[body], bodies[body]) for body, damping in chain.grounded.values()]
        self._products += [(link.damping, *[rates[i + 1]] * 2) for i, link in enumerate(chain.links)]
        if chain.actuator_rate is not None:
            force = np.eye(len(chain.states))[chain.states.index("actuator")]
            self._products.append((1.0 / chain.actuator_rate, force, bodies[0]))
        self._last = bodies[-1]

    def integrals(self, segments: Segments, force: np.ndarray, tau: np.ndarray, rise: np.ndarray) -> np.ndarray:
        """Returns all integrals of all segments.

        Args:
            segments: the stretches of motion.
            force: held in each, N, shape (segments,), or (segments, batch).
            tau: of the hand, at the beginning of each, N.
            rise: by which tau rises in a whole plant step, N.

        Returns:
            Shape (integrals, segments), or (integrals, segments, batch), ordered as ``names``.
        """
        # The hand's spring pulls as far as it is from its rest; so written no digits go to where the rest lies.
        states = segments.states.copy()
        states[0] = states[0] - self._chain.spring[1] + segments.lows[0]
        acting = [of.astype(self._real, copy=False) for of in (*states, force, segments.friction, tau)]
        groups, result = segments.groups(), np.empty((len(self.names), *force.shape))
        if len(groups) > 1:
            acting, rise = [np.broadcast_to(of, force.shape) for of in acting], np.broadcast_to(rise, force.shape)
        for level, stuck, which in groups:
            rates = [_sum_of(row, acting, which) for row in self._rates[stuck]]
            w = [*rates, rise[which]]
            products, lag_integral = self.forms(level, stuck)
            result[:-1, which] = _forms_of(products, w)
            result[-1, which] = _sum_of(lag_integral, w, slice(None))
        return result

    def forms(self, level: int, stuck: bool) -> tuple[np.ndarray, np.ndarray]:
        """Returns (forms of all products, shape (products, rates, rates); form of the lag integral, shape (rates,))."""
        if (level, stuck) not in self._made:
            flow = self._flows[stuck]
            forms = [factor * flow.product(left, right, level) for factor, left, right in self._products]
            made = np.stack(forms), flow.lag(self._last, level)
            self._made[level, stuck] = made[0].astype(self._real), made[1].astype(self._real)
        return self._made[level, stuck]

    def select(self, kept: np.ndarray) -> None:
        """Drops the members of a batch for which ``kept``, shape (members,), is false."""
        if self._of_batch:
            self._chain, self._rates, self._made = tree_select((self._chain, self._rates, self._made), kept)


def _tables(chain: Chain, step_s: float) -> tuple[np.ndarray, ...]:
    return chain.rates().astype(float), *ChainForms(chain, step_s).forms(level=0, stuck=False)


def _sum_of(factors: np.ndarray, columns: Sequence[np.ndarray], which: slice | np.ndarray) -> np.ndarray:
    """Returns the sum of factor times column in a fixed order (a matrix product may reorder with its size)."""
    total = np.zeros_like(columns[0][which])
    counts: Any = (factors.any(axis=-1) if factors.ndim > 1 else factors).tolist()
    for factor, column, there in zip(factors, columns, counts, strict=True):
        if there:
            total = total + factor * column[which]
    return total


def _forms_of(forms: np.ndarray, w: Sequence[np.ndarray]) -> np.ndarray:
    """Returns w' Q w of every form Q and every column of w in a fixed order, shape (forms, columns)."""
    total = np.zeros((len(forms), *w[0].shape), w[0].dtype)
    counts: Any = forms.any(axis=(0, *range(3, forms.ndim))).tolist()
    for i in range(len(w)):
        for j in range(i, len(w)):
            if counts[i][j]:
                entries = forms[:, i, j] if i == j else 2.0 * forms[:, i, j]
                between = [1] * (w[0].ndim - entries.ndim + 1)
                total += entries.reshape(len(entries), *between, *entries.shape[1:]) * (w[i] * w[j])
    return total
