"""Findings about what accuracy costs: the price of the next digit, methods written alike, chaotic swings, advice."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

from haploop.protocol.amounts import amount, fixed
from haploop.tools.cost.data import AlikeScene, Cost, Errors, Point, PriceGroup, SceneCost, Spread, Step
from haploop.tools.operations import WHOLE

# The second run of the scene without effects: what it adds is chance.
AGAIN = "no effect again"
_NONE, EXACT, _RIVAL = "–", "exact", "euler"
# The exact flow by loops of machine code.
COMPILED = "exact, machine code"
# An error too small to be of interest, whose last digits may differ from machine to machine.
_NOTHING_M = 1e-9
# Errors that are asked for, m.
DIGITS_M = (30e-6, 10e-6, 3e-6, 1e-6, 1e-7)

_ALIKE = (
    "In a run of {scene}, both at {rate}, {rival} takes {in_run} times as long as the exact flow, which has dedicated "
    "code; written alike, its step takes {alike} times as long."
)


@dataclass(frozen=True)
class FindingTable:
    """A table of findings, its cells as text."""

    kind: Literal["digits", "alike", "swings"]
    title: str
    heads: tuple[str, ...]
    rows: list[list[str]]


def cheapest(scene: SceneCost, tolerance_m: float, method: str | None = None) -> Point | None:
    """Returns the point of least time in one process among those that meet the tolerance, of one method or of all."""
    points = [point for point in scene.points if method in (None, point.method)]
    return min(
        (p for p in points if p.time and meets(p, tolerance_m)), key=lambda point: _time(point).median, default=None
    )


def as_cheap(scene: SceneCost, tolerance_m: float) -> list[Point]:
    """Returns, for every method as cheap as the cheapest (intervals overlap), its point of the lowest plant rate."""
    best, found = cheapest(scene, tolerance_m), {}
    for point in sorted(scene.points, key=lambda point: point.plant_rate):
        if best and point.time and meets(point, tolerance_m) and point.time.overlaps(_time(best)):
            found.setdefault(point.method, point)
    return sorted(found.values(), key=lambda point: _time(point).median)


def meets(point: Point, tolerance_m: float) -> bool:
    """Tells whether a run reached its end within the tolerance, including its interval."""
    return point.error is not None and point.at_most_m <= tolerance_m


def exact_below_m(scene: SceneCost) -> float | None:
    """Returns the error below which no method is cheaper than the exact flow; None where it has no time."""
    exact = cheapest(scene, math.inf, EXACT)
    if exact is None:
        return None
    rivals = [p for p in scene.points if p.time and p.method != EXACT and p.time.high < _time(exact).low and p.error]
    return min((point.at_most_m for point in rivals), default=math.inf)


def advice(scene: SceneCost, tolerance_m: float) -> str:
    """Makes the sentence for a scene: the cheapest setting that is accurate enough, and what is as cheap."""
    measure = "" if scene.reference.pointwise else " in amplitude"
    within = f"within {amount(tolerance_m, 'm')} of the reference{measure}"
    if scene.reference.error_m > tolerance_m:
        known = amount(scene.reference.error_m, "m")
        return f"No setting can be said to be {within}: the reference itself is only known to {known}."
    if found := as_cheap(scene, tolerance_m):
        others = f"; not told apart: {', '.join(map(setting, found[1:]))}" if found[1:] else ""
        return f"Cheapest {within}: {setting(found[0])}, {interval(_time(found[0]))} times the yardstick{others}."
    nearest = min((p for p in scene.points if p.error), key=lambda point: point.at_most_m, default=None)
    if nearest is None:
        return f"No setting is {within}: none ran to its end."
    return f"No setting is {within}; {setting(nearest)} comes nearest, {amount(nearest.at_most_m, 'm')}."


def setting(point: Point) -> str:
    """Formats method and plant rate: ``exact at 10 kHz``."""
    return f"{point.method} at {rate(point.plant_rate)}"


def rate(plant_rate: float) -> str:
    """Formats a rate in Hz: ``10 kHz``."""
    return f"{plant_rate / 1000:g} kHz" if plant_rate >= 1000 else f"{plant_rate:g} Hz"


def interval(spread: Spread, digits: int = 2) -> str:
    """Formats a median with its interval: ``4.2 (4.0–4.5)``."""
    return f"{fixed(spread.median, digits)} ({fixed(spread.low, digits)}–{fixed(spread.high, digits)})"


def findings(cost: Cost) -> list[FindingTable]:
    swings = [_swing_table(scene) for scene in cost.scenes if not scene.reference.pointwise]
    return [table for table in (_digit_table(cost), _alike_table(cost), *swings) if table.rows]


def _digit_table(cost: Cost) -> FindingTable:
    """Makes a row per scene: the cheapest setting at every error asked for, and where the exact flow takes over.

    A scene that has times of the exact flow as machine code gets another row, with these in place of its others.
    """
    rows = []
    for scene in cost.scenes:
        if any(point.time for point in scene.points):
            rows.append([scene.short_title, *_digits(scene)])
        if any(point.time for point in scene.compiled):
            rows.append([f"{scene.short_title}, machine code", *_digits(with_machine_code(scene))])
    heads = ("scene", *(amount(digit, "m", 2) for digit in DIGITS_M), "none cheaper than exact below")
    return FindingTable("digits", "What the next digit costs", heads, rows)


def with_machine_code(scene: SceneCost) -> SceneCost:
    """Returns a scene with the exact flow by loops of machine code, where there are times of that."""
    exact = [replace(point, method=EXACT) for point in scene.compiled]
    return replace(scene, points=exact + [p for p in scene.points if p.method != EXACT]) if exact else scene


def _digits(scene: SceneCost) -> list[str]:
    below, cells = exact_below_m(scene), [_cell(scene, digit) for digit in DIGITS_M]
    shown = ["same" if i and cell == cells[i - 1] else cell for i, cell in enumerate(cells)]
    return [*shown, _NONE if below is None else "any error" if math.isinf(below) else amount(below, "m", 2)]


def _cell(scene: SceneCost, digit_m: float) -> str:
    if scene.reference.error_m > digit_m:
        return "reference not known"
    found = as_cheap(scene, digit_m)
    return f"{' or '.join(map(setting, found))}, {interval(_time(found[0]))}" if found else _NONE


def _alike_table(cost: Cost) -> FindingTable:
    """Makes a row per method: operations of its step, its time over that of the exact flow, and operations a tick."""
    by_states = _by_states(cost)
    sizes = sorted(by_states)
    pairs = _alike_pairs(cost)
    rows = []
    for method in dict.fromkeys(step.method for of in cost.alike for step in of.steps):
        steps = [_step(by_states[states], method) for states in sizes]
        counted = [str(step.operations) for step in steps]
        timed = [interval(step.arrays) for step in steps]
        needed = (operations_a_tick(scene, of, method, cost.tolerance_m) for scene, of in pairs)
        rows.append([method, *counted, *timed, *(_NONE if count is None else str(count) for count in needed)])
    within = amount(cost.tolerance_m, "m", 2)
    heads = (
        "method",
        *(f"operations, {states} states" for states in sizes),
        *(f"time in arrays over exact, {states} states" for states in sizes),
        *(f"operations a tick within {within}, {scene.name.replace('_', ' ')}" for scene, _ in pairs),
    )
    return FindingTable("alike", "A plant step of every method, written alike", heads, rows)


def _by_states(cost: Cost) -> dict[int, AlikeScene]:
    """Returns the first of the scenes of each number of states: the one whose steps are shown."""
    return {of.states: of for of in reversed(cost.alike)}


def _alike_pairs(cost: Cost) -> list[tuple[SceneCost, AlikeScene]]:
    return [(s, of) for s in cost.scenes for of in cost.alike if of.scene == s.name and s.reference.pointwise]


def _step(of: AlikeScene, method: str) -> Step:
    return next(step for step in of.steps if step.method == method)


def alike_sentence(cost: Cost) -> str | None:
    """Makes a sentence on how much of a method's time in a run is due to how it is written; None without such times."""
    for scene, of in sorted(_alike_pairs(cost), key=lambda pair: pair[1].states):
        exact, rival = (scene.point(method, min(p.plant_rate for p in scene.points)) for method in (EXACT, _RIVAL))
        if exact and rival and exact.time and rival.time and any(step.method == _RIVAL for step in of.steps):
            return _ALIKE.format(
                scene=scene.name.replace("_", " "),
                rate=rate(exact.plant_rate),
                rival=_RIVAL,
                in_run=fixed(rival.time.median / exact.time.median, 2),
                alike=interval(_step(_by_states(cost)[of.states], _RIVAL).arrays),
            )
    return None


