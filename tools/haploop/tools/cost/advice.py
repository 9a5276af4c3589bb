"""Advice in one sentence: the cheapest setting that is accurate enough, and the cost of the scene's own beyond it."""

from __future__ import annotations

from haploop.tools.cost.data import Point, SceneCost, Spread
from haploop.tools.render.units import amount, fixed


def cheapest(scene: SceneCost, tolerance_m: float) -> Point | None:
    """Returns the point of least time in one process among those that meet the tolerance, or None."""
    timed = [point for point in scene.points if point.us_per_tick and meets(point, tolerance_m)]
    return min(timed, key=_us, default=None)


def meets(point: Point, tolerance_m: float) -> bool:
    """Tells whether a run is within the tolerance and its verdict is that of the reference."""
    return point.error is not None and point.error.verdict_right and point.error.size_m <= tolerance_m


def advice(scene: SceneCost, tolerance_m: float) -> str:
    """Makes the sentence for a scene; its times are medians in one process."""
    within = f"within {amount(tolerance_m, 'm')} of the reference{_measure_of_distance(scene)}"
    if scene.reference.error_m > tolerance_m:
        known = amount(scene.reference.error_m, "m")
        return f"No setting can be said to be {within}: the reference itself is only known to {known}."
    if best := cheapest(scene, tolerance_m):
        return f"Cheapest {within}: {setting(best)}, {_time(best)} a tick; {_own_setting(scene, best, tolerance_m)}."
    if not any(point.us_per_tick for point in scene.points if point.error):
        return f"Nothing was timed, so no setting can be called the cheapest {within}."
    compared = [point for point in scene.points if point.error and point.error.verdict_right]
    if not compared:
        return f"No setting is {within}: none ran to the end with the right verdict."
    nearest = min(compared, key=_size)
    return f"No setting is {within}; {setting(nearest)} comes nearest, {amount(_size(nearest), 'm')}."


def setting(point: Point) -> str:
    """Formats method and plant rate: ``exact at 10 kHz``."""
    return f"{point.method} at {rate(point.plant_rate)}"


def rate(plant_rate: int) -> str:
    """Formats a rate in Hz: ``10 kHz``."""
    return f"{plant_rate / 1000:g} kHz" if plant_rate >= 1000 else f"{plant_rate} Hz"


def name_of(scene: SceneCost) -> str:
    """Returns the scene's title without the words that all scenes of this comparison begin with."""
    name = scene.title.removeprefix("Accuracy: ")
    return name[:1].upper() + name[1:]


def length(metres: float) -> str:
    """Formats a length in m with a prefix, below 1 nm with a power of ten."""
    return amount(metres, "m") if metres == 0.0 or metres >= 1e-9 else f"{metres:.1e} m".replace("-", "−")


def _measure_of_distance(scene: SceneCost) -> str:
    """Returns the words that follow where amplitudes are compared in place of positions."""
    return "" if scene.reference.pointwise else " in amplitude"


def _own_setting(scene: SceneCost, best: Point, tolerance_m: float) -> str:
    """Makes the clause about the scene's own setting against the cheapest one."""
    own = next(p for p in scene.points if (p.method, p.plant_rate) == (scene.own_method, scene.own_rate))
    if own is best:
        return "it is the scene's own setting"
    name = f"the scene's own, {setting(own)},"
    if own.error is None or own.us_per_tick is None:
        return f"{name} fails"
    if not meets(own, tolerance_m):
        wrong = "" if own.error.verdict_right else f", {own.error.verdict} instead of {scene.reference.verdict}"
        return f"{name} takes {_time(own)} and is off by {amount(own.error.size_m, 'm')}{wrong}"
    assert best.us_per_tick is not None
    more = own.us_per_tick.median / best.us_per_tick.median
    beyond = f"{fixed(more, 2)} times as long" if more >= 2 else f"{100 * (more - 1):.0f} % more"
    doubt = ", which these measurements cannot tell apart" if _overlap(own.us_per_tick, best.us_per_tick) else ""
    return f"{name} takes {_time(own)}, {beyond}{doubt}"


def _overlap(a: Spread, b: Spread) -> bool:
    """Tells whether the middle halves of two measurements overlap."""
    return a.q1 <= b.q3 and b.q1 <= a.q3


def _time(point: Point) -> str:
    return f"{fixed(_us(point))} µs"


def _us(point: Point) -> float:
    assert point.us_per_tick is not None
    return point.us_per_tick.median


def _size(point: Point) -> float:
    assert point.error is not None
    return point.error.size_m
