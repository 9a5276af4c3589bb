"""The shortest history that still breaks a promise: delta debugging (Zeller & Hildebrandt 2002) over what was drawn."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeVar

from simulation.plan import Plan

Part = TypeVar("Part")


def fewest(parts: Sequence[Part], fails: Callable[[tuple[Part, ...]], bool]) -> tuple[Part, ...]:
    """Returns a part of ``parts``, in order, that still fails and of which none can be left out."""
    kept, pieces = tuple(parts), 2
    while kept:
        size = math.ceil(len(kept) / pieces)
        rests = [kept[:first] + kept[first + size :] for first in range(0, len(kept), size)]
        smaller = next((rest for rest in rests if fails(rest)), None)
        if smaller is not None:
            kept, pieces = smaller, max(pieces - 1, 2)
        elif size == 1:
            break
        else:
            pieces = min(2 * pieces, len(kept))
    return kept


def shrink(plan: Plan, breaks: Callable[[Plan], bool]) -> Plan:
    """Returns the plan with the fewest faults, the calmest network and the least scene that still breaks a promise."""
    plan = replace(plan, faults=fewest(plan.faults, lambda faults: breaks(replace(plan, faults=faults))))
    for calmer in ({"pace": math.inf}, {"jumpiness": 0.0}, {"scene": "least"}):
        if breaks(candidate := replace(plan, **calmer)):
            plan = candidate
    return plan


def tell(plan: Plan) -> str:
    """Returns a plan in lines."""
    temper = f"scene {plan.scene}, pace {plan.pace:g}, latency {plan.latency_s:g} s, jumpiness {plan.jumpiness:g}"
    faults = [f"  {fault}" for fault in plan.faults] or ["  no fault at all"]
    return "\n".join([f"seed {plan.seed}: {temper}", *faults])
