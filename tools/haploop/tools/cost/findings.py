"""Findings about what accuracy costs: advice for a scene in a sentence, tables of scenes, methods and other prices."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from haploop.tools.cost.data import Cost, Point, SceneCost, chance_in
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
    return point.is_right and point.size_m <= tolerance_m


def advice(scene: SceneCost, tolerance_m: float) -> str:
    """Makes the sentence for a scene: the cheapest setting that is accurate enough, and the scene's own beside it."""
    measure = "" if scene.reference.pointwise else " in amplitude"
    within = f"within {amount(tolerance_m, 'm')} of the reference{measure}"
    if scene.reference.error_m > tolerance_m:
        known = amount(scene.reference.error_m, "m")
        return f"No setting can be said to be {within}: the reference itself is only known to {known}."
    if best := cheapest(scene, tolerance_m):
        time = f"{_median(best)} µs a tick"
        return f"Cheapest {within}: {setting(best)}, {time}; {_own_setting(scene, best, tolerance_m)}."
    nearest = min((p for p in scene.points if p.is_right), key=lambda point: point.size_m, default=None)
    if nearest is None:
        return f"No setting is {within}: none ran to the end with the right verdict."
    return f"No setting is {within}; {setting(nearest)} comes nearest, {amount(nearest.size_m, 'm')}."


def _own_setting(scene: SceneCost, best: Point, tolerance_m: float) -> str:
    own = scene.own
    if own is best:
        return "it is the scene's own setting"
    name = f"the scene's own, {scene.own_method} at {rate(scene.own_rate)},"
    if own is None or own.error is None or not (own.us_per_tick and best.us_per_tick):
        return f"{name} fails"
    takes = f"{name} takes {_median(own)} µs"
    if not meets(own, tolerance_m):
        wrong = "" if own.is_right else f", {own.error.verdict} instead of {scene.reference.verdict}"
        return f"{takes} and is off by {amount(own.size_m, 'm')}{wrong}"
    apart = own.us_per_tick.q1 > best.us_per_tick.q3
    doubt = "" if apart else ", which these measurements cannot tell apart"
    return f"{takes}, {fixed(_us(own) / _us(best))} times as long{doubt}"


def setting(point: Point) -> str:
    """Formats method and plant rate: ``exact at 10 kHz``."""
    return f"{point.method} at {rate(point.plant_rate)}"


def rate(plant_rate: float) -> str:
    """Formats a rate in Hz: ``10 kHz``."""
    return f"{plant_rate / 1000:g} kHz" if plant_rate >= 1000 else f"{plant_rate:g} Hz"


def length(metres: float) -> str:
    """Formats a length in m with a prefix, below 1 nm with a power of ten."""
    return amount(metres, "m") if metres == 0.0 or metres >= 1e-9 else power(metres)


def power(metres: float) -> str:
    """Formats a length in m with a power of ten."""
    return f"{metres:.1e} m".replace("-", "−") if metres else amount(metres, "m")


def findings(cost: Cost) -> list[FindingTable]:
    return [table for table in (_scene_table(cost), _method_table(cost), _price_table(cost)) if table.rows]


def _comparable(cost: Cost) -> list[SceneCost]:
    """Returns the scenes whose reference is known to within the tolerance, and of which times are known."""
    known = [scene for scene in cost.scenes if scene.reference.error_m <= cost.tolerance_m]
    return [scene for scene in known if any(point.us_per_tick for point in scene.points)]


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
    """Makes a row a method: where it meets the tolerance and in what time, its largest error, and its failures."""
    scenes, tolerance_m = _comparable(cost), cost.tolerance_m
    rows = []
    for method in dict.fromkeys(point.method for scene in cost.scenes for point in scene.points):
        every = [point for scene in cost.scenes for point in scene.points if point.method == method]
        pairs = [(cheapest(scene, tolerance_m, method), cheapest(scene, tolerance_m)) for scene in scenes]
        met = [(found, best) for found, best in pairs if found and best]
        errors = [p.size_m for scene in scenes for p in scene.points if p.error and p.method == method]
        rows.append([
            method,
            f"{len(met)} of {len(scenes)}",
            _span((found.plant_rate for found, _ in met), rate),
            _span((_us(found) / _us(best) for found, best in met), lambda ratio: fixed(ratio, 2)),
            length(max(errors)) if errors else _NONE,
            f"{sum(point.error is None for point in every)} of {len(every)}",
            f"{sum(bool(point.error and not point.is_right) for point in every)} of {len(every)}",
        ])  # fmt: skip
    heads = "method", "scenes within", "at a plant rate of", "time over cheapest", "largest error", "failed"
    note = (
        "Times are those of a method's cheapest setting within the tolerance over the cheapest of all, in each scene."
    )
    return FindingTable("Methods", (*heads, "wrong verdict"), rows, (note,))


def _price_table(cost: Cost) -> FindingTable:
    known = {(group.name, price.what): price.ratio for group in cost.prices for price in group.prices}
    found = [(known[key], *words) for key, words in _PRICES.items() if key in known]
    notes: tuple[str, ...] = ()
    for effects in (group for group in cost.prices if group.name == "effects"):
        found.append((1.0 / known["effects", NONE], "all effects at once", "the same scene without any"))
        dearest = max((price for price in effects.prices[1:] if price.what != NONE), key=lambda price: price.costs)
        if dearest.costs > chance_in(effects):
            note = "The dearest effect is {}: without it a tick with all effects would save {} of {} µs."
            notes = (note.format(dearest.what, fixed(dearest.costs), fixed(effects.prices[0].time.median)),)
    rows = [[words, against, fixed(ratio)] for ratio, words, against in sorted(found, reverse=True)]
    return FindingTable("The other prices", ("", "against", "ratio of times"), rows, notes)


def _span(values: Iterable[float], formatted: Callable[[float], str]) -> str:
    """Formats the least and the largest value: ``1.2 to 6.9``; one number where they are the same, a dash for none."""
    found = sorted(values)
    return " to ".join(dict.fromkeys(formatted(value) for value in (*found[:1], *found[-1:]))) or _NONE


def _us(point: Point) -> float:
    assert point.us_per_tick is not None
    return point.us_per_tick.median


def _median(point: Point | None) -> str:
    return fixed(_us(point)) if point and point.us_per_tick else _NONE
