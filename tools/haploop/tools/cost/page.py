"""Writer of docs/accuracy.md and its figures from a cost.json: ``make accuracy``."""

from __future__ import annotations

import sys
from pathlib import Path

from haploop.tools.cli.options import WRONG_USE, leave
from haploop.tools.cost import figure, prices_figure
from haploop.tools.cost.data import Cost, CostFileError, PriceGroup, load
from haploop.tools.cost.findings import alike_sentence, effects_sentence, findings, interval, sum_sentence, takes_away
from haploop.tools.cost.report import made_with, price_rows, yardstick
from haploop.tools.figure.data import FigureError
from haploop.tools.figure.style import write_figure
from haploop.tools.render.terminal import markdown_table
from haploop.tools.render.units import amount

# Groups that are told in a table; the others are curves of the figure.
_TABLED = ("books", "log", "processes")
PAGE, FIGURE, PRICES_FIGURE = "accuracy.md", "accuracy.png", "accuracy_prices.png"
_INTRO = """\
Which method, what the next digit costs, what each effect costs. Every number was measured by `haploop cost` and
written by `make accuracy`; the command prints all of them. An *error* is the root mean square, over the ticks of a
run, of the position's distance from a reference in 50 digits. A *time* is that of a simulated tick with all energy
books, over that of a yardstick timed before and after it: a median, and in brackets its 95 % interval. Times whose
intervals overlap are not ranked."""
_DIGITS = """\
Each cell names the cheapest setting, or all that are as cheap, and the time of the first. Below the error in the last
column no method was found that takes less time than the exact flow. Friction is what makes a tick dear: the exact
flow finds each stop and start to the last digit, the one-step methods let them fall on plant steps and have an error
of first order, whatever their own order is."""
_ALIKE = """\
Without friction a step of any of these methods is a small linear map. Operations are additions and multiplications,
counted; times are of steps of 4096 motions in arrays, every method by the same kind of formula. Operations a tick are
those at the lowest of the plant rates compared that is exact enough; a dash where none was."""
_SWINGS = """\
Here a start moved by 1 µm ends somewhere else, so neither positions nor single swings can be compared. The error is
that of the mean amplitude over 30 starts 1 µm apart, each against the exact flow from the same start, with its 95 %
interval; *at most* where that reaches 0. Methods whose intervals overlap are not ranked."""
_EFFECTS = """\
Each effect by itself, with its values of `all_effects.toml`, is added to a mass in a hand of 10 kg that swings by 30
mm through a soft wall; so the motion stays what it was, within the last column. Effects of the accelerometer are
added to an ideal one. Whatever needs bodies in a row (cable, grip, bandwidths, friction, jitter, loss) pays for them
alone, and shares them with others."""


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
    digits, *others = findings(cost)
    alike = [table for table in others if table.heads[1].startswith("operations")]
    swings = [table for table in others if table not in alike]
    parts = ["# What accuracy costs", _INTRO, f"## {digits.title}", takes_away(cost)]
    parts += [markdown_table(digits.heads, digits.rows), _DIGITS]
    parts += [f"![Error of each method against the time of a tick, scene by scene]({FIGURE})"]
    for table in alike:
        parts += [
            f"## {table.title}",
            *filter(None, [alike_sentence(cost)]),
            markdown_table(table.heads, table.rows),
            _ALIKE,
        ]
    for table in swings:
        parts += [f"## {table.title}", markdown_table(table.heads, table.rows), _SWINGS]
    parts += _prices(cost.prices)
    parts += ["## Measured on", f"{yardstick(cost)} {made_with(cost)}"]
    return "\n\n".join(parts) + "\n"


def _prices(groups: list[PriceGroup]) -> list[str]:
    parts = []
    for group in groups:
        if group.name == "effects":
            dearest = sorted(group.prices[1:], key=lambda price: -price.adds.median if price.adds else 0.0)
            rows = [[p.what, interval(p.adds), _moved(p.moves_m)] for p in dearest if p.adds]
            table = markdown_table(("", "adds", "motion moved"), rows, numbers=(1, 2))
            sentences = f"{effects_sentence(group)} {sum_sentence(group)}"
            parts += ["## What each effect costs, alone", sentences, table, _EFFECTS]
    rows = [
        [f"{group.title}: {what}", *cells]
        for group in groups
        if group.name in _TABLED
        for what, *cells in price_rows(group)[1]
    ]
    figure = [f"![What books, log, effects, processes, delay and rate cost]({PRICES_FIGURE})"] * bool(groups)
    table = [markdown_table(("", "time", "adds", "buys"), rows)] * bool(rows)
    return [*parts, *figure, *["## The other prices"] * bool(rows), *table]


def _moved(moves_m: float | None) -> str:
    return "below 1 nm" if moves_m is not None and moves_m < 1e-9 else amount(moves_m, "m", 2)


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
