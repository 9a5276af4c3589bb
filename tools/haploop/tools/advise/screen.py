"""What ``haploop advise`` shows on the terminal: what is steady, why it buzzes, and the advice, last."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.console import Group
from rich.table import Table
from rich.text import Text

from haploop.tools.advise.sentences import buzz_sentences, gain_sentences, largest, share, stiff
from haploop.tools.render.terminal import make_table, verdict_style
from haploop.tools.render.units import amount

if TYPE_CHECKING:
    from rich.console import RenderableType

    from haploop.tools.advise.advice import Advice
    from haploop.tools.advise.buzz import Buzz
    from haploop.tools.advise.limits.gains import Gains
    from haploop.tools.advise.limits.largest import Limit
    from haploop.tools.linear.bounds import Bound

_LONGEST_WORD = len("unidirectional")
_READING = (
    "Steady: every run of the task comes to rest, at this stiffness and at softer ones; swings that die away are "
    "followed longer, in a linear loop by the exact map. One 20 % off: the one quantity that then takes most. All 20 % "
    "off: the combinations that are likely the worst, with the gains that bear them best."
)


def report(found: Advice) -> RenderableType:
    """Everything."""
    judged = f"Judged by {found.tasks.words}; limits to {100.0 * found.tolerance:.0f} %, {found.runs} runs."
    parts: list[RenderableType] = [
        Text(f"{found.name}: the largest steady wall", style="bold"),
        Text(judged, style="dim"),
        *(Text(note, style="dim") for note in found.notes),
        gains_table(found),
        *_islands(found.gains),
        Text(_READING, style="dim"),
    ]
    if any(bound.applies for bounds in found.bounds for bound in bounds) or any(found.exact_N_m):
        parts.append(bounds_table(found))
    if found.buzz:
        parts += [why_table(found.buzz), *map(Text, buzz_sentences(found.buzz)), Text()]
    first, *more = gain_sentences(found)
    return Group(*parts, Text(first, style="bold"), *map(Text, more))


def gains_table(found: Advice) -> Table:
    """A family a row: stiffnesses, and below each the gains, or the change, that it comes with."""
    table = _table("element")
    for name in ("largest steady", "one 20 % off", "all 20 % off"):
        table.add_column(name, justify="right")
    for gains in found.gains:
        worst = gains.worst
        row = [
            gains.family.name,
            _with(gains.limit, gains, gains.values),
            f"{largest(gains.alone[worst])}\n{worst.words}" if worst and gains.limit.stiffness_N_m else "–",
            _with(gains.safe, gains, gains.safe_values) if found.uncertain else "–",
        ]
        table.add_row(*row, style="bold" if gains is found.safe.gains else "")
    return table


def _with(limit: Limit, gains: Gains, values: tuple[float, ...]) -> str:
    has_values = bool(values and limit.stiffness_N_m)
    return largest(limit) + f"\n{gains.family.words(values)}" * has_values


def _islands(found: list[Gains]) -> list[Text]:
    told = [
        f"with {gains.family.name} up to {stiff(max(gains.limit.islands_N_m))}"
        for gains in found
        if gains.limit.islands_N_m
    ]
    return [Text(f"Some stiffer walls are steady all the same: {', '.join(told)}.", style="dim")] if told else []


def bounds_table(found: Advice) -> Table:
    """An analytic bound a row, a family a column; only families of which one speaks."""
    columns = [
        index for index, bounds in enumerate(found.bounds)
        if any(bound.applies for bound in bounds) or found.exact_N_m[index] is not None
    ]  # fmt: skip
    table = _table("analytic, for comparison", "of")
    for index in columns:
        gains = found.gains[index]
        table.add_column(f"{gains.family.name}\n{gains.family.words(gains.values)}", justify="right")
    exact = [found.exact_N_m[index] for index in columns]
    if any(value is not None for value in exact):
        table.add_row("exact map, ρ(M) = 1", "stability", *("–" if value is None else stiff(value) for value in exact))
    for row in zip(*(found.bounds[index] for index in columns), strict=True):
        if any(bound.applies for bound in row):
            table.add_row(row[0].name, row[0].kind, *map(_bound, row))
    return table


def _bound(bound: Bound) -> str:
    return "–" if bound.stiffness_N_m is None else stiff(bound.stiffness_N_m) if bound.stiffness_N_m else "none"


def why_table(buzz: Buzz) -> RenderableType:
    """A cause a row."""
    state = "is steady" if buzz.steady else "buzzes"
    head = f"{buzz.scene['title']}: a wall of {stiff(buzz.stiffness_N_m)} {state}"
    table = _table("without", "instead")
    table.add_column("verdict", no_wrap=True)
    for name in ("swing", "largest\nsteady"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("its part\nof the leak", justify="right")
    table.add_row(
        "as it is", "", _verdict(buzz.steady, buzz.verdict), _swing(buzz.oscillation_m), largest(buzz.limit), ""
    )
    table.add_section()
    every = [*buzz.alone, *buzz.together, *([buzz.all_off] if buzz.all_off else [])]
    for without in every:
        limit = largest(without.limit) if without.limit else "–"
        swing = _swing(without.oscillation_m)
        words = without.words if len(without.names) == 1 else ""
        verdict = _verdict(without.steady, without.verdict)
        table.add_row(" and ".join(without.names), words, verdict, swing, limit, share(without))
    return Group(Text(), Text(head, style="bold"), table)


def _verdict(steady: bool, verdict: str) -> Text:
    word = "dies away" if steady and verdict != "steady" else verdict
    return Text(word, style=verdict_style("steady" if steady else verdict))


def _swing(oscillation_m: float) -> str:
    """Peak to peak; nothing where it is less than an atom."""
    return amount(oscillation_m if oscillation_m >= 1e-10 else 0.0, "m")


def _table(*names: str) -> Table:
    return make_table(*names, padding=(0, 1, 0, 0), first_width=_LONGEST_WORD)
