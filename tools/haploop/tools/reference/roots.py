"""Where a power series changes its sign, none missed, in as many digits as asked for."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

from mpmath import mp, mpf

Series = list[Any]


def roots(series: Series, length: Any) -> Series:
    """All t in [0, length] at which the polynomial sum series[k] t^k changes its sign, in order.

    Where the constant outweighs all other terms there is none. Else the roots of the derivative cut the interval into
    pieces in which it only rises or only falls, and each holds one at most.
    """
    rest, power = mpf(0), mpf(1)
    for coefficient in series[1:]:
        power *= length
        rest += abs(coefficient) * power
    if abs(series[0]) > rest or not rest:
        return []
    turns = roots([k * coefficient for k, coefficient in enumerate(series)][1:], length)
    ends = [mpf(0), *turns, length]
    found = []
    for begin, end in pairwise(ends):
        at_begin, at_end = _value(series, begin), _value(series, end)
        if at_begin == 0:
            found.append(begin)
        elif at_begin * at_end < 0:
            found.append(_between(series, begin, end, at_begin))
    return found


def _between(series: Series, begin: Any, end: Any, at_begin: Any) -> Any:
    """The one root between: Newton's steps, and a bisection wherever they would leave the bracket."""
    slope_series = [k * coefficient for k, coefficient in enumerate(series)][1:]
    t = (begin + end) / 2
    while end - begin > mp.eps * end:
        value, slope = _value(series, t), _value(slope_series, t)
        if value == 0:
            return t
        begin, end = (t, end) if value * at_begin > 0 else (begin, t)
        step = value / slope if slope else mp.inf
        t, before = t - step, t
        if not begin < t < end:
            t = (begin + end) / 2
        if abs(t - before) < mp.eps * abs(end):
            break
    return t


def _value(series: Series, t: Any) -> Any:
    total = mpf(0)
    for coefficient in reversed(series):
        total = total * t + coefficient
    return total
