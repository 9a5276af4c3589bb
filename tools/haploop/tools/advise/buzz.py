"""Causes of buzzing: each switched off by itself, then the fewest together, with the leak books beside."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

from haploop.logger.summary import Summary
from haploop.protocol.scene.paths import value_at, with_value
from haploop.protocol.scene.scene import Scene
from haploop.tools.advise.judge import Judge, Judgement, execution_mode
from haploop.tools.advise.largest import LEAST_N_M, WIDE, Limit, StiffnessQuery, largest_steady
from haploop.tools.advise.variations import Cause, causes, without_causes

Causes = tuple[Cause, ...]
# A wall beyond the largest that is steady buzzes, or the next one does where this one stands on an island.
STEPS_BEYOND = 1.1, 1.3, 1.6, 2.0
_MOST_FACTOR = 1000.0


@dataclass(frozen=True)
class Ablation:
    """A loop without some of its causes.

    Attributes:
        instead: words for what took their place.
        leak_J: their part of the wall's leak with them, negative where energy came out of it; None where not told.
        leak_share: that part of all that leaked that way, 0 to 1.
        steady, verdict, oscillation_m: of its run.
        largest: the largest steady stiffness; None where it was not looked for.
    """

    without: tuple[str, ...]
    instead: str
    leak_J: float | None
    leak_share: float | None
    steady: bool
    verdict: str
    oscillation_m: float
    largest: Limit | None
    is_element: bool = False


@dataclass(frozen=True)
class Buzz:
    """The explanation why a scene buzzes, or how far it is from that.

    Attributes:
        scene, stiffness_N_m: that was looked into, and its wall's.
        steady, verdict, oscillation_m: of its run.
        largest: its own largest steady stiffness.
        elements_true_J: energy that each element took out of the device, negative where it fed it.
        alone: without each cause by itself.
        together: the smallest sets of causes without which it is steady; empty where single ones do.
        without_all: without any cause but elements.
    """

    scene: Scene
    stiffness_N_m: float
    steady: bool
    verdict: str
    oscillation_m: float
    largest: Limit
    elements_true_J: dict[str, float]
    alone: tuple[Ablation, ...]
    together: tuple[Ablation, ...]
    without_all: Ablation | None


def explain_buzz(scene: Scene, judge: Judge, stage: Callable[[str], object] = lambda name: None) -> Buzz:
    """Explains a resolved scene with a wall by its own task and one seed."""
    stage("why it buzzes")
    scene = with_value(scene, "run.log", "none")
    found = causes(scene)
    parts = tuple(cause for cause in found if not cause.is_element)
    [itself] = judge.judge([scene], energy=True)
    sets: dict[Causes, Scene] = {(cause,): without_causes(scene, [cause]) for cause in found}
    cells = {names: _query(made) for names, made in sets.items()} | {(): _query(scene)}
    limits = largest_steady(cells, judge.judge, WIDE[execution_mode(scene)])
    judged = dict(zip(sets, judge.judge(list(sets.values())), strict=True))
    leaks = _leaks(itself.summary)

    def ablation(some: Causes, judgement: Judgement, limit: Limit | None) -> Ablation:
        leak = leaks.get(some[0].leak or "", (None, None)) if len(some) == 1 else (None, None)
        ran = judgement.steady, judgement.verdict, judgement.oscillation_m
        instead = ", ".join(cause.without for cause in some)
        is_element = any(cause.is_element for cause in some)
        return Ablation(tuple(cause.name for cause in some), instead, *leak, *ran, limit, is_element)

    alone = tuple(ablation(some, judged[some], limits[some]) for some in sets)
    together: tuple[Ablation, ...] = ()
    without_all = None
    if not itself.steady and not any(without.steady for without in alone):
        stage("causes that only matter together")
        together = tuple(ablation(*found) for found in _fewest(scene, parts, judge))
        if not together and parts:
            without_all = ablation(parts, judge.judge([without_causes(scene, parts)])[0], None)
    energies = itself.summary.get("energy", {}).get("elements", [])
    ran = itself.steady, itself.verdict, itself.oscillation_m
    elements_true_J = {entry["kind"]: entry["true_J"] for entry in energies}
    stiffness = value_at(scene, "wall.stiffness")
    return Buzz(scene, stiffness, *ran, limits[()], elements_true_J, alone, together, without_all)


def _fewest(scene: Scene, parts: Causes, judge: Judge) -> list[tuple[Causes, Judgement, Limit]]:
    """Returns the smallest sets of causes without which the scene is steady, with the limit without them."""
    for count in range(2, len(parts) + 1):
        made = {some: without_causes(scene, some) for some in itertools.combinations(parts, count)}
        judged = dict(zip(made, judge.judge(list(made.values())), strict=True))
        if cells := {some: _query(made[some]) for some, judgement in judged.items() if judgement.steady}:
            limits = largest_steady(cells, judge.judge, WIDE[execution_mode(scene)])
            return [(some, judged[some], limits[some]) for some in cells]
    return []


def _query(scene: Scene) -> StiffnessQuery:
    stiffness = max(LEAST_N_M, value_at(scene, "wall.stiffness"))
    most = _MOST_FACTOR * stiffness
    return StiffnessQuery(lambda k, _: [with_value(scene, "wall.stiffness", k)], stiffness, most, is_one_run=True)


def _leaks(summary: Summary) -> dict[str, tuple[float, float]]:
    """Returns each part of the wall's leak in J, and its share among those of the same sign as the whole."""
    leak = summary.get("energy", {}).get("wall", {}).get("leak")
    if not leak or leak["total_J"] is None or not math.isfinite(leak["total_J"]) or not leak["total_J"]:
        return {}
    parts = {name: value for name, value in leak.items() if name != "total_J"}
    same = sum(value for value in parts.values() if value * leak["total_J"] > 0.0)
    return {name: (value, max(0.0, value / same)) for name, value in parts.items()}
