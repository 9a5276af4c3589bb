"""The whole advice on a device or a scene: the searches, their results, and the results as data."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from haploop.tools.advise.buzz import STEPS_BEYOND, Ablation, Buzz, explain_buzz
from haploop.tools.advise.gains import Gains, Search
from haploop.tools.advise.largest import Limit
from haploop.tools.advise.margins import MarginSearch, Recommendation
from haploop.tools.advise.tasks import Tasks, make_tasks, with_wall
from haploop.tools.advise.variations import DELAY, SHARE, delay_s, uncertain_quantities
from haploop.tools.linear.bounds import Bound, bounds_of
from haploop.tools.linear.linearity import is_linear
from haploop.tools.linear.one_tick import NeverStable, OneTickMap

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element
    from haploop.tools.advise.judge import Judge
    from haploop.tools.advise.subject import Subject

Scene = dict[str, Any]
# How many times as long the scene of the advice may be made, until its last half second is at rest.
_LONGER = (1, 4, 16, 64)


@dataclass(frozen=True)
class Advice:
    """The whole advice.

    Attributes:
        name: of the device or scene.
        notes: what was assumed.
        tasks: by which every loop was judged.
        tolerance: relative, of the limits.
        uncertain: the quantities that were taken a fifth more or less.
        gains: of each family.
        exact_N_m: of each family the exact limit, rho(M) = 1, None where the loop is not linear.
        bounds: of each family the analytic bounds.
        safe: the gains to use.
        scene: that shows it, steady by its own verdict; None where nothing is safe.
        buzz: the causes of buzzing; None where nothing buzzes.
        runs: how many were run.
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
        notes.append("The scene's own task does not end pressed to the wall; a tap and a press take its place.")
    scene = asked.first
    search = Search(asked, judge, stage)
    gains = search.families()
    margins = MarginSearch(search)
    margins.uncertain(gains)
    safe = margins.safe(gains)
    placed = [_placed(scene, found) for found in gains]
    notes += _rounding(scene)
    return Advice(
        name=subject.name,
        notes=tuple(notes),
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


def _placed(scene: Scene, found: Gains) -> Scene:
    return with_wall(scene, found.limit.stiffness_N_m, found.family.elements(found.values))


def _rounding(scene: Scene) -> list[str]:
    """Returns a note where a fifth of the delay is no whole number of plant steps."""
    nominal = scene["clock"]["round_trip_delay"]
    if DELAY not in uncertain_quantities(scene):
        return []
    less, more = delay_s(scene, 1.0 - SHARE), delay_s(scene, 1.0 + SHARE)
    if math.isclose(less, nominal * (1.0 - SHARE)) and math.isclose(more, nominal * (1.0 + SHARE)):
        return []
    return [f"A delay a fifth less or more is rounded to whole plant steps: {less * 1e3:g} and {more * 1e3:g} ms."]


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
    best = safe.gains
    scene = with_wall(asked.first, safe.stiffness_N_m, best.family.elements(best.safe_values))
    scene["title"] = f"{subject.name}: {safe.stiffness_N_m / 1e3:g} N/mm with {best.family.phrase(best.safe_values)}"
    for factor in _LONGER:
        longer = {**scene, "duration": scene["duration"] * factor}
        [judgement] = judge.judge([longer])
        if judgement.verdict == "steady" and judgement.summary["duration_s"] == longer["duration"]:
            return {**longer, "run": subject.scene["run"]}
    return {**scene, "run": subject.scene["run"]}


def _buzz(
    subject: Subject, asked: Tasks, safe: Recommendation, judge: Judge, stage: Callable[[str], object]
) -> Buzz | None:
    """Explains the scene itself; of a preset, the advised gains with a wall just too stiff."""
    if subject.has_task and "wall" in subject.scene and len(asked.scenes) == 1:
        return explain_buzz(subject.scene, judge, stage)
    best = safe.gains
    limit = best.tried[best.safe_values].not_steady_N_m if best.safe_values in best.tried else best.limit.not_steady_N_m
    if not math.isfinite(limit):
        return None
    elements = best.family.elements(best.safe_values)
    for factor in STEPS_BEYOND:
        scenes = asked.make_runs(factor * limit, elements)
        for scene, judgement in zip(scenes, judge.judge(scenes), strict=True):
            if not judgement.steady:
                return explain_buzz(scene, judge, stage)
    return None


def as_data(found: Advice, advice_text: str, buzz_text: str) -> dict[str, Any]:
    """Returns the advice as one JSON object; the two texts are put in as they are."""
    safe, best = found.safe, found.safe.gains
    return {
        "name": found.name,
        "notes": list(found.notes),
        "tasks": found.tasks.words,
        "seeds": found.tasks.seeds,
        "steady_means": "the summary's verdict of every run; swings that die away are followed longer, or, in a linear "
        "loop, by the exact map",
        "tolerance": found.tolerance,
        "uncertain": list(found.uncertain),
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


def _gains_data(gains: Gains, exact_N_m: float | None, bounds: list[Bound]) -> dict[str, Any]:
    return {
        "element": gains.family.name,
        "parameters": _parameters(gains, gains.values),
        "largest": _limit_data(gains.limit),
        "exact_N_m": exact_N_m,
        "bounds": [asdict(bound) for bound in bounds],
        "with_a_fifth_more_or_less": {
            "parameters": _parameters(gains, gains.safe_values),
            "alone": {change.words: _ends_data(limit) for change, limit in gains.alone.items()},
            "worst_corner": gains.corner,
            "stiffness_N_m": gains.safe.stiffness_N_m,
        },
        "tried": [
            {"parameters": _parameters(gains, values), **_ends_data(limit)}
            for values, limit in sorted(gains.tried.items())
        ],
    }


def _parameters(gains: Gains, values: tuple[float, ...]) -> dict[str, float]:
    return {f"{kind}.{key}": value for (kind, key), value in zip(gains.family.parts, values, strict=True)}


def _limit_data(limit: Limit) -> dict[str, Any]:
    return {**_ends_data(limit), "steady_above_N_m": list(limit.islands_N_m)}


def _ends_data(limit: Limit) -> dict[str, Any]:
    """Returns both ends of a limit, as far apart as it took to tell it from the best, or the worst."""
    return {"stiffness_N_m": limit.stiffness_N_m, "not_steady_N_m": limit.not_steady_N_m}


def _buzz_data(buzz: Buzz, text: str) -> dict[str, Any]:
    return {
        "title": buzz.scene["title"],
        "stiffness_N_m": buzz.stiffness_N_m,
        "steady": buzz.steady,
        "verdict": buzz.verdict,
        "oscillation_m": buzz.oscillation_m,
        "largest": _limit_data(buzz.limit),
        "elements_true_J": dict(buzz.elements_J),
        "alone": [_without_data(without) for without in buzz.alone],
        "together": [_without_data(without) for without in buzz.together],
        "without_all": _without_data(buzz.all_off) if buzz.all_off else None,
        "because": text,
    }


def _without_data(without: Ablation) -> dict[str, Any]:
    return {
        "without": list(without.names),
        "instead": without.words,
        "leak_J": without.leak_J,
        "leak_share": without.leak_share,
        "steady": without.steady,
        "verdict": without.verdict,
        "oscillation_m": without.oscillation_m,
        "largest": _limit_data(without.limit) if without.limit else None,
    }