def operations_a_tick(scene: SceneCost, of: AlikeScene, method: str, tolerance_m: float) -> int | None:
    """Returns the operations of the motion in a tick at the lowest plant rate that meets a tolerance; None for none."""
    rates = [point.plant_rate for point in scene.points if point.method == method and meets(point, tolerance_m)]
    return _step(of, method).operations * min(rates) // scene.control_rate if rates else None


def _swing_table(scene: SceneCost) -> FindingTable:
    """Makes a row per method of a chaotic scene: how far the mean swing is off, with its interval, at every rate."""
    rates = sorted({point.plant_rate for point in scene.points})
    methods = dict.fromkeys(point.method for point in scene.points)
    rows = [[method, *(_swing(scene.point(method, hertz)) for hertz in rates)] for method in methods]
    return FindingTable("swings", f"{scene.short_title}: error of the mean swing", ("method", *map(rate, rates)), rows)


def _swing(point: Point | None) -> str:
    error = point.error if point else None
    if error is None:
        return "failed" if point else _NONE
    if error.at_most_m < _NOTHING_M:
        return f"below {amount(_NOTHING_M, 'm', 1)}"
    if is_told_apart(error):
        return f"{amount(error.size_m, 'm', 2)} ± {amount(error.doubt_m, 'm', 2)}"
    return f"at most {amount(error.at_most_m, 'm', 2)}"


