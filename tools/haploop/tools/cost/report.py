"""The terminal report of ``haploop cost``: a table a scene, the load of the machine, and the advice."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.console import Group
from rich.text import Text

from haploop.tools.cost.data import QUIET_LOAD, QUIET_SPREAD, Cost, Errors, Point, PriceGroup, SceneCost, Spread
from haploop.tools.cost.findings import rate, setting
from haploop.tools.render.terminal import make_table
from haploop.tools.render.units import amount, fixed

if TYPE_CHECKING:
    from rich.console import RenderableType

_POINTWISE, _SWINGS = ("end m", "RMS m", "max m"), ("swing", "freq.", "energy")
_READING = (
    "Errors are x - x_ref at the end, RMS and largest over the ticks; or relative ones of the swings' amplitude, "
    "frequency and energy per cycle. Residual: of the energy moved. µs/tick: median in one process, books, no log; "
    "spread: the middle half over the median; procs: µs/tick as processes that log every step. Starting up is left "
    "out; in brackets: of the few ticks before a method failed. Bytecode: instructions a tick. "
    "Bold: the scene's own setting."
)


def report(cost: Cost) -> RenderableType:
    """Makes the whole report, the advice last, where it is seen."""
    tables: list[RenderableType] = [scene_table(scene) for scene in cost.scenes]
    lines = [Text.assemble((f"{scene.name}: ", "bold"), scene.advice) for scene in cost.scenes]
    small = [Text(words, style="dim") for words in (_READING, made_with(cost))]
    tables += [price_table(group) for group in cost.prices]
    return Group(*tables, *small, *_warnings(cost), *lines)


def scene_table(scene: SceneCost) -> RenderableType:
    """Makes the table of a scene: every point, method by method."""
    names = _POINTWISE if scene.reference.pointwise else _SWINGS
    numbers = (*names, "residual", "µs/tick", "spread", "procs", "bytecode")
    unbroken = ("method", "verdict")
    table = make_table("method", *numbers, "verdict", numbers=numbers, unbroken=unbroken, padding=(0, 0, 0, 0))
    before = ""
    for point in scene.points:
        if point.method != before:
            table.add_section()
            table.add_row(point.method)
        table.add_row(*_row(point), style="bold" if point is scene.own else "")
        before = point.method
    about = scene.reference
    known = f"{about.how} Known to {amount(about.error_m, 'm')}." if about.pointwise else about.how
    failed = [point for point in scene.points if point.failure]
    reasons = [Text(f"✗ {setting(point)}: {point.failure}", style="dim") for point in failed]
    return Group(Text(scene.title, style="bold"), Text(f"Reference: {known}", style="dim"), table, *reasons)


def _row(point: Point) -> list[str | Text]:
    error, times, processes = point.error, point.us_per_tick, point.processes_us_per_tick
    count = point.instructions_per_tick
    return [
        f"{rate(point.plant_rate):>11}",
        *(_figures(error) if error else ["–"] * 3),
        _power(error.residual if error else None),
        _time(point),
        _spread(times),
        fixed(processes.median) if processes else "–",
        "–" if count is None else f"{count:.0f}",
        _verdict(point),
    ]


def _figures(error: Errors) -> list[str]:
    pointwise = error.final_m, error.rms_m, error.max_m
    swings = error.amplitude, error.frequency, error.energy_per_cycle
    return [_power(value) for value in (pointwise if error.rms_m is not None else swings)]


def _power(value: float | None) -> str:
    return "–" if value is None else f"{value:.1e}"


def _time(point: Point) -> str:
    """Formats the time; in brackets where only the few ticks of a failure could be timed."""
    if point.us_per_tick is None:
        return "–"
    median = fixed(point.us_per_tick.median)
    return f"({median})" if point.error is None else median


def _spread(times: Spread | None) -> str:
    return f"{100 * (times.q3 - times.q1) / times.median:.0f} %" if times else "–"


def _verdict(point: Point) -> Text:
    if point.error is None:
        return Text("✗ failed", "red")
    return Text(point.error.verdict) if point.error.verdict_right else Text(f"✗ {point.error.verdict}", "red")


def price_table(group: PriceGroup) -> RenderableType:
    """Makes the table of a group of prices; ratios are over its first row."""
    numbers = (group.unit, "spread", "ratio")
    table = make_table("", *numbers, "what it buys", numbers=numbers, unbroken=("",), padding=(0, 1, 0, 0))
    for price in group.prices:
        table.add_row(price.what, fixed(price.time.median), _spread(price.time), f"{price.ratio:.2f}", price.buys)
    return Group(Text(group.title, style="bold"), Text(f"{group.how}.", style="dim"), table)


def made_with(cost: Cost) -> str:
    """Returns machine, versions and repeats as a sentence."""
    made = ", ".join(f"{name} {number}" for name, number in cost.versions.items())
    at = f" at {cost.commit}" if cost.commit else ""
    ways = f"one process {cost.repeats}, as processes {cost.processes_repeats or 'none'}"
    return f"{cost.machine}; {made}{at}. Repeats, interleaved in random order: {ways}."


def _warnings(cost: Cost) -> list[Text]:
    if cost.load is None or not cost.load.busy:
        return []
    seen = [f"a fixed loop varied by {100 * cost.load.calibration_spread:.0f} % (quiet: {100 * QUIET_SPREAD:.0f} %)"]
    if cost.load.average is not None:
        seen.append(f"the load average was {cost.load.average:.1f} (quiet: {QUIET_LOAD:g}, this program included)")
    return [Text(f"The machine was busy while times were taken: {', '.join(seen)}. Errors stand.", style="bold yellow")]
