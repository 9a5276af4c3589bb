"""The whole advice on a device or a scene: the searches, their results, and the results as data."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any

from haploop.controller.dissipation import Element
from haploop.protocol.scene.scene import Scene
from haploop.tools.advise.buzz import STEPS_BEYOND, Buzz, explain_buzz
from haploop.tools.advise.gains import Gains, Search
from haploop.tools.advise.judge import Judge
from haploop.tools.advise.largest import Limit
from haploop.tools.advise.margins import MarginSearch, Recommendation
from haploop.tools.advise.subject import Subject
from haploop.tools.advise.tasks import Tasks, make_tasks, with_wall
from haploop.tools.advise.variations import DELAY, SHARE, delay_s, uncertain_quantities
from haploop.tools.linear.bounds import Bound, bounds_of
from haploop.tools.linear.linearity import is_linear
from haploop.tools.linear.one_tick import NeverStable, OneTickMap

# An advice as one JSON object.
AdviceData = dict[str, Any]
# How many times as long the scene of the advice may be made, until its last half second is at rest.
_LONGER = (1, 4, 16, 64)
_OTHER_TASK = "The scene's own task does not end pressed to the wall; a tap and a press take its place."
_ROUNDED = "A delay a fifth less or more is rounded to whole plant steps: {:g} and {:g} ms."
_STEADY_MEANS = (
    "the summary's verdict of every run; swings that die away are followed longer, or, in a linear loop, by the exact "
    "map"
)


@dataclass(frozen=True)
class Advice:
    """The whole advice; gains, exact limits and bounds are of each family.

    Attributes:
        tolerance: relative, of the limits.
        uncertain: the quantities that were taken a fifth more or less.
        exact_N_m: rho(M) = 1, None where the loop is not linear.
        scene: that shows it, steady by its own verdict; None where nothing is safe.
        buzz: the causes of buzzing; None where nothing buzzes.
    """

    name: str
    notes: tuple[str, ...]
    tasks: Tasks
    tolerance: float
    uncertain: tuple[str, ...]
    gains: list[Gains]
    exact_N_m: list[float | None]
    bounds: list[list[Bound]]
    safe: Recommendation
    scene: Scene | None
    buzz: Buzz | None
    runs: int


def advice(
    subject: Subject,
    kinds: dict[str, type[Element]],
    judge: Judge,
    stage: Callable[[str], object] = lambda name: None,
) -> Advice:
    """Searches gains and margins, and explains what buzzes."""
    asked, notes = make_tasks(subject.scene, subject.has_task), list(subject.notes)
    if subject.has_task and len(asked.scenes) == 1:
        [itself] = judge.judge([subject.scene])
        if itself.verdict == "no-contact":
            asked = make_tasks(subject.scene, False)
    if subject.has_task and len(asked.scenes) > 1:
        notes.append(_OTHER_TASK)
    scene = asked.first
    search = Search(asked, judge, stage)
    gains = search.families()
    margins = MarginSearch(search)
    margins.uncertain(gains)
    safe = margins.safe(gains)
    placed = [with_wall(scene, found.limit.stiffness_N_m, found.family.elements(found.values)) for found in gains]
    return Advice(
        name=subject.name,
        notes=(*notes, *_rounding(scene)),
        tasks=asked,
        tolerance=search.tolerance,
        uncertain=tuple(uncertain_quantities(scene)),
        gains=gains,
        exact_N_m=[_exact(loop, kinds) for loop in placed],
        bounds=[bounds_of(loop, kinds) for loop in placed],
        safe=safe,
        scene=_shown(subject, asked, safe, judge),
        buzz=_buzz(subject, asked, safe, judge, stage),
        runs=judge.runs,
    )


def _rounding(scene: Scene) -> list[str]:
    factors, nominal = (1.0 - SHARE, 1.0 + SHARE), scene.clock.round_trip_delay
    rounded = [delay_s(scene, factor) for factor in factors]
    if DELAY not in uncertain_quantities(scene) or all(
        math.isclose(delay, nominal * factor) for delay, factor in zip(rounded, factors, strict=True)
    ):
        return []
    return [_ROUNDED.format(*(delay * 1e3 for delay in rounded))]


def _exact(scene: Scene, kinds: dict[str, type[Element]]) -> float | None:
    if not is_linear(scene, kinds):
        return None
    try:
        return OneTickMap.from_scene(scene, kinds).stiffness_limit()
    except NeverStable:
        return 0.0


def _shown(subject: Subject, asked: Tasks, safe: Recommendation, judge: Judge) -> Scene | None:
    """Returns the first task with the advised gains, as long as its swings take to die away."""
    if not safe.stiffness_N_m:
        return None
    family, values = safe.gains.family, safe.gains.safe_values
    scene = with_wall(asked.first, safe.stiffness_N_m, family.elements(values))
    title = f"{subject.name}: {safe.stiffness_N_m / 1e3:g} N/mm with {family.phrase(values)}"
    scene = replace(scene, title=title)
    for factor in _LONGER:
        longer = replace(scene, duration=scene.duration * factor)
        [judgement] = judge.judge([longer])
        if judgement.verdict == "steady" and judgement.summary["duration_s"] == longer.duration:
            scene = longer
            break
    return replace(scene, run=subject.scene.run)


def _buzz(
    subject: Subject, asked: Tasks, safe: Recommendation, judge: Judge, stage: Callable[[str], object]
) -> Buzz | None:
    """Explains the scene itself; of a preset, the advised gains with a wall just too stiff."""
    if subject.has_task and subject.scene.wall and len(asked.scenes) == 1:
        return explain_buzz(subject.scene, judge, stage)
    best = safe.gains
    limit = best.tried.get(best.safe_values, best.limit).not_steady_N_m
    if not math.isfinite(limit):
        return None
    elements = best.family.elements(best.safe_values)
    for factor in STEPS_BEYOND:
        scenes = asked.make_runs(factor * limit, elements)
        for scene, judgement in zip(scenes, judge.judge(scenes), strict=True):
            if not judgement.steady:
                return explain_buzz(scene, judge, stage)
    return None


def as_data(found: Advice, advice_text: str, buzz_text: str) -> AdviceData:
    """Returns the advice as one JSON object; the two texts are put in as they are."""
    safe, best = found.safe, found.safe.gains
    return {
        "name": found.name,
        "notes": found.notes,
        "tasks": found.tasks.words,
        "seeds": found.tasks.seeds,
        "steady_means": _STEADY_MEANS,
        "tolerance": found.tolerance,
        "uncertain": found.uncertain,
        "elements": [
            _gains_data(gains, exact, bounds)
            for gains, exact, bounds in zip(found.gains, found.exact_N_m, found.bounds, strict=True)
        ],
        "recommended": {
            "element": best.family.name,
            "parameters": _parameters(best, best.safe_values),
            "stiffness_N_m": safe.stiffness_N_m,
            "loops_tried": safe.corners,
            "nearest_instability": safe.nearest.words if safe.nearest else None,
        },
        "advice": advice_text,
        "why": _buzz_data(found.buzz, buzz_text) if found.buzz else None,
        "runs": found.runs,
    }


def _gains_data(gains: Gains, exact_N_m: float | None, bounds: list[Bound]) -> AdviceData:
    return {
        "element": gains.family.name,
        "parameters": _parameters(gains, gains.values),
        "largest": asdict(gains.limit),
        "exact_N_m": exact_N_m,
        "bounds": [asdict(bound) for bound in bounds],
        "with_a_fifth_more_or_less": {
            "parameters": _parameters(gains, gains.safe_values),
            "alone": {change.words: _ends(limit) for change, limit in gains.alone.items()},
            "worst_corner": gains.corner,
            "stiffness_N_m": gains.safe.stiffness_N_m,
        },
        "tried": [
            {"parameters": _parameters(gains, values), **_ends(limit)} for values, limit in sorted(gains.tried.items())
        ],
    }


def _parameters(gains: Gains, values: tuple[float, ...]) -> dict[str, float]:
    return {f"{kind}.{key}": value for (kind, key), value in zip(gains.family.parts, values, strict=True)}


def _ends(limit: Limit) -> dict[str, float]:
    """Returns both ends of a limit, as far apart as it took to tell it from the best, or the worst."""
    return {"stiffness_N_m": limit.stiffness_N_m, "not_steady_N_m": limit.not_steady_N_m}


def _buzz_data(buzz: Buzz, text: str) -> AdviceData:
    aside = ("scene", "is_element")
    told = asdict(buzz, dict_factory=lambda items: {key: value for key, value in items if key not in aside})
    return {"title": buzz.scene.title, **told, "because": text}
