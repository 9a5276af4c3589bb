"""A cost.json shown on the terminal, and as docs/accuracy.md with its figures: ``make accuracy``."""

from __future__ import annotations

import sys
from itertools import groupby
from pathlib import Path

from rich.console import Group, RenderableType
from rich.text import Text

from haploop.protocol.amounts import amount, fixed
from haploop.tools.command.options import WRONG_USE, leave
from haploop.tools.cost import figure, prices_figure
from haploop.tools.cost.data import Cost, CostFileError, Point, PriceGroup, SceneCost, load
from haploop.tools.cost.findings import (
    alike_sentence,
    effects_sentence,
    findings,
    interval,
    rate,
    setting,
    sum_sentence,
    takes_away,
)
from haploop.tools.figure.data import FigureError
from haploop.tools.figure.style import write_figure
from haploop.tools.render.terminal import make_table, markdown_table

# Heads of the columns of a scene's table, and the errors below them.
_POINTWISE = {"end m": "final_m", "RMS m": "rms_m", "max m": "max_m", "residual": "residual"}
_SWINGS = {"swing": "amplitude", "freq.": "frequency", "energy": "energy_per_cycle", "residual": "residual"}
_READING = (
    "Errors: x - x_ref at the end, RMS and largest over the ticks; or relative errors of the mean swing's amplitude, "
    "frequency and energy a cycle. Residual: share of the energy moved. Time: of a tick in one process, with books and "
    "no log, divided by the yardstick's; interval: 95 %, of the median. Start-up is left out; in brackets: of the few "
    "ticks before a failure. Bold: the scene's own setting."
)
# Groups that are shown in a table; the others are curves of the figure.
_TABLED = ("books", "log", "processes")
PAGE, FIGURE, PRICES_FIGURE = "accuracy.md", "accuracy.png", "accuracy_prices.png"
_INTRO = """\
Which method to take, what the next digit costs, what each effect costs. Every number was measured by `haploop cost`
and written by `make accuracy`; the command prints all of them. An *error* is the root mean square, over the ticks of a
run, of the position's distance from a reference in 50 digits. A *time* is that of a simulated tick with all energy
books, divided by that of a yardstick timed before and after it: a median, and in brackets its 95 % interval. Times
whose intervals overlap are not ranked."""
# By kind of table, what stands below it.
_BELOW = {
    "digits": f"""\
Each cell names the cheapest setting, or all that are as cheap, and the time of the first. Below the error in the last
column no method was found that takes less time than the exact flow. Friction is what makes a tick expensive: the exact
flow finds each stop and start to the last digit, while the one-step methods let them fall on plant steps and have an
error of first order, whatever their own order is. Rows of *machine code* are with the extra `numba`, which sweeps,
`advise` and runs of 20 s or more use for the exact flow with friction, with the same bits; all others, and all times
below, are of Python and NumPy alone.

![Error of each method against the time of a tick, scene by scene]({FIGURE})""",
    "alike": """\
Without friction, a step of any of these methods is a small linear map. Operations are additions and multiplications,
counted; times are of steps of 4096 motions in arrays, with the same kind of formula for every method. Operations a tick
are those at the lowest of the compared plant rates that is exact enough; a dash if none was.""",
    "swings": """\
Here a start moved by 1 µm ends somewhere else, so neither positions nor single swings can be compared. The error is
that of the mean amplitude over 30 starts 1 µm apart, each against the exact flow from the same start, with its 95 %
interval; *at most* where that reaches 0. Methods whose intervals overlap are not ranked.""",
}
_EFFECTS = """\
Each effect alone, with its values in `all_effects.toml`, is added to a mass in a hand of 10 kg that swings by 30 mm
through a soft wall, so that the motion changes by no more than the last column says. Effects of the accelerometer are
added to an ideal one. An effect that needs bodies in a row (cable, grip, bandwidths, friction, jitter, loss) pays for
them when it is alone, and shares them with others."""


def report(cost: Cost) -> RenderableType:
    """Makes the terminal's report: a table per scene and per group of prices, how to read them, and the advice."""
    lines = [Text.assemble((f"{scene.name}: ", "bold"), scene.advice) for scene in cost.scenes]
    small = [Text(words, style="dim") for words in (_READING, yardstick(cost), made_with(cost))]
    return Group(*map(_scene_table, cost.scenes), *map(_price_table, cost.prices), *small, *lines)


def _scene_table(scene: SceneCost) -> RenderableType:
    errors, about = _POINTWISE if scene.reference.pointwise else _SWINGS, scene.reference
    numbers = (*errors, "time", "interval")
    table = make_table("method", *numbers, numbers=numbers, unbroken=("method",), padding=(0, 0, 0, 0))
    for method, points in groupby([*scene.points, *scene.compiled], key=lambda point: point.method):
        table.add_section()
        table.add_row(method)
        for point in points:
            cells = [getattr(point.error, name, None) for name in errors.values()]
            known = (f"{value:.1e}" if value is not None else "–" for value in cells)
            table.add_row(_rate_cell(point), *known, *_time_cells(point), style="bold" if point is scene.own else "")
    known = f"{about.how} Known to {amount(about.error_m, 'm')}." if about.pointwise else about.how
    failed = [point for point in scene.points if point.failure]
    reasons = [Text(f"✗ {setting(point)}: {point.failure}", style="dim") for point in failed]
    return Group(Text(scene.title, style="bold"), Text(f"Reference: {known}", style="dim"), table, *reasons)