def is_told_apart(error: Errors) -> bool:
    """Tells whether the interval of an error leaves out 0."""
    return error.size_m > error.doubt_m


def takes_away(cost: Cost) -> str:
    """Makes the sentence of the figure of methods: down to which error a method other than the exact flow pays.

    If there are times of machine code, a second sentence says in how many scenes that is still so.
    """
    without = _takes_away(cost.scenes)
    if not any(point.time for scene in cost.scenes for point in scene.compiled):
        return without
    rows = [exact_below_m(with_machine_code(scene)) for scene in cost.scenes]
    left = sum(below is not None and math.isfinite(below) for below in rows)
    return f"{without} With friction as machine code, one is in {left or 'none'} of them."


def _takes_away(scenes: list[SceneCost]) -> str:
    known = [(scene, below) for scene in scenes if (below := exact_below_m(scene)) is not None]
    pays = sorted(below for _, below in known if math.isfinite(below))
    always = len(known) - len(pays)
    if not pays:
        return (
            f"In all {always} scenes no method was found cheaper than the exact flow, however large the error may be."
        )
    ends = " to ".join(dict.fromkeys(amount(below, "m", 2) for below in (pays[0], pays[-1])))
    where = f"{always} of {len(known)} scenes no method was found cheaper than the exact flow at any error"
    return f"In {where}; in the others one is, if an error above {ends} is acceptable."


def effects_sentence(group: PriceGroup) -> str:
    """Makes the one sentence of the figure of prices: the dearest effect alone, and which cost next to nothing."""
    alone = _alone(group)
    dearest = max(alone, key=lambda what: alone[what].median)
    free = sum(adds.low <= 0.0 for adds in alone.values())
    return (
        f"Alone, {dearest} costs most, {interval(alone[dearest])} yardsticks a tick; "
        f"{free} of {len(alone)} effects cannot be told apart from nothing."
    )


def sum_sentence(group: PriceGroup) -> str:
    """Makes a sentence that compares the sum of what effects add alone with what they add together."""
    together = next(price.adds for price in group.prices if price.adds and price.what == WHOLE)
    added = fixed(sum(adds.median for adds in _alone(group).values()), 2)
    return f"Added up they cost {added}, all at once {interval(together)}."


def _alone(group: PriceGroup) -> dict[str, Spread]:
    return {price.what: price.adds for price in group.prices if price.adds and price.what not in (AGAIN, WHOLE)}


def _time(point: Point) -> Spread:
    assert point.time is not None
    return point.time
