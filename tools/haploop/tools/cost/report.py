"""The terminal report of ``haploop cost``: a table a scene, the load of the machine, and the advice."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING

from rich.console import Group
from rich.text import Text

from haploop.tools.cost.data import Cost, Errors, Point, Price, PriceGroup, SceneCost
from haploop.tools.cost.findings import interval, rate, setting
from haploop.tools.render.terminal import make_table
from haploop.tools.render.units import amount, fixed

if TYPE_CHECKING:
    from rich.console import RenderableType

_POINTWISE, _SWINGS = ("end m", "RMS m", "max m"), ("swing", "freq.", "energy")
_READING = (
    "Errors are x - x_ref at the end, RMS and largest over the ticks; or relative ones of the mean swing's amplitude, "
    "frequency and energy a cycle. Residual: of the energy moved. Time: of a tick in one process, books, no log, over "
    "the yardstick; interval: 95 %, of the median. Starting up is left out; in brackets: of the few ticks before a "
    "failure. Bold: the scene's own setting."
)


def report(cost: Cost) -> RenderableType:
    lines = [Text.assemble((f"{scene.name}: ", "bold"), scene.advice) for scene in cost.scenes]
    small = [Text(words, style="dim") for words in (_READING, yardstick(cost), made_with(cost))]
    return Group(*map(scene_table, cost.scenes), *map(price_table, cost.prices), *small, *lines)


def scene_table(scene: SceneCost) -> RenderableType:
    names = _POINTWISE if scene.reference.pointwise else _SWINGS
    numbers = (*names, "residual", "time", "interval")
    table = make_table("method", *numbers, numbers=numbers, unbroken=("method",), padding=(0, 0, 0, 0))
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
    error, time = point.error, point.time
    median = fixed(time.median) if time else "–"
    return [
        Text(f"{rate(point.plant_rate):>11}") if error else Text(f"✗ {rate(point.plant_rate):>9}", "red"),
        *(f"{value:.1e}" if value is not None else "–" for value in _figures(error)),
        median if error or not time else f"({median})",
        f"{fixed(time.low)}–{fixed(time.high)}" if time else "–",
    ]


def _figures(error: Errors | None) -> tuple[float | None, ...]:
    if error is None:
        return (None,) * 4
    if error.rms_m is not None:
        return error.final_m, error.rms_m, error.max_m, error.residual
    return error.amplitude, error.frequency, error.energy_per_cycle, error.residual


def price_table(group: PriceGroup) -> RenderableType:
    """Makes the table of a group of prices; what each adds is against its first row."""
    heads, rows = price_rows(group)
    table = make_table(*heads, numbers=heads[1:-1], unbroken=("",), padding=(0, 1, 0, 0))
    for row in rows:
        table.add_row(*row)
    return Group(Text(group.title, style="bold"), Text(f"Yardsticks {group.unit}; {group.how}.", style="dim"), table)


def price_rows(group: PriceGroup) -> tuple[tuple[str, ...], list[list[str]]]:
    """Returns the heads and the cells of a group's table."""
    moves, counted = (
        any(getattr(price, name) is not None for price in group.prices) for name in ("moves_m", "instructions_per_tick")
    )
    heads = ("", "time", "adds", *["motion moved"] * moves, *["instructions"] * counted, "buys")
    return heads, [_price_row(price, moves, counted) for price in group.prices]


def _price_row(price: Price, moves: bool, counted: bool) -> list[str]:
    count = price.instructions_per_tick
    return [
        price.what,
        interval(price.time, 3),
        interval(price.adds) if price.adds else "",
        *[amount(price.moves_m, "m", 2)] * moves,
        *["" if count is None else f"{count:.0f}"] * counted,
        price.buys,
    ]


def yardstick(cost: Cost) -> str:
    """Returns what a time is over, and how steady it was, as sentences."""
    words = f"The yardstick is {cost.yardstick}"
    if not (load := cost.load):
        return f"{words}."
    average = "" if load.average is None else f", under a load average of {load.average:.1f}"
    varied = f"its middle half lay within {100 * load.variation:.0f} %{average}"
    clocks = "Times in one process are the processor's, those as processes the clock's."
    return f"{words}; here it took {fixed(load.yardstick_us)} µs ({varied}). {clocks}"


def made_with(cost: Cost) -> str:
    """Returns machine, versions and repeats as a sentence."""
    made = ", ".join(f"{name} {number}" for name, number in cost.versions.items())
    at = f" at {cost.commit}" if cost.commit else ""
    ways = f"one process {cost.repeats}, as processes {cost.processes_repeats or 'none'}"
    return f"{cost.machine}; {made}{at}. Repeats, interleaved in random order: {ways}."