def _rate_cell(point: Point) -> Text:
    return Text(f"{rate(point.plant_rate):>11}") if point.error else Text(f"✗ {rate(point.plant_rate):>9}", "red")


def _time_cells(point: Point) -> tuple[str, str]:
    """Makes median and interval; in brackets where only the few ticks of a failure could be timed."""
    if not (time := point.time):
        return "–", "–"
    median = fixed(time.median)
    return median if point.error else f"({median})", f"{fixed(time.low)}–{fixed(time.high)}"


def _price_table(group: PriceGroup) -> RenderableType:
    """Makes the table of a group of prices; what each adds is relative to its first row."""
    heads, *rows = price_rows(group)
    table = make_table(*heads, numbers=heads[1:-1], unbroken=("",), padding=(0, 1, 0, 0))
    for row in rows:
        table.add_row(*row)
    return Group(Text(group.title, style="bold"), Text(f"Yardsticks {group.unit}; {group.how}.", style="dim"), table)


def price_rows(group: PriceGroup) -> list[list[str]]:
    """Returns the heads and the rows of a group's table, without the columns in which there is nothing."""
    heads = ["", "time", "adds", "motion moved", "instructions", "buys"]
    rows = [
        [
            price.what,
            interval(price.time, 3),
            interval(price.adds) if price.adds else "",
            "" if price.moves_m is None else amount(price.moves_m, "m", 2),
            "" if price.instructions_per_tick is None else f"{price.instructions_per_tick:.0f}",
            price.buys,
        ]
        for price in group.prices
    ]
    kept = [place for place, cells in enumerate(zip(*rows, strict=True)) if any(cells) or heads[place] == "adds"]
    return [[row[place] for place in kept] for row in (heads, *rows)]


def yardstick(cost: Cost) -> str:
    """Returns the yardstick that times are divided by, and how steady it was, as sentences."""
    words = f"The yardstick is {cost.yardstick}"
    if not (load := cost.load):
        return f"{words}."
    average = "" if load.average is None else f", under a load average of {load.average:.1f}"
    varied = f"its middle half lay within {100 * load.variation:.0f} %{average}"
    clocks = "Times in one process are processor time, those as processes are clock time."
    return f"{words}; here it took {fixed(load.yardstick_us)} µs ({varied}). {clocks}"


def made_with(cost: Cost) -> str:
    """Returns machine, versions and repeats as a sentence."""
    made = ", ".join(f"{name} {number}" for name, number in cost.versions.items())
    at = f" at {cost.commit}" if cost.commit else ""
    ways = f"one process {cost.repeats}, as processes {cost.processes_repeats or 'none'}"
    return f"{cost.machine}; {made}{at}. Repeats, interleaved in random order: {ways}."


def write(directory: Path, docs: Path) -> Path:
    """Writes page and figures from DIRECTORY/cost.json into ``docs``; returns the page's file.

    Raises CostFileError without a cost.json, FigureError without matplotlib or anything to draw.
    """
    cost = load(directory)
    docs.mkdir(parents=True, exist_ok=True)
    write_figure(figure.figure_of(cost), docs / FIGURE)
    if cost.prices:
        write_figure(prices_figure.figure_of(cost.prices), docs / PRICES_FIGURE)
    target = docs / PAGE
    target.write_text(page(cost), encoding="utf-8")
    return target


def page(cost: Cost) -> str:
    """Returns the page in Markdown."""
    parts = ["# What accuracy costs", _INTRO]
    for table in findings(cost):
        above = {"digits": takes_away, "alike": alike_sentence}.get(table.kind)
        sentence = [above(cost)] if above else []
        parts += [
            f"## {table.title}",
            *filter(None, sentence),
            markdown_table(table.heads, table.rows),
            _BELOW[table.kind],
        ]
    parts += [*_prices(cost.prices), "## Measured on", f"{yardstick(cost)} {made_with(cost)}"]
    return "\n\n".join(parts) + "\n"


def _prices(groups: list[PriceGroup]) -> list[str]:
    parts = []
    for group in (group for group in groups if group.name == "effects"):
        dearest = sorted(group.prices[1:], key=lambda price: -price.adds.median if price.adds else 0.0)
        rows = [[p.what, interval(p.adds), _moved(p.moves_m)] for p in dearest if p.adds]
        table = markdown_table(("", "adds", "motion moved"), rows, numbers=(1, 2))
        sentences = f"{effects_sentence(group)} {sum_sentence(group)}"
        parts += ["## What each effect costs, alone", sentences, table, _EFFECTS]
    if groups:
        parts.append(f"![What books, log, effects, processes, delay and rate cost]({PRICES_FIGURE})")
    tabled = [group for group in groups if group.name in _TABLED]
    if rows := [[f"{group.title}: {what}", *cells] for group in tabled for what, *cells in price_rows(group)[1:]]:
        parts += ["## The other prices", markdown_table(("", "time", "adds", "buys"), rows)]
    return parts


def _moved(moves_m: float | None) -> str:
    return "below 1 nm" if moves_m is not None and moves_m < 1e-9 else amount(moves_m, "m", 2)


def main() -> None:
    """Runs ``python -m haploop.tools.cost.page DIRECTORY DOCS``."""
    if len(sys.argv) != 3:
        leave("Two directories were expected: the one that haploop cost wrote, and the one for the page.", WRONG_USE)
    try:
        print(write(Path(sys.argv[1]), Path(sys.argv[2])))
    except (CostFileError, FigureError) as error:
        leave(str(error), WRONG_USE)


if __name__ == "__main__":
    main()
