"""The whole advice on a device or a scene: what is searched, what comes out, and as data for programs."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from haploop.tools.advise.buzz import STEPS_BEYOND, Buzz, Without, why
from haploop.tools.advise.limits.gains import Gains, Search
from haploop.tools.advise.limits.largest import Limit
from haploop.tools.advise.limits.margins import Margins, Safe
from haploop.tools.advise.limits.tasks import Tasks, tasks, with_wall
from haploop.tools.advise.limits.variations import DELAY, SHARE, delay_s, quantities
from haploop.tools.advise.sentences import buzz_sentences, gain_sentences
from haploop.tools.linear.bounds import Bound, bounds_of
from haploop.tools.linear.linearity import is_linear
from haploop.tools.linear.one_tick import NeverStable, OneTickMap

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element
    from haploop.tools.advise.limits.steady import Judge
    from haploop.tools.advise.subject import Subject

Scene = dict[str, Any]
# How many times as long the scene of the advice may be made, until its last half second is at rest.
_LONGER = (1, 4, 16, 64)


@dataclass(frozen=True)
class Advice:
    """What came of it all.

    Attributes:
        name: of the device or scene.
        notes: what was assumed.
        tasks: that every loop was judged by.
        tolerance: relative, of the limits.
        uncertain: what was taken a fifth more or less.
        gains: of each family.
        exact_N_m: of each family the exact limit, rho(M) = 1, None where the loop is not linear.
        bounds: of each family the analytic bounds.
        safe: what to use.
        scene: that shows it, steady by its own verdict; None where nothing is safe.
        buzz: why it buzzes; None where nothing does.
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
    safe: Safe
    scene: Scene | None
    buzz: Buzz | None
    runs: int


def advice(
    subject: Subject,
    kinds: dict[str, type[Element]],
    judge: Judge,
    stage: Callable[[str], object] = lambda name: None,
) -> Advice:
    """Search, compare, and look into what buzzes."""
    asked, notes = tasks(subject.scene, subject.has_task), list(subject.notes)
    if subject.has_task and len(asked.scenes) == 1:
        [itself] = judge.judged([subject.scene])
        if itself.verdict == "no-contact":
            asked = tasks(subject.scene, False)
    if subject.has_task and len(asked.scenes) > 1:
        notes.append("The scene's own task does not end pressed to the wall; a tap and a press take its place.")
    scene = asked.first
    search = Search(asked, judge, stage)
    gains = search.families()
    margins = Margins(search)
    margins.uncertain(gains)
    safe = margins.safe(gains)
    placed = [_placed(scene, found) for found in gains]
    notes += _rounding(scene)
    return Advice(
        name=subject.name,
        notes=tuple(notes),
        tasks=asked,
        tolerance=search.tolerance,
        uncertain=tuple(quantities(scene)),
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
    """Says so where a fifth of the delay is no whole number of plant steps."""
    nominal = scene["clock"]["round_trip_delay"]
    if DELAY not in quantities(scene):
        return []
    less, more = delay_s(scene, 1.0 - SHARE), delay_s(scene, 1.0 + SHARE)
    if math.isclose(less, nominal * (1.0 - SHARE)) and math.isclose(more, nominal * (1.0 + SHARE)):
        return []
    return [f"A delay a fifth less or more is rounded to whole plant steps: {less * 1e3:g} and {more * 1e3:g} ms."]


def _exact(scene: Scene, kinds: dict[str, type[Element]]) -> float | None:
    if not is_linear(scene, kinds):
        return None
    try:
        return OneTickMap.of(scene, kinds).stiffness_limit()
    except NeverStable:
        return 0.0


def _shown(subject: Subject, asked: Tasks, safe: Safe, judge: Judge) -> Scene | None:
    """The first task with the advised gains, as long as its swings take to die away."""
    if not safe.stiffness_N_m:
        return None
    best = safe.gains
    scene = with_wall(asked.first, safe.stiffness_N_m, best.family.elements(best.safe_values))
    scene["title"] = f"{subject.name}: {safe.stiffness_N_m / 1e3:g} N/mm with {best.family.phrase(best.safe_values)}"
    for factor in _LONGER:
        longer = {**scene, "duration": scene["duration"] * factor}
        [judgement] = judge.judged([longer])
        if judgement.verdict == "steady" and judgement.summary["duration_s"] == longer["duration"]:
            return {**longer, "run": subject.scene["run"]}
    return {**scene, "run": subject.scene["run"]}


def _buzz(subject: Subject, asked: Tasks, safe: Safe, judge: Judge, stage: Callable[[str], object]) -> Buzz | None:
    """Of a scene, the scene itself; of a preset, what is advised with a wall just too stiff."""
    if subject.has_task and "wall" in subject.scene and len(asked.scenes) == 1:
        return why(subject.scene, judge, stage)
    best = safe.gains
    limit = best.tried[best.safe_values].not_steady_N_m if best.safe_values in best.tried else best.limit.not_steady_N_m
    if not math.isfinite(limit):
        return None
    elements = best.family.elements(best.safe_values)
    for factor in STEPS_BEYOND:
        scenes = asked.of(factor * limit, elements)
        for scene, judgement in zip(scenes, judge.judged(scenes), strict=True):
            if not judgement.steady:
                return why(scene, judge, stage)
    return None


def as_data(found: Advice) -> dict[str, Any]:
    """One JSON object."""
    sentence, *more = gain_sentences(found)
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
        "advice": " ".join([sentence, *more]),
        "why": _buzz_data(found.buzz) if found.buzz else None,
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
    """Of what was not the best, or not the worst, they are as far apart as it took to tell."""
    return {"stiffness_N_m": limit.stiffness_N_m, "not_steady_N_m": limit.not_steady_N_m}


def _buzz_data(buzz: Buzz) -> dict[str, Any]:
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
        "because": " ".join(buzz_sentences(buzz)),
    }


def _without_data(without: Without) -> dict[str, Any]:
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
