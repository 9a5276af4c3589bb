"""The terminal report of ``haploop compare``: what renders most, then tables of what is rendered and what it costs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict

import numpy as np
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from haploop.tools.advise.families import NOTHING
from haploop.tools.advise.report import format_stiffness
from haploop.tools.compare.bench import MOST_N_M, Row, family_of
from haploop.tools.compare.comparison import Comparison, OfLoop
from haploop.tools.compare.ranking import best, held, ranking
from haploop.tools.render.terminal import make_facts, make_table
from haploop.tools.render.units import amount, fixed
from haploop.tools.search.intervals import mean_interval

READING = (
    "Wall: the stiffest of a seed's conditions that is safe, as are all softer ones tried, mean of the seeds. Held: "
    "mean force over mean penetration, with its 95 % interval over the seeds. Contact: slope of the force on the first "
    "way in. Ripple: of the command above 30 Hz, peak to peak. Extra: the element's own force, largest and root mean "
    "square. ±20 %: what is held with all parameters, or the device, 20 % less and 20 % more, over that without. * a "
    "parameter at the end of its search, † no wall was too stiff: what is told may be more elsewhere. Two are "
    "apart where the interval of their difference, seed by seed under the same conditions, does not hold 0; ranked is "
    "what is apart under two sets of seeds, tuning included. Bold: those not told from the best."
)
_TIED = "{0} renders most, {1}; it cannot be told apart from {2}."
_NO_GAIN = "{0} renders most, {1}, but cannot be told apart from no element, {2}."
_FIRST = "{0} renders most, {1}, and more than every other."
_AGAIN = "{0} of {1} pairs that are apart are so under other seeds, tuning included; {2} are the other way round."


def report(told: Comparison) -> RenderableType:
    """Makes the report, 80 columns wide."""
    first = told.loops[0]
    parts: list[RenderableType] = [
        Text(f"All stabilizers on {told.name}, each tuned alike.", style="bold"),
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
        f"Tried by {told.task}: {effort.cases} such conditions tune {2 * effort.points + 1} sets of parameters each, "
        f"{effort.seeds} seeds of {effort.of_seed} others try the best one. So the walls are for "
        "comparing, not for building: `haploop advise` tries one in some thousand cases."
    )


def most_sentence(of: OfLoop) -> str:
    """Says what renders most, and what cannot be told from it under both sets of seeds."""
    found, tied = best(of)
    without = next(row for row in of.rows if row.family == NOTHING.name)
    if without is found or without in tied:
        return _NO_GAIN.format(with_parameters(found), *(format_stiffness(held(row).value) for row in (found, without)))
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


def cells(row: Row) -> dict[str, str]:
    """Formats all that is told of a row."""
    inside = held(row)
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
        "held": f"{fixed(inside.value / 1e3)} ({fixed(max(0.0, inside.low) / 1e3)}–{fixed(inside.high / 1e3)})",
        "contact": fixed(mean("contact_N_m") / 1e3),
        "ripple": amount(mean("ripple_N"), "N", 2) if is_safe else "–",
        "extra": f"{amount(mean('extra_N'), 'N', 2)}, {amount(mean('extra_rms_N'), 'N', 2)}" if row.values else "–",
        "±20 %": _shares(row.parameter),
        "device ±20 %": _shares(row.device),
        "breaks first": _breaks(row),
    }


def _shares(shares: Sequence[float]) -> str:
    return ", ".join(fixed(share, 2) for share in shares) or "–"


def _table(of: OfLoop, heads: dict[str, str], numbers: Sequence[str]) -> Table:
    table = make_table(*heads.values(), numbers=[heads[name] for name in numbers], padding=(0, 0, 0, 0))
    found, tied = best(of)
    for row in of.rows:
        told = cells(row)
        table.add_row(*(told[name] for name in heads), style="bold" if row is found or row in tied else "")
    return table


def _rendered(of: OfLoop) -> Table:
    heads = {"element": "element", "parameter": "parameter", "wall": "wall\nN/mm", "held": "held\nN/mm",
             "contact": "contact\nN/mm"}  # fmt: skip
    return _table(of, heads, ("wall", "held", "contact"))


def _costs(of: OfLoop) -> Table:
    heads = {"element": "element", "ripple": "ripple", "extra": "extra", "±20 %": "±20 %",
             "device ±20 %": "device\n±20 %", "breaks first": "breaks first"}  # fmt: skip
    table = make_table(*heads.values(), numbers=[heads["ripple"]])
    for row in of.rows:
        told = cells(row)
        table.add_row(*(told[name] for name in heads))
    return table


def _breaks(row: Row) -> str:
    """Says where a wall breaks first, in short: how stiff, how often it swings, and at which hold."""
    worst = min((each for each in row.seeds if each.failure), key=lambda each: each.fails_N_m, default=None)
    if not worst or not worst.failure:
        return "–"
    hold = worst.failure.case.partition(",")[0]
    swing = "leaves its limits" if worst.failure.gone else f"{worst.failure.frequency_Hz:.0f} Hz"
    return f"{fixed(worst.fails_N_m / 1e3, 2)} N/mm, {swing}, {hold}"


def _others(loops: Sequence[OfLoop]) -> Table:
    """Makes the table of what is held on every loop, in N/mm."""
    heads = ["element", *(of.name for of in loops)]
    table = make_table(*heads, numbers=())
    for rows in zip(*(of.rows for of in loops), strict=True):
        table.add_row(rows[0].family, *(cells(row)["held"] for row in rows))
    return table


def comparison_data(told: Comparison) -> dict[str, object]:
    """Returns the comparison as one JSON object, the sentences first."""
    first = told.loops[0]
    order = ranking(first)
    pairs = {
        "told": sorted(order.told),
        "reproduced": sorted(order.reproduced),
        "other_way": sorted(order.contradicted),
    }
    return {"most": most_sentence(first), "again": again_sentence(first), "apart": pairs, **asdict(told)}
