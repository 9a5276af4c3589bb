"""A column that is a list of its rows: formulas applied to it separate into operations on each row."""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence
from functools import reduce
from types import SimpleNamespace
from typing import Any

import jax.numpy as jnp


class Rows:
    """Stands in for an array of shape (rows, members), or (rows, parts, members), in elementwise formulas.

    A compiler that is given whole columns writes every one of them to memory, shifts them against each other and sums
    them up again; given their rows it keeps a step's numbers in registers.
    """

    __array_ufunc__ = None  # NumPy leaves the operation to this class

    def __init__(self, rows: Sequence[Any]) -> None:
        self.rows = list(rows)

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, which: Any) -> Any:
        if isinstance(which, tuple):
            rows, part = which
            return Rows([row[part] for row in self.rows[rows]])
        return Rows(self.rows[which]) if isinstance(which, slice) else self.rows[which]

    def _with(self, other: Any, operation: Callable[[Any, Any], Any]) -> Rows:
        others = other.rows if isinstance(other, Rows) else [other] * len(self)
        if len(others) == 1:
            others = others * len(self)
        return Rows([operation(one, another) for one, another in zip(self.rows, others, strict=True)])

    def __add__(self, other: Any) -> Rows:
        return self._with(other, operator.add)

    def __radd__(self, other: Any) -> Rows:
        return self._with(other, lambda one, another: another + one)

    def __sub__(self, other: Any) -> Rows:
        return self._with(other, operator.sub)

    def __rsub__(self, other: Any) -> Rows:
        return self._with(other, lambda one, another: another - one)

    def __mul__(self, other: Any) -> Rows:
        return self._with(other, operator.mul)

    def __rmul__(self, other: Any) -> Rows:
        return self._with(other, lambda one, another: another * one)

    def __truediv__(self, other: Any) -> Rows:
        return self._with(other, operator.truediv)

    def __eq__(self, other: Any) -> Rows:  # pyright: ignore[reportIncompatibleMethodOverride]
        return self._with(other, operator.eq)

    def __ne__(self, other: Any) -> Rows:  # pyright: ignore[reportIncompatibleMethodOverride]
        return self._with(other, operator.ne)

    def __lt__(self, other: Any) -> Rows:
        return self._with(other, operator.lt)

    def __le__(self, other: Any) -> Rows:
        return self._with(other, operator.le)

    def __gt__(self, other: Any) -> Rows:
        return self._with(other, operator.gt)

    def __ge__(self, other: Any) -> Rows:
        return self._with(other, operator.ge)

    def __and__(self, other: Any) -> Rows:
        return self._with(other, operator.and_)

    def __or__(self, other: Any) -> Rows:
        return self._with(other, operator.or_)

    def __neg__(self) -> Rows:
        return Rows([-row for row in self.rows])

    def __abs__(self) -> Rows:
        return Rows([abs(row) for row in self.rows])

    def astype(self, _dtype: Any, copy: bool = True) -> Rows:
        """Returns itself: all is float64 already."""
        return self

    def copy(self) -> Rows:
        """Returns itself: rows are not changed in place."""
        return self

    def over(self, operation: Callable[[Any, Any], Any]) -> Any:
        """Returns all rows combined by an operation, first to last."""
        return reduce(operation, self.rows)

    def __array_namespace__(self) -> Any:
        return _NAMESPACE


def _maximum(one: Any, another: Rows) -> Rows:
    return another._with(one, jnp.maximum)


def _repeat(rows: Rows, times: int, axis: int) -> Rows:
    return Rows([row for row in rows.rows for _ in range(times)])


def _where(condition: Rows, yes: Any, no: Any) -> Rows:
    of_each = [part.rows if isinstance(part, Rows) else [part] * len(condition) for part in (yes, no)]
    return Rows([jnp.where(*row) for row in zip(condition.rows, *of_each, strict=True)])


def _of_each(function: Callable[[Any], Any]) -> Callable[[Rows], Rows]:
    return lambda rows: Rows([function(row) for row in rows.rows])


_NAMESPACE = SimpleNamespace(
    maximum=_maximum, repeat=_repeat, where=_where, sqrt=_of_each(jnp.sqrt), floor=_of_each(jnp.floor)
)
