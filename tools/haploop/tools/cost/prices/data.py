"""The other prices of accuracy, as they stand in cost.json: what is bought beside the method and the plant rate."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from haploop.tools.ablation import AGAIN
from haploop.tools.cost.data import Cost, Spread
from haploop.tools.linear.stiffness_limit import StiffnessLimit


@dataclass(frozen=True)
class Price:
    """One thing that can be had or left.

    Attributes:
        what: its name.
        time: measured, in the unit of its group.
        ratio: the median over that of the group's baseline.
        costs: what it adds to a run, in the unit of its group: the median less the baseline's; of an effect, the
            baseline's, which has all of them, less the median without it.
        buys: what there is to gain, in words.
        instructions_per_tick: bytecode instructions of plant and controller; None where they were not counted.
        stiffness: up to where a wall stays steady; None where that was not asked for.
    """

    what: str
    time: Spread
    ratio: float
    costs: float
    buys: str
    instructions_per_tick: float | None = None
    stiffness: StiffnessLimit | None = None


@dataclass(frozen=True)
class PriceGroup:
    """Prices of one kind; the first of them is the baseline.

    Attributes:
        name: "books", "log", "effects", "processes", "delay" or "control rate".
        title: in words.
        unit: of the times.
        repeats: of each.
        how: in one process or as processes, which scene, what is logged.
    """

    name: str
    title: str
    unit: str
    repeats: int
    how: str
    prices: list[Price]

    @property
    def baseline(self) -> Price:
        """What the others are held against."""
        return self.prices[0]


def price(
    what: str, times: Sequence[float], baseline: Spread | None, buys: str, is_left_out: bool = False, **more: Any
) -> Price:
    """A price from repeated times; ``baseline`` is None for the baseline itself."""
    time = Spread.of(times)
    base = baseline or time
    added = time.median - base.median
    return Price(what, time, time.median / base.median, -added if is_left_out else added, buys, **more)


def chance_in(group: PriceGroup) -> float:
    """How far two equal runs of the group's baseline are apart: what is less than that is no difference.

    The difference of the baseline measured twice, where it was, and at least the distance of its quartiles.
    """
    again = [abs(price.costs) for price in group.prices if price.what == AGAIN]
    return max([*again, group.baseline.time.q3 - group.baseline.time.q1])


def as_data(groups: Sequence[PriceGroup]) -> list[dict[str, Any]]:
    """As they are stored in ``Cost.prices``."""
    return [dataclasses.asdict(group) for group in groups]


def price_groups(cost: Cost) -> list[PriceGroup]:
    """What ``Cost.prices`` holds.

    Raises:
        pydantic.ValidationError: it holds something else.
    """
    from pydantic import TypeAdapter

    return TypeAdapter(list[PriceGroup]).validate_python(cost.prices)
