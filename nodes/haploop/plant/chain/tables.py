"""Tables made of a chain of bodies: of one loop, or of many loops at once side by side."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from haploop.plant.chain.chain import Chain, Link
from haploop.protocol.arrays import each


def tables_of(
    make: Callable[[Chain], tuple[np.ndarray, ...]], chain: Chain, *, of_many: bool = True
) -> tuple[np.ndarray, ...]:
    """What ``make`` gives of a chain; of the chains of many loops that of each.

    Args:
        make: from a chain of floats to tables; it may not look at the start and the rest.
        chain: of a scene, or of a stacked one, whose numbers may be arrays of shape (loops,).
        of_many: whether it is of a stacked scene: the tables then have a last axis for the loops, of length 1 where all
            loops share them.
    """

    def of(*numbers: float) -> tuple[np.ndarray, ...]:
        return make(_with(chain, numbers))

    numbers = _numbers(chain)
    tables = each(of, *numbers)
    is_shared = not any(getattr(number, "shape", ()) for number in numbers)
    return tuple(table[..., None] for table in tables) if of_many and is_shared else tables


def _numbers(chain: Chain) -> list[Any]:
    numbers = [*chain.masses_kg, *(damping for _, damping in chain.grounded.values())]
    for link in chain.links:
        numbers += (link.stiffness, link.damping)
    numbers.append(chain.spring[0])
    if chain.actuator_rate is not None:
        numbers.append(chain.actuator_rate)
    return numbers if chain.sensor is None else [*numbers, chain.sensor[1]]


def _with(chain: Chain, numbers: tuple[float, ...]) -> Chain:
    left = iter(numbers)
    return replace(
        chain,
        masses_kg=tuple(next(left) for _ in chain.masses_kg),
        grounded={name: (body, next(left)) for name, (body, _) in chain.grounded.items()},
        links=tuple(Link(link.name, next(left), next(left)) for link in chain.links),
        spring=(next(left), 0.0),
        actuator_rate=None if chain.actuator_rate is None else next(left),
        sensor=None if chain.sensor is None else (chain.sensor[0], next(left)),
        start=(0.0, 0.0),
    )
