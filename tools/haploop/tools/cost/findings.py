"""Findings about what accuracy costs: advice for a scene in a sentence, tables of scenes, methods and other prices."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

from haploop.tools.cost.data import Cost, Point, Price, PriceGroup, SceneCost, Spread, chance_in
from haploop.tools.operations import NONE
from haploop.tools.render.units import amount, fixed

_NONE = "–"
# Group and price -> the price in words, and what its ratio is against.
_PRICES = {
    ("processes", "three processes"): ("three processes without delay", "one process"),
    ("books", "with"): ("the exact energy books of every plant step", "plant and controller alone"),
    ("log", "steps"): ("every plant step logged", "a run as processes without a log"),
}


@dataclass(frozen=True)
class FindingTable:
    """A table of findings, its cells as text, with the sentences that belong below it."""

    title: str
    heads: tuple[str, ...]
    rows: list[list[str]]
    notes: tuple[str, ...] = ()


def cheapest(scene: SceneCost, tolerance_m: float, method: str | None = None) -> Point | None:
    """Returns the point of least time in one process among those that meet the tolerance, of one method or of all."""
    points = [point for point in scene.points if method in (None, point.method)]
    return min((p for p in points if p.us_per_tick and meets(p, tolerance_m)), key=_us, default=None)


def meets(point: Point, tolerance_m: float) -> bool:
    """Tells whether a run is within the tolerance and its verdict is that of the reference."""
    return point.error is not None and point.error.verdict_right and point.error.size_m <= tolerance_m


def advice(scene: SceneCost, tolerance_m: float) -> str:
    """Makes the sentence for a scene: the cheapest setting that is accurate enough, and the cost of its own beyond it.

    Times are medians in one process. Amplitudes are named where they are compared in place of positions.
    """
    measure = "" if scene.reference.pointwise else " in amplitude"
    within = f"within {amount(tolerance_m, 'm')} of the reference{measure}"
    if scene.reference.error_m > tolerance_m:
        known = amount(scene.reference.error_m, "m")
        return f"No setting can be said to be {within}: the reference itself is only known to {known}."
    if best := cheapest(scene, tolerance_m):
        return f"Cheapest {within}: {setting(best)}, {_time(best)} a tick; {_own_setting(scene, best, tolerance_m)}."
    if not any(point.us_per_tick for point in scene.points if point.error):
        return f"Nothing was timed, so no setting can be called the cheapest {within}."
    compared = [(p.error.size_m, setting(p)) for p in scene.points if p.error and p.error.verdict_right]
    if not compared:
        return f"No setting is {within}: none ran to the end with the right verdict."
    size_m, nearest = min(compared, key=lambda found: found[0])
    return f"No setting is {within}; {nearest} comes nearest, {amount(size_m, 'm')}."


def _own_setting(scene: SceneCost, best: Point, tolerance_m: float) -> str:
    own = scene.own
    if own is best:
        return "it is the scene's own setting"
    name = f"the scene's own, {scene.own_method} at {rate(scene.own_rate)},"
    if own is None or own.error is None or own.us_per_tick is None:
        return f"{name} fails"
    if not meets(own, tolerance_m):
        wrong = "" if own.error.verdict_right else f", {own.error.verdict} instead of {scene.reference.verdict}"
        return f"{name} takes {_time(own)} and is off by {amount(own.error.size_m, 'm')}{wrong}"
    more = _us(own) / _us(best)
    beyond = f"{fixed(more, 2)} times as long" if more >= 2 else f"{100 * (more - 1):.0f} % more"
    doubt = ", which these measurements cannot tell apart" if _overlap(own.us_per_tick, best.us_per_tick) else ""
    return f"{name} takes {_time(own)}, {beyond}{doubt}"


def _overlap(a: Spread, b: Spread | None) -> bool:
    return b is not None and a.q1 <= b.q3 and b.q1 <= a.q3


def setting(point: Point) -> str:
    """Formats method and plant rate: ``exact at 10 kHz``."""
    return f"{point.method} at {rate(point.plant_rate)}"


def rate(plant_rate: int) -> str:
    """Formats a rate in Hz: ``10 kHz``."""
    return f"{plant_rate / 1000:g} kHz" if plant_rate >= 1000 else f"{plant_rate} Hz"


def length(metres: float) -> str:
    """Formats a length in m with a prefix, below 1 nm with a power of ten."""
    return amount(metres, "m") if metres == 0.0 or metres >= 1e-9 else f"{metres:.1e} m".replace("-", "−")


def findings(cost: Cost) -> list[FindingTable]:
    """Returns the tables for which there are data."""
    groups = {group.name: group for group in cost.prices}
    tables = (_scene_table(cost), _method_table(cost), _price_table(groups))
    return [table for table in tables if table.rows]


def _comparable(cost: Cost) -> list[SceneCost]:
    """Returns the scenes whose reference is known to within the tolerance, and of which times are known."""
    return [
        scene
        for scene in cost.scenes
        if scene.reference.error_m <= cost.tolerance_m and any(point.us_per_tick for point in scene.points)
    ]


def _scene_table(cost: Cost) -> FindingTable:
    rows = []
    for scene in _comparable(cost):
        best, own = cheapest(scene, cost.tolerance_m), scene.own
        rows.append([
            scene.short_title,
            setting(best) if best else "none",
            _median(best),
            setting(own) if own else _NONE,
            _median(own) + ("" if own and meets(own, cost.tolerance_m) else ", too far off"),
            fixed(_us(own) / _us(best)) if own and own.us_per_tick and best else _NONE,
        ])  # fmt: skip
    left_out = [scene.short_title for scene in cost.scenes if scene.reference.error_m > cost.tolerance_m]
    note = f"Left out, since the reference itself is not known that well: {'; '.join(left_out)}."
    return FindingTable(
        f"The cheapest setting within {amount(cost.tolerance_m, 'm')} of the reference",
        ("scene", "cheapest setting", "µs a tick", "the scene's own", "µs a tick", "own over cheapest"),
        rows,
        (note,) if left_out else (),
    )


def _method_table(cost: Cost) -> FindingTable:
    """Makes a row a method: where it meets the tolerance and in what time, its largest error, and its failures.

    Times are over those of the method that is the cheapest within the tolerance in most scenes.
    """
    scenes, tolerance_m = _comparable(cost), cost.tolerance_m
    best = [found.method for scene in scenes if (found := cheapest(scene, tolerance_m))]
    least = Counter(best).most_common(1)[0][0] if best else None
    rows = []
    for method in dict.fromkeys(point.method for scene in cost.scenes for point in scene.points):
        every = [point for scene in cost.scenes for point in scene.points if point.method == method]
        met = [found for scene in scenes if (found := cheapest(scene, tolerance_m, method))]
        pairs = [(cheapest(scene, tolerance_m, method), cheapest(scene, tolerance_m, least)) for scene in scenes]
        errors = [p.error.size_m for scene in scenes for p in scene.points if p.error and p.method == method]
        rows.append([
            method,
            f"{len(met)} of {len(scenes)}",
            _span_of_rates(met),
            _span(_us(a) / _us(b) for a, b in pairs if a and b),
            length(max(errors)) if errors else _NONE,
            f"{sum(point.error is None for point in every)} of {len(every)}",
            f"{sum(bool(point.error and not point.error.verdict_right) for point in every)} of {len(every)}",
        ])  # fmt: skip
    heads = "method", "scenes within", "at a plant rate of", "time over cheapest", "largest error", "failed"
    note = (
        f"Times are over those of {least}, the cheapest method in most scenes, each at its cheapest plant rate within "
        "the tolerance."
    )
    return FindingTable(
        "Methods",
        (*heads, "wrong verdict"),
        rows,
        (note if least else "No setting came within the tolerance in any scene.",),
    )


def _price_table(groups: dict[str, PriceGroup]) -> FindingTable:
    found = [(entry.ratio, *words) for (name, what), words in _PRICES.items() if (entry := _entry(groups, name, what))]
    notes: tuple[str, ...] = ()
    effects = groups.get("effects")
    if effects and (none := _entry(groups, "effects", NONE)):
        found.append((1.0 / none.ratio, "all effects at once", "the same scene without any"))
        dearest = max((price for price in effects.prices[1:] if price.what != NONE), key=lambda price: price.costs)
        if dearest.costs > chance_in(effects):
            note = "The dearest effect is {}: without it a tick with all effects would save {} of {} µs."
            notes = (note.format(dearest.what, fixed(dearest.costs), fixed(effects.baseline.time.median)),)
    rows = [[words, against, fixed(ratio)] for ratio, words, against in sorted(found, reverse=True)]
    return FindingTable("The other prices", ("", "against", "ratio of times"), rows, notes)


def _entry(groups: dict[str, PriceGroup], name: str, what: str) -> Price | None:
    return next((price for price in groups[name].prices if price.what == what), None) if name in groups else None


def _span(values: Iterable[float]) -> str:
    """Formats the least and the largest value: ``1.2 to 6.9``; one number where they are the same, a dash for none."""
    found = sorted(values)
    ends = [fixed(value, 2) for value in (*found[:1], *found[-1:])]
    return " to ".join(dict.fromkeys(ends)) or _NONE


def _span_of_rates(points: Iterable[Point]) -> str:
    rates = sorted(point.plant_rate for point in points)
    return " to ".join(dict.fromkeys(rate(hertz) for hertz in (*rates[:1], *rates[-1:]))) or _NONE


def _us(point: Point) -> float:
    assert point.us_per_tick is not None
    return point.us_per_tick.median


def _time(point: Point) -> str:
    return f"{fixed(_us(point))} µs"


def _median(point: Point | None) -> str:
    return fixed(_us(point)) if point and point.us_per_tick else _NONE
