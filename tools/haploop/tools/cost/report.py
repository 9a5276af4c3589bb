"""The terminal report of ``haploop cost``: a table a scene, the load of the machine, and the advice."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING

from rich.console import Group
from rich.text import Text

from haploop.tools.cost.data import Cost, Errors, Point, Price, PriceGroup, SceneCost, Spread
from haploop.tools.cost.findings import rate, setting
from haploop.tools.render.terminal import make_table
from haploop.tools.render.units import amount, fixed

if TYPE_CHECKING:
    from rich.console import RenderableType

PRICE_HEADS = ("", "median", "quartiles", "ratio", "costs", "instructions", "buys")
_POINTWISE, _SWINGS = ("end m", "RMS m", "max m"), ("swing", "freq.", "energy")
_READING = (
    "Errors are x - x_ref at the end, RMS and largest over the ticks; or relative ones of the swings' amplitude, "
    "frequency and energy per cycle. Residual: of the energy moved. µs/tick: median in one process, books, no log; "
    "spread: the middle half over the median; procs: µs/tick as processes that log every step. Starting up is left "
    "out; in brackets: of the few ticks before a method failed. Bytecode: instructions a tick. "
    "Bold: the scene's own setting."
)


def report(cost: Cost) -> RenderableType:
    lines = [Text.assemble((f"{scene.name}: ", "bold"), scene.advice) for scene in cost.scenes]
    small = [Text(words, style="dim") for words in (_READING, made_with(cost))]
    busy = [Text(f"{cost.load} Errors stand.", style="bold yellow")] if cost.load and cost.load.busy else []
    return Group(*map(scene_table, cost.scenes), *map(price_table, cost.prices), *small, *busy, *lines)


def scene_table(scene: SceneCost) -> RenderableType:
    names = _POINTWISE if scene.reference.pointwise else _SWINGS
    numbers = (*names, "residual", "µs/tick", "spread", "procs", "bytecode")
    unbroken = ("method", "verdict")
    table = make_table("method", *numbers, "verdict", numbers=numbers, unbroken=unbroken, padding=(0, 0, 0, 0))
    for method, points in groupby(scene.points, key=lambda point: point.method):
        table.add_section()
        table.add_row(method)
        for point in points:
            table.add_row(*_row(point), style="bold" if point is scene.own else "")
    about = scene.reference
    known = f"{about.how} Known to {amount(about.error_m, 'm')}." if about.pointwise else about.how
    failed = [point for point in scene.points if point.failure]
    reasons = [Text(f"✗ {setting(point)}: {point.failure}", style="dim") for point in failed]
    return Group(Text(scene.title, style="bold"), Text(f"Reference: {known}", style="dim"), table, *reasons)


def _row(point: Point) -> list[str | Text]:
    """Makes the cells of a point; the time is in brackets where only the few ticks of a failure could be timed."""
    error, times, count = point.error, point.us_per_tick, point.instructions_per_tick
    verdict = error.verdict if error else "failed"
    return [
        f"{rate(point.plant_rate):>11}",
        *(f"{value:.1e}" if value is not None else "–" for value in _figures(error)),
        _median(times) if error or not times else f"({_median(times)})",
        f"{100 * (times.q3 - times.q1) / times.median:.0f} %" if times else "–",
        _median(point.processes_us_per_tick),
        "–" if count is None else f"{count:.0f}",
        Text(verdict) if point.is_right else Text(f"✗ {verdict}", "red"),
    ]


def _figures(error: Errors | None) -> tuple[float | None, ...]:
    if error is None:
        return (None,) * 4
    if error.rms_m is not None:
        return error.final_m, error.rms_m, error.max_m, error.residual
    return error.amplitude, error.frequency, error.energy_per_cycle, error.residual


def _median(times: Spread | None) -> str:
    return fixed(times.median) if times else "–"


def price_table(group: PriceGroup) -> RenderableType:
    """Makes the table of a group of prices; ratios are over its first row."""
    table = make_table(*PRICE_HEADS, numbers=PRICE_HEADS[1:-1], unbroken=("",), padding=(0, 1, 0, 0))
    for price in group.prices:
        table.add_row(*price_row(price))
    return Group(Text(group.title, style="bold"), Text(f"{group.unit}; {group.how}.", style="dim"), table)


def price_row(price: Price) -> list[str]:
    """Returns the cells in the order of ``PRICE_HEADS``."""
    count, time = price.instructions_per_tick, price.time
    quartiles = f"{fixed(time.q1)}–{fixed(time.q3)}"
    instructions = "" if count is None else f"{count:.0f}"
    return [price.what, fixed(time.median), quartiles, fixed(price.ratio), fixed(price.costs), instructions, price.buys]


def made_with(cost: Cost) -> str:
    """Returns machine, versions and repeats as a sentence."""
    made = ", ".join(f"{name} {number}" for name, number in cost.versions.items())
    at = f" at {cost.commit}" if cost.commit else ""
    ways = f"one process {cost.repeats}, as processes {cost.processes_repeats or 'none'}"
    return f"{cost.machine}; {made}{at}. Repeats, interleaved in random order: {ways}."
