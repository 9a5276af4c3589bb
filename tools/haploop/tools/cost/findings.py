"""Five findings in plain words about what accuracy costs: data decide which sentences are said, with which numbers."""

from __future__ import annotations

from collections import Counter

from haploop.tools.cost.advice import cheapest, meets, rate, setting
from haploop.tools.cost.data import Cost, Point, SceneCost
from haploop.tools.cost.finding_words import Finding, joined, length, name_of, of_scenes, rates, span
from haploop.tools.cost.prices.data import price_groups
from haploop.tools.cost.prices.findings import other_prices, stiffness
from haploop.tools.render.units import amount


def findings(cost: Cost, count: int = 5) -> list[Finding]:
    """The first findings for which there are data; those further down stand in for what was not measured."""
    groups = {group.name: group for group in price_groups(cost)}
    candidates = [
        cheapest_setting(cost),
        other_methods(cost),
        failures(cost),
        other_prices(groups),
        stiffness(groups),
        own_settings(cost),
        more_steps(cost),
        verdicts(cost),
    ]
    return [finding for finding in candidates if finding][:count]


def comparable(cost: Cost) -> list[SceneCost]:
    """The scenes whose reference is known well enough for the tolerance, and of which times are known."""
    return [
        scene
        for scene in cost.scenes
        if scene.reference.error_m <= cost.tolerance_m and any(point.us_per_tick for point in scene.points)
    ]


def winner(cost: Cost) -> str | None:
    """The method that is the cheapest within the tolerance in most scenes."""
    best = [found.method for scene in comparable(cost) if (found := cheapest(scene, cost.tolerance_m))]
    return Counter(best).most_common(1)[0][0] if best else None


def cheapest_setting(cost: Cost) -> Finding | None:
    """Which method meets the tolerance in the least time, where, and what does where it does not."""
    scenes, method = comparable(cost), winner(cost)
    if not scenes:
        return None
    within = f"within {amount(cost.tolerance_m, 'm')} of the reference"
    if method is None:
        return Finding("The cheapest setting", f"No setting came {within} in {of_scenes(len(scenes), len(scenes))}.")
    best = {name_of(scene): cheapest(scene, cost.tolerance_m) for scene in scenes}
    won = [point for point in best.values() if point and point.method == method]
    at = f"{of_scenes(len(won), len(scenes))}, at a plant rate of {rates(won)}"
    others = [f"{setting(point)} ({title})" for title, point in best.items() if point and point.method != method]
    missed = [title for title, point in best.items() if point is None]
    errors = [_size(point) for scene in scenes for point in _of_method(scene, method) if point.error]
    sentences = [f"{method} is the cheapest method {within} in {at}"]
    sentences += [f"Elsewhere it is {joined(others)}"] if others else []
    sentences += [f"No setting is that close in {joined(missed)}"] if missed else []
    sentences += [f"Its largest error at any plant rate is {length(max(errors))}", *_left_out(cost)]
    return Finding("The cheapest setting", f"{'. '.join(sentences)}.")


def _left_out(cost: Cost) -> list[str]:
    """Which scenes nothing can be said about."""
    unknown = [scene for scene in cost.scenes if scene.reference.error_m > cost.tolerance_m]
    words = [f"{name_of(scene)} (to {length(scene.reference.error_m)})" for scene in unknown]
    return [f"Left out, since the reference itself is not known that well: {joined(words)}"] if words else []


def other_methods(cost: Cost) -> Finding | None:
    """What the other methods take for the same tolerance, at the cheapest rate of each."""
    scenes, method = comparable(cost), winner(cost)
    others = dict.fromkeys(point.method for scene in scenes for point in scene.points if point.method != method)
    if method is None or not others:
        return None
    said: dict[str, list[str]] = {}
    for other in others:
        ratios = [ratio for scene in scenes if (ratio := _against(scene, other, method, cost.tolerance_m))]
        missed = sum(not _meeting(scene, other, cost.tolerance_m) for scene in scenes)
        words = [f"{span(ratios)} times the time"] if ratios else []
        words += [f"not that close at any rate in {of_scenes(missed, len(scenes))}"] if missed else []
        said.setdefault(", but ".join(words), []).append(other)
    lead = f"Against {method}, each at its cheapest plant rate within {amount(cost.tolerance_m, 'm')}: "
    sentences = [f"{joined(names)} {words}" for words, names in said.items() if words]
    return Finding("The same accuracy by other methods", f"{lead}{'; '.join(sentences)}.") if sentences else None


