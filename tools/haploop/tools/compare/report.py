"""The terminal report of ``haploop compare``: what renders most, then tables of what is rendered and what it costs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from haploop.protocol.amounts import amount, fixed
from haploop.tools.advise.families import NOTHING
from haploop.tools.compare.bench import MOST_N_M, Row, family_of
from haploop.tools.compare.comparison import Comparison, OfLoop
from haploop.tools.compare.ranking import best, choice, held, more, ranking, without
from haploop.tools.render.terminal import make_facts, make_table
from haploop.tools.render.units import format_stiffness
from haploop.tools.search.intervals import mean_interval

READING = (
    "Wall set: the stiffest that is safe in all conditions of a seed, as are all softer ones tried; mean over the "
    "seeds. Wall held: mean force over mean measured penetration of that wall. More than none: wall held, minus that "
    "without any element under the same seed; mean and 95 % interval over the seeds. Contact: slope of the force on "
    "the first way in. Ripple: of the command above 30 Hz, peak to peak. Extra: the element's own force, largest and "
    "root mean square. ±20 %: what is held with all parameters, or the device, 20 % less and 20 % more, as a multiple "
    "of what is held without the change. Breaks first: the softest wall that failed under any seed. *: a parameter at "
    "an end of its search; the smallest amounts to about no element. †: no wall was too stiff; other parameters may "
    "hold more. ▲ ▼: shown to hold more, or less, than none, by three standard errors, in the same direction "
    "under two sets of seeds, each with its own tuning. Bold: not told apart from the best by the same rule."
)
SIGNS = {"more": " ▲", "less": " ▼", "alike": ""}
_TIED = "{0} renders most, {1}; it cannot be told apart from {2}."
_NO_GAIN = "No element is shown to hold more than none, {0}."
_FIRST = "{0} renders most, {1}, and more than every other."
_AGAIN = "{0} of {1} pairs that differ under these seeds do so under others, too; {2} are the other way round."


def report(told: Comparison) -> RenderableType:
    """Makes the report, 80 columns wide."""
    first = told.loops[0]
    parts: list[RenderableType] = [
        Text(f"All stabilizers on {told.name}, each tuned alike: for comparing, not for building.", style="bold"),
        make_facts([("most", most_sentence(first)), ("again", again_sentence(first))], least_width=7),
        Text(),
        *(Text(note, style="dim") for note in told.notes),
        _rendered(first),
        _costs(first),
        Text(task_sentence(told), style="dim"),
        Text(READING, style="dim"),
    ]
    return Group(*parts, *([_others(told.loops)] if len(told.loops) > 1 else []))


def task_sentence(told: Comparison) -> str:
    effort = told.effort
    return (
        f"Tried with {told.task}; a seed draws {effort.of_seed} such conditions. Of each element, {effort.points + 1} "
        f"sets of parameters are tried with {effort.first} seeds, the best {effort.finalists} and {effort.around} "
        f"around them with {effort.tuning}, the best {effort.finalists} and the smallest with {effort.last}; of those "
        "that then hold as much within a standard error, the one that adds the least force is tried with "
        f"{effort.seeds}, each time other seeds. A wall to build with is one that `haploop advise` has tried, in some "
        "thousand cases."
    )


def most_sentence(of: OfLoop) -> str:
    """Says which stabilizer renders most, and which cannot be told from it under both sets of seeds."""
    found, tied = best(of)
    if choice(of).family == NOTHING.name:
        return _NO_GAIN.format(format_stiffness(held(without(of.rows)).value))
    name, value = with_parameters(found), format_stiffness(held(found).value)
    return _TIED.format(name, value, join([row.family for row in tied])) if tied else _FIRST.format(name, value)


def again_sentence(of: OfLoop) -> str:
    order = ranking(of)
    return _AGAIN.format(len(order.reproduced), len(order.told), len(order.contradicted))


def with_parameters(row: Row) -> str:
    words = family_of(row.family).words(row.values)
    return f"{row.family} ({words})" if row.values else row.family


def join(names: Sequence[str]) -> str:
    """Joins names: ``a, b and c``."""
    return " and ".join(filter(None, [", ".join(names[:-1]), *names[-1:]]))


def cells(row: Row, of: OfLoop) -> dict[str, str]:
    """Formats all numbers of a row on its loop, by column."""
    shown = [each.rendered for each in row.seeds]
    wall = float(np.mean([each.wall_N_m for each in row.seeds]))
    marks = ("†" if "wall" in row.at_edge else "") + ("*" if set(row.at_edge) - {"wall"} else "")
    is_safe = any(each.held_N_m for each in shown)

    def mean(name: str) -> float:
        return mean_interval([getattr(each, name) for each in shown]).value

    return {
        "element": row.family,
        "parameter": family_of(row.family).words(row.values) + marks,
        "wall": fixed(min(wall, MOST_N_M) / 1e3),
        "held": fixed(mean("held_N_m") / 1e3),
        "more": gain(row, of),
        "contact": fixed(mean("contact_N_m") / 1e3),
        "ripple": amount(mean("ripple_N"), "N", 2) if is_safe else "–",
        "extra": f"{amount(mean('extra_N'), 'N', 2)}, {amount(mean('extra_rms_N'), 'N', 2)}" if row.values else "–",
        "±20 %": _shares(row.parameter),
        "device ±20 %": _shares(row.device),
        "breaks first": _breaks(row),
    }


def gain(row: Row, of: OfLoop) -> str:
    """Formats how much more is held than with no element, N/mm, marked if told apart: ``+0.3 (+0.1 to +0.5) ▲``."""
    if row.family == NOTHING.name:
        return "–"
    inside = more(row, without(of.rows))
    value, low, high = (f"{end / 1e3:+.2f}".replace("-", "−") for end in inside)
    return f"{value} ({low} to {high}){SIGNS[ranking(of).versus(row.family, NOTHING.name)]}"


def _shares(shares: Sequence[float]) -> str:
    return ", ".join(fixed(share, 2) for share in shares) or "–"


def _table(of: OfLoop, heads: dict[str, str], numbers: Sequence[str], padding: int) -> Table:
    table = make_table(*heads.values(), numbers=[heads[name] for name in numbers], padding=(0, padding, 0, 0))
    found, tied = best(of)
    for row in of.rows:
        told = cells(row, of)
        table.add_row(*(told[name] for name in heads), style="bold" if row is found or row in tied else "")
    return table


def _rendered(of: OfLoop) -> Table:
    heads = {"element": "element", "parameter": "parameter", "wall": "wall set\nN/mm", "held": "wall held\nN/mm",
             "more": "more than none\nN/mm", "contact": "contact\nN/mm"}  # fmt: skip
    return _table(of, heads, ("wall", "held", "contact"), 0)


def _costs(of: OfLoop) -> Table:
    heads = {"element": "element", "ripple": "ripple", "extra": "extra", "±20 %": "±20 %",
             "device ±20 %": "device\n±20 %", "breaks first": "breaks first"}  # fmt: skip
    return _table(of, heads, ("ripple",), 1)


def _breaks(row: Row) -> str:
    """Says where a wall breaks first, in short: how stiff, at which frequency, and at which hold."""
    worst = min((each for each in row.seeds if each.failure), key=lambda each: each.fails_N_m, default=None)
    if not worst or not worst.failure:
        return "–"
    hold = worst.failure.case.partition(",")[0]
    swing = "leaves its limits" if worst.failure.gone else f"{worst.failure.frequency_Hz:.0f} Hz"
    return f"{fixed(worst.fails_N_m / 1e3, 2)} N/mm, {swing}, {hold}"


def loops_rows(loops: Sequence[OfLoop]) -> list[list[str]]:
    """Makes the rows of a table of what is held on every loop: without any element, and how much more with each."""
    rows = [[NOTHING.name, *(f"{held(without(of.rows)).value / 1e3:.2f}" for of in loops)]]
    for alike in zip(*(of.rows for of in loops), strict=True):
        if alike[0].family != NOTHING.name:
            rows.append([alike[0].family, *map(gain, alike, loops)])
    return rows


def _others(loops: Sequence[OfLoop]) -> Table:
    table = make_table("held, N/mm: without;\nhow much more with", *(of.name for of in loops), numbers=())
    for row in loops_rows(loops):
        table.add_row(*row)
    return table


def element_data(row: Row) -> dict[str, Any]:
    """Returns an element as data: its name, what it holds, N/m, mean over the seeds, and its parameters in SI units."""
    sizes = zip(family_of(row.family).parts, row.values, strict=True)
    parameters = {f"{kind}.{key}": value for (kind, key), value in sizes}
    return {"element": row.family, "held_N_m": held(row).value, "parameters": parameters}


def comparison_data(told: Comparison) -> dict[str, object]:
    """Returns the comparison as one JSON object, the sentences first."""
    first = told.loops[0]
    order = ranking(first)
    pairs = {
        "told": sorted(order.told),
        "reproduced": sorted(order.reproduced),
        "other_way": sorted(order.contradicted),
    }
    said = {"most": most_sentence(first), "again": again_sentence(first)}
    return {"recommended": element_data(choice(first)), **said, "apart": pairs, **asdict(told)}
