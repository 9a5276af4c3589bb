"""Causes of buzzing: each switched off by itself, then the fewest together, with the leak books beside."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from haploop.tools.advise.causes import Cause, causes, without_causes
from haploop.tools.advise.largest import LEAST_N_M, WIDE, Limit, StiffnessQuery, largest_steady
from haploop.tools.advise.runs import execution_mode

if TYPE_CHECKING:
    from haploop.tools.advise.judge import Judge

Scene = dict[str, Any]
# A wall beyond the largest that is steady buzzes, or the next one does where this one stands on an island.
STEPS_BEYOND = 1.1, 1.3, 1.6, 2.0
_MOST_FACTOR = 1000.0


@dataclass(frozen=True)
class Ablation:
    """A loop without some of its causes.

    Attributes:
        names: of the causes.
        words: for what took their place.
        leak_J: their part of the wall's leak with them, negative where energy came out of it; None where not told.
        leak_share: that part of all that leaked that way, 0 to 1.
        steady: whether it no longer buzzes.
        verdict, oscillation_m: of its run.
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
    """The explanation why a scene buzzes, or how far it is from that.

    Attributes:
        scene: that was looked into.
        stiffness_N_m: its wall's.
        steady: whether it does not buzz.
        verdict, oscillation_m: of its run.
        limit: its own largest steady stiffness.
        elements_J: energy that each element took out of the device, negative where it fed it.
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
    alone: tuple[Ablation, ...]
    together: tuple[Ablation, ...]
    all_off: Ablation | None


def explain_buzz(scene: Scene, judge: Judge, stage: Callable[[str], object] = lambda name: None) -> Buzz:
    """Explains a resolved scene with a wall by its own task and one seed."""
    stage("why it buzzes")
    scene = {**scene, "run": {**scene["run"], "log": "none"}}
    found = causes(scene)
    parts = [cause for cause in found if not cause.is_element]
    [itself] = judge.judge([scene], energy=True)
    pace = WIDE[execution_mode(scene)]
    sets: dict[tuple[Cause, ...], Scene] = {(cause,): without_causes(scene, [cause]) for cause in found}
    cells: dict[Any, StiffnessQuery] = {names: _loops(made) for names, made in sets.items()}
    cells[()] = _loops(scene)
    limits = largest_steady(cells, judge.judge, pace)
    judged = dict(zip(sets, judge.judge(list(sets.values())), strict=True))
    leaks = _leaks(itself.summary)

    def ablation(some: tuple[Cause, ...], judgement: Any, limit: Limit | None) -> Ablation:
        leak = leaks.get(some[0].leak or "") if len(some) == 1 else None
        return Ablation(
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

    alone = tuple(ablation(some, judged[some], limits[some]) for some in sets)
    together: tuple[Ablation, ...] = ()
    all_off = None
    if not itself.steady and not any(without.steady for without in alone):
        stage("causes that only matter together")
        together = tuple(ablation(*found) for found in _fewest(scene, parts, judge))
        everything = tuple(parts)
        if not together and parts:
            all_off = ablation(everything, judge.judge([without_causes(scene, parts)])[0], None)
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
    """Returns the smallest sets of causes without which the scene is steady, with the limit without them."""
    for count in range(2, len(parts) + 1):
        sets = list(itertools.combinations(parts, count))
        made = [without_causes(scene, some) for some in sets]
        steady = [
            (some, free, judgement)
            for some, free, judgement in zip(sets, made, judge.judge(made), strict=True)
            if judgement.steady
        ]
        if steady:
            cells = {some: _loops(free) for some, free, _ in steady}
            limits = largest_steady(cells, judge.judge, WIDE[execution_mode(scene)])
            return [(some, judgement, limits[some]) for some, _, judgement in steady]
    return []


def _loops(scene: Scene) -> StiffnessQuery:
    stiffness = max(LEAST_N_M, scene["wall"]["stiffness"])

    def make(k: float, _: bool) -> list[Scene]:
        return [{**scene, "wall": {**scene["wall"], "stiffness": k}}]

    return StiffnessQuery(make, stiffness, _MOST_FACTOR * stiffness, is_one_run=True)


def _leaks(summary: dict[str, Any]) -> dict[str, tuple[float, float]]:
    """Returns each part of the wall's leak in J, and its share among those of the same sign as the whole."""
    leak = summary.get("energy", {}).get("wall", {}).get("leak")
    if not leak or leak["total_J"] is None or not math.isfinite(leak["total_J"]) or not leak["total_J"]:
        return {}
    parts = {name: value for name, value in leak.items() if name != "total_J"}
    same = sum(value for value in parts.values() if value * leak["total_J"] > 0.0)
    return {name: (value, max(0.0, value / same)) for name, value in parts.items()}
