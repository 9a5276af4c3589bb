"""The commands that show runs, or compare them with one another."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from haploop.tools.command.given import kinds_with
from haploop.tools.command.options import WRONG_USE, Directory, Json, Plugin, leave, plain_errors, print_json

if TYPE_CHECKING:
    from rich.console import RenderableType

    from haploop.tools.figure.difference import Difference

# Words of the results, with the unit of a number.
_WORDS = {
    "verdict": ("verdict", ""),
    "provisos": ("provisos", ""),
    "ended": ("ended", ""),
    "logged_s": ("log ends at", "s"),
    "oscillation_m": ("oscillation at the end", "m"),
    "force_swing_N": ("commanded force, peak to peak", "N"),
    "force_ripple_N": ("commanded ripple above about 30 Hz", "N"),
    "width_m": ("pushed, it swings by", "m"),
    "frequency_Hz": ("  at", "Hz"),
    "trajectory_sha256": ("trajectory hash", ""),
}
# Characters of a hash that are enough to tell two apart.
_HASH_LETTERS = 16
# Logged columns of the controller in words.
_COLUMNS = {
    "x": "the measured position",
    "v": "the estimated velocity",
    "a": "the estimated acceleration",
    "wall": "the force of the wall",
    "total": "the force of wall and elements together",
    "in_contact": "whether there is contact",
}


def plot(
    directory: Annotated[list[Path], typer.Argument(help="directories of runs, or one of a sweep", show_default=False)],
    out: Annotated[Path | None, typer.Option(help="the figure's file [in the first directory]")] = None,
    plugin: Plugin = None,
) -> None:
    """Draw a run, several runs overlaid, or a sweep's map.

    A run that was killed is drawn up to the end of its log, an unfinished sweep as far as it got. The last line
    names the figure's file.
    """
    from haploop.tools.draw import draw_any
    from haploop.tools.figure.data import FigureError

    with plain_errors():
        if plugin:
            kinds_with(plugin)
        try:
            target = draw_any(directory, out)
        except FigureError as error:
            leave(str(error), WRONG_USE)
    print(target)


def diff(first: Directory, second: Directory, json: Json = False) -> None:
    """Say how two runs differ, and at which tick they part."""
    from haploop.tools.figure.data import FigureError
    from haploop.tools.figure.difference import difference_of
    from haploop.tools.render.terminal import console

    with plain_errors():
        try:
            found = difference_of(first, second)
        except FigureError as error:
            leave(str(error), WRONG_USE)
    if json:
        print_json(dataclasses.asdict(found))
    else:
        console().print(difference_table(found))


def difference_table(found: Difference) -> RenderableType:
    """Makes the table of two runs: how their scenes differ, their results, their energies, and where they part."""
    from rich.console import Group
    from rich.text import Text

    from haploop.protocol.amounts import amount
    from haploop.tools.figure.data import TOGETHER
    from haploop.tools.figure.difference import scene_value
    from haploop.tools.figure.run_names import shortened
    from haploop.tools.render.terminal import make_table, verdict_style

    table = make_table("", *shortened(found.runs), unbroken=("",))
    if found.names[0] != found.names[1]:
        table.add_row("title", *(Text(name, "bold") for name in found.names))
        table.add_section()
    for key, pair in found.scene.items():
        units = (f" {found.units[key]}" if isinstance(value, int | float) else "" for value in pair)
        told = [f"{scene_value(value)}{unit}" for value, unit in zip(pair, units, strict=True)]
        table.add_row(Text(key), *map(Text, map(str.rstrip, told)))
    if not found.scene:
        table.add_row("scene", "the same", "the same")
    if any(found.events):
        table.add_row("what happened", *(Text("\n".join(events) or "–") for events in found.events))
    table.add_section()
    for name, pair in found.results.items():
        words, unit = _WORDS[name]
        told = [_result(value, unit) for value in pair]
        told = [text[:_HASH_LETTERS] for text in told] if name == "trajectory_sha256" else told
        styles = [verdict_style(text) if name == "verdict" else "" for text in told]
        table.add_row(words, *(Text(text, style) for text, style in zip(told, styles, strict=True)))
    table.add_section()
    for name, pair in found.energies_J.items():
        table.add_row(
            Text("wall and elements together" if name == TOGETHER else name), *(amount(value, "J") for value in pair)
        )
    return Group(table, Text(parting_words(found), "bold"))


def parting_words(found: Difference) -> str:
    """Returns the sentence on where two runs part."""
    if found.why_not:
        return found.why_not
    if found.parting is None:
        return f"Every bit that both logs hold is the same; ticks in both: {found.ticks}."
    tick, at_s, column = found.parting.tick, found.parting.at_s, found.parting.column
    what = f"{_COLUMNS[column]} (column {column})" if column in _COLUMNS else f"column {column}"
    if not tick:
        return f"They part at their first tick, where {what} differs first."
    return f"They part at tick {tick}, at {at_s:g} s: up to there every bit is the same, then {what} differs first."


def _result(value: Any, unit: str) -> str:
    from haploop.protocol.amounts import amount

    if value is None:
        return "–"
    return amount(value, unit) if unit else f"{value}"
