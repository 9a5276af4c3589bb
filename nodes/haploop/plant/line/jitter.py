"""How much later than the round-trip delay each command arrives."""

from __future__ import annotations

from typing import Any

from haploop.plant.random.streams import Draw, RandomStream


def additional_delays(table: dict[str, Any], seed: int, plant_rate: int) -> Draw:
    """Additional delay of the next command in whole plant steps, j_k >= 0.

        uniform   0, 1, ... most, equally likely
        gamma     shape (mean / deviation)^2, scale deviation^2 / mean, rounded to the nearest step

    Args:
        table: the resolved ``[jitter]`` table: kind, then most, or mean and deviation, in s.
        seed: the scene's.
        plant_rate: plant steps per second.
    """
    stream = RandomStream(seed, "jitter")
    if table["kind"] == "uniform":
        return stream.whole(round(table["most"] * plant_rate) + 1)
    mean, deviation = table["mean"], table["deviation"]
    gamma, scale_steps = stream.gamma((mean / deviation) ** 2), deviation / mean * deviation * plant_rate
    return lambda: round(scale_steps * gamma())
