"""Writer of docs/accuracy.md and its figures from a cost.json: ``make accuracy``."""

from __future__ import annotations

import sys
from pathlib import Path

from haploop.tools.cli.options import WRONG_USE, leave
from haploop.tools.cost import figure, prices_figure
from haploop.tools.cost.data import Cost, CostFileError, Point, PriceGroup, SceneCost, load
from haploop.tools.cost.findings import findings, length, power, rate, setting
from haploop.tools.cost.report import PRICE_HEADS, made_with, price_row
from haploop.tools.figure.data import FigureError
from haploop.tools.figure.style import write_figure
from haploop.tools.render.terminal import markdown_table
from haploop.tools.render.units import amount, fixed

PAGE, FIGURE, PRICES_FIGURE = "accuracy.md", "accuracy.png", "accuracy_prices.png"
_INTRO = """\
How much time a run takes depends on how accurate it is to be. Every number here was measured by `haploop cost` and
written by `make accuracy`; none was typed. An *error* is the root mean square, over the ticks of a run, of the
position's distance from a reference solved far more accurately; in a chaotic limit cycle, where positions cannot be
compared, it is that of the amplitude. A *time* is the median of a simulated tick in one process, all energy books kept;
in bold, the scene's own setting."""


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
    tolerance = amount(cost.tolerance_m, "m")
    parts = [
        "# What accuracy costs",
        _INTRO,
        "## Findings",
        *(
            part
            for table in findings(cost)
            for part in (f"### {table.title}", markdown_table(table.heads, table.rows), *table.notes)
        ),
        "## Error against time",
        f"![Error of each method against the time of a tick, scene by scene]({FIGURE})",
        *(part for scene in cost.scenes for part in _scene(scene)),
        *_prices(cost.prices),
        "## Measured on",
        " ".join([made_with(cost), *([str(cost.load)] if cost.load else []), f"The tolerance is {tolerance}."]),
    ]
    return "\n\n".join(parts) + "\n"


def _scene(scene: SceneCost) -> list[str]:
    reference = scene.reference
    rates = sorted({point.plant_rate for point in scene.points})
    methods = dict.fromkeys(point.method for point in scene.points)
    rows = [[method, *(_cell(scene, method, hertz) for hertz in rates)] for method in methods]
    swings = "" if reference.pointwise else " It is chaotic: compared by its swings, not by positions."
    about = f"*Reference:* {reference.how} It is known to {length(reference.error_m)}.{swings}"
    # Of the failures of a method the reason is told once, that of its highest rate.
    failed: dict[str, Point] = {point.method: point for point in scene.points if point.failure}
    reasons = [f"- Failed: {setting(point)}: {point.failure}" for point in failed.values()]
    table = markdown_table(["error, µs", *map(rate, rates)], rows, numbers=range(1, len(rates) + 1))
    return [f"### {scene.short_title}", about, table, *(["\n".join(reasons)] if reasons else []), scene.advice]


def _cell(scene: SceneCost, method: str, hertz: int) -> str:
    if (point := scene.point(method, hertz)) is None:
        return ""
    words = power(point.size_m) if point.error else "failed"
    if point.error and not point.is_right:
        words += f" ({point.error.verdict})"
    words += f", {fixed(point.us_per_tick.median)}" if point.us_per_tick else ""
    return f"**{words}**" if point is scene.own else words


def _prices(groups: list[PriceGroup]) -> list[str]:
    if not groups:
        return []
    parts = ["## The other prices", f"![What books, log, effects, processes, delay and rate cost]({PRICES_FIGURE})"]
    for group in groups:
        about = f"Medians of {group.repeats} repeats, {group.unit}: {group.how}. The first row is the baseline."
        heads = ["left out" if group.name == "effects" else "", *PRICE_HEADS[1:]]
        table = markdown_table(heads, map(price_row, group.prices), numbers=range(1, len(heads) - 1))
        parts += [f"### {group.title}", about, table]
    return parts


def main() -> None:
    """Runs ``python -m haploop.tools.cost.page DIRECTORY DOCS``."""
    if len(sys.argv) != 3:
        leave("Two directories were expected: that of a haploop cost, and where the page goes.", WRONG_USE)
    try:
        print(write(Path(sys.argv[1]), Path(sys.argv[2])))
    except (CostFileError, FigureError) as error:
        leave(str(error), WRONG_USE)


if __name__ == "__main__":
    main()
