"""Drift of what elements remember while their loop is watched, after which they may act differently."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from haploop.controller.asked import ENERGIES, Told
from haploop.controller.controller import Controller
from haploop.protocol.trees import tree_leaves

# How many times memory is looked at between one look at the loop and the next.
_LOOKED_AT = 64
# A memory that changes by less than this share of itself in half the time watched is said to stay.
_STAYS = 1e-3
# Standard errors from which on a change counts: if the loop is watched for longer, and if this is the last look.
_ERRORS, _ERRORS_AT_LAST = 1.0, 4.0
# Within less than this time, s, a swing of the loop's own hides a change.
_LEAST_S = 4.0


def look_ticks(first: int, end: int) -> list[int]:
    """Returns the ticks after ``first``, up to ``end``, at which memory is looked at."""
    return sorted({first + (end - first) * look // _LOOKED_AT for look in range(1, _LOOKED_AT + 1)} - {first})


def memory_of(controller: Controller, loops: int | None = None) -> np.ndarray:
    """Returns all numbers that the elements of a controller remember, shape (numbers,), or (numbers, loops) in a batch.

    They are the declared memories, the energies that an element asks for, and the attributes that an element keeps.
    """
    remembered: list[Any] = []
    *_, memories = controller.state or ((),)
    for active, memory in zip(controller.params.elements, memories, strict=False):
        if isinstance(memory, Told):
            asked = zip(ENERGIES, memory.energies, strict=True)
            remembered += [energy for name, energy in asked if name in active.element.asks]
            memory = memory.own
        parameters = active.element.values()
        kept = [value for name, value in vars(active.element).items() if name not in parameters]
        remembered += tree_leaves([memory, kept])
    shape = () if loops is None else (loops,)
    numbers = [np.broadcast_to(number, shape) for number in remembered if _is_number(number)]
    return np.array(numbers, float).reshape(len(numbers), *shape)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float | np.ndarray) and getattr(value, "ndim", 1) <= 1


def may_act(looks: Sequence[np.ndarray], swings: bool, watched_s: float, *, last: bool) -> np.ndarray:
    """Tells in which resting loops an element may yet act differently, as what it remembers keeps changing.

    Args:
        looks: see ``drifts``.
        swings: whether an unfelt swing is left, which may hide a change for a few seconds.
        watched_s: time since the push.
        last: whether the loop is not watched for longer.
    """
    if swings and watched_s < _LEAST_S and not last and looks and len(looks[0]):
        return np.ones(looks[0].shape[1:], bool)
    return drifts(looks, _ERRORS_AT_LAST if last else _ERRORS)


def drifts(looks: Sequence[np.ndarray], errors: float = _ERRORS_AT_LAST) -> np.ndarray:
    """Tells in which loops a number that an element remembers keeps changing in one direction.

    The looks are cut into four: the means of the quarters rise, or fall, from each to the next, at the end by at least
    half as much as at first, and in all by more than their uncertainty. So does the energy that a passivity observer
    has in store while a small swing draws on it (Hannaford and Ryu 2002); it acts when that energy is used up.

    Args:
        looks: at equal times from half the time watched on, shape (numbers, ...) each; of fewer than 8 nothing is said.
        errors: standard errors from which on a change counts.

    Returns:
        Truth values of shape (...).
    """
    shape = looks[0].shape[1:] if looks else ()
    if len(looks) < 8 or not len(looks[0]):
        return np.zeros(shape, bool)
    quarters = np.array_split(np.array(looks), 4)
    means = np.array([quarter.mean(axis=0) for quarter in quarters])
    error = np.array([quarter.std(axis=0) / len(quarter) ** 0.5 for quarter in quarters]).max(axis=0)
    changes, change = np.diff(means, axis=0), means[-1] - means[0]
    one_way = (changes > 0.0).all(axis=0) | (changes < 0.0).all(axis=0)
    goes_on = np.abs(changes[-1]) >= 0.5 * np.abs(changes[0])
    counts = np.abs(change) > np.maximum(errors * error, _STAYS * np.abs(means).max(axis=0))
    return (one_way & goes_on & counts).any(axis=0)
