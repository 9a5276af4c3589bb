"""A loop of machine code (numba) for the integrals that the books of a chain need; to the bits of NumPy."""

from __future__ import annotations

import numpy as np

from haploop.protocol.machine_code import MachineCode

_code = MachineCode(__file__, ())


@_code.compiled
def _integrate(rates, forms, lags, kind, acting, rise, result):  # pragma: no cover
    """Fills in the integrals of every segment; its kind is 2 * (its place in ``forms``) + whether body 0 is stuck."""
    count, states, products = rates.shape[1], rates.shape[2], forms.shape[3]
    w, total = np.empty(count + 1), np.empty(products)
    for s in range(len(kind)):
        of, lag, row = forms[kind[s] // 2], lags[kind[s] // 2], rates[kind[s] % 2]
        for i in range(count):
            w[i] = 0.0
            for j in range(states):
                if row[i, j] != 0.0:
                    w[i] += row[i, j] * acting[j, s]
        w[count] = rise[s]
        total[:] = 0.0
        for i in range(count + 1):
            for j in range(i, count + 1):
                both = w[i] * w[j]
                for p in range(products):
                    total[p] += of[i, j, p] * both
        result[:-1, s] = total
        last = 0.0
        for i in range(count + 1):
            if lag[i] != 0.0:
                last += lag[i] * w[i]
        result[-1, s] = last


def integrate(
    rates: np.ndarray, forms: list[tuple[np.ndarray, np.ndarray]], kind: np.ndarray, acting: list[np.ndarray],
    rise: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """Returns what ``ChainForms.integrals`` does, of segments whose forms are of float64.

    Args:
        rates: with body 0 free and held, shape (2, rates, states + 3).
        forms: (products, lag integral) of ``ChainForms.forms``.
        kind: of each segment, 2 * (which of the forms) + whether body 0 is held.
        acting: states, force, friction and tau, shape (segments,) each.
        rise: of tau, shape (segments,).
    """
    of_products = np.stack([products for products, _ in forms])
    above = np.triu(np.full(of_products.shape[-2:], 2.0), 1) + np.eye(of_products.shape[-1])
    of_pairs = np.ascontiguousarray(np.moveaxis(of_products * above, 1, -1))
    result = np.empty((len(of_products[0]) + 1, len(kind)))
    lags = np.stack([lag for _, lag in forms])
    _integrate(rates, of_pairs, lags, kind, np.stack(acting), np.ascontiguousarray(rise), result)
    return result


def try_out() -> None:
    """Compiles the loop, or loads it; raises whatever numba does."""
    zeros, rates = np.zeros(1), np.zeros((2, 1, 4))
    forms = [(np.zeros((1, 2, 2)), np.zeros(2))]
    _code.try_out(lambda: integrate(rates, forms, np.zeros(1, np.int64), [zeros] * 4, zeros))