def failures(cost: Cost) -> Finding | None:
    """How many settings failed or came to the wrong verdict, and which methods never did."""
    points = [(scene, point) for scene in cost.scenes for point in scene.points]
    if not points:
        return None
    failed = [(scene, point) for scene, point in points if point.error is None]
    wrong = [(scene, point) for scene, point in points if point.error and not point.error.verdict_right]
    if not failed and not wrong:
        return Finding("Failures", f"None of {len(points)} settings failed, and every verdict was right.")
    parts = [f"{len(failed)} of {len(points)} settings did not get to the end"] if failed else []
    parts += [f"{len(wrong)} of {len(points)} settings got there with the wrong verdict"] if wrong else []
    parts[-1] += f" ({joined(_where([*failed, *wrong]))})"
    bad = {point.method for _, point in [*failed, *wrong]}
    good = list(dict.fromkeys(point.method for _, point in points if point.method not in bad))
    never = f" {joined(good)} never did." if good else " No method is free of both."
    return Finding("Failures", f"{'; '.join(parts)}.{never}")


def own_settings(cost: Cost) -> Finding | None:
    """What the scenes' own settings take beyond the cheapest within the tolerance."""
    ratios = []
    for scene in comparable(cost):
        own = next((p for p in scene.points if (p.method, p.plant_rate) == (scene.own_method, scene.own_rate)), None)
        best = cheapest(scene, cost.tolerance_m)
        if own and best and own.us_per_tick and best.us_per_tick and meets(own, cost.tolerance_m):
            ratios.append(own.us_per_tick.median / best.us_per_tick.median)
    if not ratios:
        return None
    text = f"As the scenes stand they take {span(ratios)} times as long as the cheapest setting within "
    return Finding("The scenes' own settings", f"{text}{amount(cost.tolerance_m, 'm')}.")


def more_steps(cost: Cost) -> Finding | None:
    """What more plant steps cost the method that wins."""
    method = winner(cost)
    ratios, steps = [], set()
    for scene in comparable(cost):
        timed = sorted((p for p in _of_method(scene, method) if p.us_per_tick), key=lambda p: p.plant_rate)
        if len(timed) > 1 and timed[0].us_per_tick and timed[-1].us_per_tick:
            ratios.append(timed[-1].us_per_tick.median / timed[0].us_per_tick.median)
            steps.add(timed[-1].plant_rate / timed[0].plant_rate)
    if not ratios:
        return None
    text = f"{span(steps)} times as many plant steps make {method} take {span(ratios)} times as long."
    return Finding("More plant steps", text)


def verdicts(cost: Cost) -> Finding | None:
    """Whether a run that is off by more than the tolerance still comes to the right verdict."""
    off = [p for scene in cost.scenes for p in scene.points if p.error and _size(p) > cost.tolerance_m]
    if not off:
        return None
    right = sum(point.error is not None and point.error.verdict_right for point in off)
    text = f"Of {len(off)} settings off by more than {amount(cost.tolerance_m, 'm')}, {right} had the right verdict."
    return Finding("Verdicts", text)


def _of_method(scene: SceneCost, method: str | None) -> list[Point]:
    return [point for point in scene.points if point.method == method]


def _meeting(scene: SceneCost, method: str, tolerance_m: float) -> list[float]:
    """Times of a method's points within the tolerance, µs."""
    points = [point for point in _of_method(scene, method) if meets(point, tolerance_m)]
    return [point.us_per_tick.median for point in points if point.us_per_tick]


def _against(scene: SceneCost, other: str, method: str, tolerance_m: float) -> float | None:
    """The least time of one method over that of another, both within the tolerance."""
    theirs, ours = _meeting(scene, other, tolerance_m), _meeting(scene, method, tolerance_m)
    return min(theirs) / min(ours) if theirs and ours else None


def _size(point: Point) -> float:
    assert point.error is not None
    return point.error.size_m


def _where(bad: list[tuple[SceneCost, Point]]) -> list[str]:
    """``euler at up to 10 kHz``: every method once."""
    highest: dict[str, int] = {}
    for _, point in bad:
        highest[point.method] = max(highest.get(point.method, 0), point.plant_rate)
    return [f"{method} at up to {rate(hertz)}" for method, hertz in highest.items()]
