"""Which commands are lost."""

from __future__ import annotations

from typing import Any

from haploop.plant.random.streams import Draw, RandomStream


def losses(table: dict[str, Any], seed: int) -> Draw:
    """Whether the next command is lost, each by itself with the same probability.

    Args:
        table: the resolved ``[loss]`` table: probability.
        seed: the scene's.
    """
    uniform, probability = RandomStream(seed, "loss").uniform(), table["probability"]
    return lambda: uniform() < probability
