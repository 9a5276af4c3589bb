"""Why does it buzz? Each cause switched off by itself, then the fewest together, and the leak books beside."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from haploop.tools.advise.effects_off import Cause, causes, freed
from haploop.tools.advise.limits.largest import LEAST_N_M, Limit, Loops, largest
from haploop.tools.advise.limits.pace import WIDE, way

if TYPE_CHECKING:
    from haploop.tools.advise.limits.steady import Judge

Scene = dict[str, Any]
# A wall beyond the largest that is steady buzzes, or the next one does where this one stands on an island.
STEPS_BEYOND = 1.1, 1.3, 1.6, 2.0
_MOST_FACTOR = 1000.0


@dataclass(frozen=True)
class Without:
    """What a loop does without some of its causes.

    Attributes:
        names: of the causes.
        words: what took their place.
        leak_J: their part of the wall's leak with them, negative where energy came out of it; None where not told.
        leak_share: that part of all that leaked that way, 0 to 1.
        steady: whether it no longer buzzes.
        verdict, oscillation_m: what it came to.
        limit: the largest steady stiffness; None where it was not looked for.
        is_element: whether it is a dissipation element.
    """

    names: tuple[str, ...]
    words: str
    leak_J: float | None
    leak_share: float | None
    steady: bool
    verdict: str
    oscillation_m: float
    limit: Limit | None
    is_element: bool


@dataclass(frozen=True)
class Buzz:
    """Why a scene buzzes, or how far it is from that.

    Attributes:
        scene: that was looked into.
        stiffness_N_m: its wall's.
        steady: whether it does not buzz.
        verdict, oscillation_m: what it came to.
        limit: its own largest steady stiffness.
        elements_J: what each element took out of the device, negative where it fed it.
        alone: without each cause by itself.
        together: the smallest sets of causes without which it is steady; empty where single ones do.
        all_off: without any cause but elements.
    """

    scene: Scene
    stiffness_N_m: float
    steady: bool
    verdict: str
    oscillation_m: float
    limit: Limit
    elements_J: tuple[tuple[str, float], ...]
    alone: tuple[Without, ...]
    together: tuple[Without, ...]
    all_off: Without | None


def why(scene: Scene, judge: Judge, stage: Callable[[str], object] = lambda name: None) -> Buzz:
    """Look into a resolved scene with a wall; its own task, one seed."""
    stage("why it buzzes")
    scene = {**scene, "run": {**scene["run"], "log": "none"}}
    found = causes(scene)
    parts = [cause for cause in found if not cause.is_element]
    [itself] = judge.judged([scene], energy=True)
    pace = WIDE[way(scene)]
    sets: dict[tuple[Cause, ...], Scene] = {(cause,): freed(scene, [cause]) for cause in found}
    cells: dict[Any, Loops] = {names: _loops(made) for names, made in sets.items()}
    cells[()] = _loops(scene)
    limits = largest(cells, judge.judged, pace)
    judged = dict(zip(sets, judge.judged(list(sets.values())), strict=True))
    leaks = _leaks(itself.summary)

    def told(some: tuple[Cause, ...], judgement: Any, limit: Limit | None) -> Without:
        leak = leaks.get(some[0].leak or "") if len(some) == 1 else None
        return Without(
            names=tuple(cause.name for cause in some),
            words=", ".join(cause.without for cause in some),
            leak_J=leak[0] if leak else None,
            leak_share=leak[1] if leak else None,
            steady=judgement.steady,
            verdict=judgement.verdict,
            oscillation_m=judgement.oscillation_m,
            limit=limit,
            is_element=any(cause.is_element for cause in some),
        )

    alone = tuple(told(some, judged[some], limits[some]) for some in sets)
    together: tuple[Without, ...] = ()
    all_off = None
    if not itself.steady and not any(without.steady for without in alone):
        stage("causes that only matter together")
        together = tuple(told(*found) for found in _fewest(scene, parts, judge))
        everything = tuple(parts)
        if not together and parts:
            all_off = told(everything, judge.judged([freed(scene, parts)])[0], None)
    energies = itself.summary.get("energy", {}).get("elements", [])
    return Buzz(
        scene=scene,
        stiffness_N_m=scene["wall"]["stiffness"],
        steady=itself.steady,
        verdict=itself.verdict,
        oscillation_m=itself.oscillation_m,
        limit=limits[()],
        elements_J=tuple((entry["kind"], entry["true_J"]) for entry in energies),
        alone=alone,
        together=together,
        all_off=all_off,
    )


def _fewest(scene: Scene, parts: list[Cause], judge: Judge) -> list[tuple[tuple[Cause, ...], Any, Limit]]:
    """The smallest sets of causes without which the scene is steady, with the limit without them."""
    for count in range(2, len(parts) + 1):
        sets = list(itertools.combinations(parts, count))
        made = [freed(scene, some) for some in sets]
        steady = [
            (some, free, judgement)
            for some, free, judgement in zip(sets, made, judge.judged(made), strict=True)
            if judgement.steady
        ]
        if steady:
            cells = {some: _loops(free) for some, free, _ in steady}
            limits = largest(cells, judge.judged, WIDE[way(scene)])
            return [(some, judgement, limits[some]) for some, _, judgement in steady]
    return []


def _loops(scene: Scene) -> Loops:
    stiffness = max(LEAST_N_M, scene["wall"]["stiffness"])

    def make(k: float, _: bool) -> list[Scene]:
        return [{**scene, "wall": {**scene["wall"], "stiffness": k}}]

    return Loops(make, stiffness, _MOST_FACTOR * stiffness, are_few=True)


def _leaks(summary: dict[str, Any]) -> dict[str, tuple[float, float]]:
    """Each part of the wall's leak in J, and its share among those of the same sign as the whole."""
    leak = summary.get("energy", {}).get("wall", {}).get("leak")
    if not leak or leak["total_J"] is None or not math.isfinite(leak["total_J"]) or not leak["total_J"]:
        return {}
    parts = {name: value for name, value in leak.items() if name != "total_J"}
    same = sum(value for value in parts.values() if value * leak["total_J"] > 0.0)
    return {name: (value, max(0.0, value / same)) for name, value in parts.items()}
