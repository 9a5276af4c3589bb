"""Findings about what accuracy costs: tables of scenes, methods and the other prices."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

from haploop.tools.ablation import NONE
from haploop.tools.cost.advice import cheapest, length, meets, name_of, rate, setting
from haploop.tools.cost.data import Cost, Point, Price, PriceGroup, SceneCost, chance_in
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
    """A table of findings, with the sentences that belong to it.

    Attributes:
        title: of the table.
        heads: of its columns.
        rows: cells, as text.
        notes: sentences below the table.
    """

    title: str
    heads: tuple[str, ...]
    rows: list[list[str]]
    notes: tuple[str, ...] = ()


def findings(cost: Cost) -> list[FindingTable]:
    """Returns the tables for which there are data."""
    groups = {group.name: group for group in cost.prices}
    tables = (scene_table(cost), method_table(cost), price_table(groups))
    return [table for table in tables if table.rows]


def comparable(cost: Cost) -> list[SceneCost]:
    """Returns the scenes whose reference is known to within the tolerance, and of which times are known."""
    return [
        scene
        for scene in cost.scenes
        if scene.reference.error_m <= cost.tolerance_m and any(point.us_per_tick for point in scene.points)
    ]


def cheapest_method(cost: Cost) -> str | None:
    """Returns the method that is the cheapest within the tolerance in most scenes."""
    best = [found.method for scene in comparable(cost) if (found := cheapest(scene, cost.tolerance_m))]
    return Counter(best).most_common(1)[0][0] if best else None


def scene_table(cost: Cost) -> FindingTable:
    """Makes a row a scene: its cheapest setting within the tolerance, and its own."""
    rows = []
    for scene in comparable(cost):
        best, own = cheapest(scene, cost.tolerance_m), own_point(scene)
        rows.append([
            name_of(scene),
            setting(best) if best else "none",
            _median(best),
            setting(own) if own else _NONE,
            _median(own) + ("" if own and meets(own, cost.tolerance_m) else ", too far off"),
            _ratio(own, best),
        ])  # fmt: skip
    left_out = [name_of(scene) for scene in cost.scenes if scene.reference.error_m > cost.tolerance_m]
    note = "Left out, since the reference itself is not known that well: {}."
    return FindingTable(
        f"The cheapest setting within {amount(cost.tolerance_m, 'm')} of the reference",
        ("scene", "cheapest setting", "µs a tick", "the scene's own", "µs a tick", "own over cheapest"),
        rows,
        (note.format("; ".join(left_out)),) if left_out else (),
    )


def method_table(cost: Cost) -> FindingTable:
    """Makes a row a method: where it meets the tolerance and in what time, its largest error, and its failures."""
    scenes, least = comparable(cost), cheapest_method(cost)
    rows = []
    for method in dict.fromkeys(point.method for scene in cost.scenes for point in scene.points):
        own = {scene.name: [point for point in scene.points if point.method == method] for scene in cost.scenes}
        every = [point for points in own.values() for point in points]
        met = [found for scene in scenes if (found := _cheapest_of(scene, method, cost.tolerance_m))]
        pairs = [(_cheapest_of(scene, method, cost.tolerance_m), _cheapest_of(scene, least, cost.tolerance_m))
                 for scene in scenes]  # fmt: skip
        errors = [point.error.size_m for scene in scenes for point in own[scene.name] if point.error]
        rows.append([
            method,
            f"{len(met)} of {len(scenes)}",
            span_of_rates(met),
            span(_us(a) / _us(b) for a, b in pairs if a and b),
            length(max(errors)) if errors else _NONE,
            f"{sum(point.error is None for point in every)} of {len(every)}",
            f"{sum(bool(point.error and not point.error.verdict_right) for point in every)} of {len(every)}",
        ])  # fmt: skip
    note = (
        "Times are over those of {}, the cheapest method in most scenes, each at its cheapest plant rate within the "
        "tolerance."
    )
    return FindingTable(
        "Methods",
        (
            "method",
            "scenes within",
            "at a plant rate of",
            "time over cheapest",
            "largest error",
            "failed",
            "wrong verdict",
        ),
        rows,
        (note.format(least) if least else "No setting came within the tolerance in any scene.",),
    )


def price_table(groups: dict[str, PriceGroup]) -> FindingTable:
    """Makes a row for books, log, processes and all effects at once, the dearest first."""
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


def own_point(scene: SceneCost) -> Point | None:
    """Returns the point of the method and plant rate that the scene itself names."""
    return next((p for p in scene.points if (p.method, p.plant_rate) == (scene.own_method, scene.own_rate)), None)


def span(values: Iterable[float]) -> str:
    """Formats the least and the largest value: ``1.2 to 6.9``; one number where they are the same, a dash for none."""
    found = list(values)
    if not found:
        return _NONE
    low, high = fixed(min(found), 2), fixed(max(found), 2)
    return low if low == high else f"{low} to {high}"


def span_of_rates(points: Iterable[Point]) -> str:
    """Formats the least and the largest plant rate; a dash for none."""
    rates = sorted({point.plant_rate for point in points})
    if not rates:
        return _NONE
    return rate(rates[0]) if len(rates) == 1 else f"{rate(rates[0])} to {rate(rates[-1])}"


def _cheapest_of(scene: SceneCost, method: str | None, tolerance_m: float) -> Point | None:
    """Returns the method's point of least time within the tolerance."""
    points = [p for p in scene.points if p.method == method and p.us_per_tick and meets(p, tolerance_m)]
    return min(points, key=_us, default=None)


def _us(point: Point) -> float:
    assert point.us_per_tick is not None
    return point.us_per_tick.median


def _median(point: Point | None) -> str:
    return fixed(_us(point)) if point and point.us_per_tick else _NONE


def _ratio(point: Point | None, other: Point | None) -> str:
    timed = point and other and point.us_per_tick and other.us_per_tick
    return fixed(_us(point) / _us(other)) if timed and point and other else _NONE


def _entry(groups: dict[str, PriceGroup], name: str, what: str) -> Price | None:
    return next((price for price in groups[name].prices if price.what == what), None) if name in groups else None
