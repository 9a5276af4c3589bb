"""The terminal report of ``haploop advise``, and its sentences: limits, causes of buzzing, and the advice, last."""

from __future__ import annotations

import math

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from haploop.tools.advise.advice import Advice
from haploop.tools.advise.buzz import Ablation, Buzz
from haploop.tools.advise.gains import Gains
from haploop.tools.advise.largest import Limit
from haploop.tools.advise.variations import SAMPLING
from haploop.tools.render.terminal import make_table, verdict_style
from haploop.tools.render.units import amount, fixed

_LONGEST_WORD = len("unidirectional")
_READING = (
    "Steady: every run of the task comes to rest, at this stiffness and at softer ones; swings that die away are "
    "followed longer, in a linear loop by the exact map. One 20 % off: the one quantity that then takes most. All 20 % "
    "off: the combinations that are likely the worst, with the gains that bear them best."
)

# A stiffness this much larger is worth a sentence.
_MORE = 1.1
# Every loop is sampled: that is named before a cause of this loop's own where it allows so many times as much.
_STANDS_OUT = 2.0
_NO_WALL = "No wall stays steady when delay, hand and device may each be 20 % off: add damping or cut the delay."
_RENDER = "Render at most {} with {}: steady{}."
_MARGIN = ", also with {} each 20 % off, in all {} combinations"
_AS_DESCRIBED = "In the loop as described the largest steady wall with these gains is {}."
_NO_ELEMENT = "Without any element the largest safe wall is {}."
_TEMPTING = "Up to {} would be steady in the loop as described with {}, but with 20 % doubt only {}."
_NEAREST = "The nearest instability is {}."
_NO_NEAREST = "No other single change that was tried, up to five times more or less, makes it unsteady."
_NEVER_BUZZES = "It does not buzz, nor does any wall that was tried, up to {}."
_ISLAND = "It does not buzz at {}, but a softer wall of {} does: it stands on an island."
_STEADY = "It does not buzz: its wall of {} could be {} times as stiff, {}, before it does."
_CAUSE = "It buzzes because of the {}: without it the wall is steady up to {}."
_OTHER_CAUSES = "It would also be steady without: {}."
_OTHER_ELEMENTS = "It would also be steady without the element: {}."
_ELEMENTS = "It is steady without the element: {}; no other single cause makes it buzz."
_TOGETHER = "No single cause makes it buzz: it is steady, up to {}, only without {} together."
_OTHER_SETS = "So would it be without: {}."
_TOO_STIFF = (
    "It buzzes even without all of these together: the wall is too stiff for what damping there is, sampled as finely "
    "as the plant steps."
)
_NO_CAUSE = "Nothing that could be switched off makes it buzz."
_HELPS = "Less is steady without: {}."


def report(found: Advice) -> RenderableType:
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
    """Makes a row a family: stiffnesses, and below each the gains, or the change, that it comes with."""
    table = _table("element")
    for name in ("largest steady", "one 20 % off", "all 20 % off"):
        table.add_column(name, justify="right")
    for gains in found.gains:
        worst = gains.worst
        row = [
            gains.family.name,
            _with(gains.limit, gains, gains.values),
            f"{format_limit(gains.alone[worst])}\n{worst.words}" if worst and gains.limit.stiffness_N_m else "–",
            _with(gains.safe, gains, gains.safe_values) if found.uncertain else "–",
        ]
        table.add_row(*row, style="bold" if gains is found.safe.gains else "")
    return table


def _with(limit: Limit, gains: Gains, values: tuple[float, ...]) -> str:
    has_values = bool(values and limit.stiffness_N_m)
    return format_limit(limit) + f"\n{gains.family.words(values)}" * has_values


def _islands(found: list[Gains]) -> list[Text]:
    told = [
        f"with {gains.family.name} up to {format_stiffness(max(gains.limit.steady_above_N_m))}"
        for gains in found
        if gains.limit.steady_above_N_m
    ]
    return [Text(f"Some stiffer walls are steady all the same: {', '.join(told)}.", style="dim")] if told else []


def bounds_table(found: Advice) -> Table:
    """Makes a row an analytic bound, a column a family; only families of which a bound speaks."""
    columns = [
        index for index, bounds in enumerate(found.bounds)
        if any(bound.applies for bound in bounds) or found.exact_N_m[index] is not None
    ]  # fmt: skip
    table = _table("analytic, for comparison", "of")
    for index in columns:
        gains = found.gains[index]
        table.add_column(f"{gains.family.name}\n{gains.family.words(gains.values)}", justify="right")
    rows = [("exact map, ρ(M) = 1", "stability", [found.exact_N_m[index] for index in columns])]
    for bounds in zip(*(found.bounds[index] for index in columns), strict=True):
        rows.append((bounds[0].name, bounds[0].kind, [bound.stiffness_N_m for bound in bounds]))
    for name, kind, stiffnesses in rows:
        if any(value is not None for value in stiffnesses):
            cells = ["–" if value is None else format_stiffness(value) if value else "none" for value in stiffnesses]
            table.add_row(name, kind, *cells)
    return table


def why_table(buzz: Buzz) -> RenderableType:
    """Makes a row a cause."""
    state = "is steady" if buzz.steady else "buzzes"
    head = f"{buzz.scene.title}: a wall of {format_stiffness(buzz.stiffness_N_m)} {state}"
    table = _table("without", "instead")
    table.add_column("verdict", no_wrap=True)
    for name in ("swing", "largest\nsteady"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("its part\nof the leak", justify="right")
    table.add_row("as it is", "", *_ran(buzz), "")
    table.add_section()
    for one in [*buzz.alone, *buzz.together, *([buzz.without_all] if buzz.without_all else [])]:
        words = one.instead if len(one.without) == 1 else ""
        share = "–" if one.leak_share is None else f"{100 * one.leak_share:.0f} %, {amount(one.leak_J, 'J')}"
        table.add_row(" and ".join(one.without), words, *_ran(one), share)
    return Group(Text(), Text(head, style="bold"), table)


def _ran(run: Buzz | Ablation) -> tuple[Text, str, str]:
    """Returns verdict, swing peak to peak (0 where it is less than an atom) and largest steady stiffness of a row."""
    word = "dies away" if run.steady and run.verdict != "steady" else run.verdict
    verdict = Text(word, style=verdict_style("steady" if run.steady else run.verdict))
    swing = amount(run.oscillation_m if run.oscillation_m >= 1e-10 else 0.0, "m")
    return verdict, swing, format_limit(run.largest) if run.largest else "–"


def _table(*names: str) -> Table:
    return make_table(*names, padding=(0, 1, 0, 0), first_width=_LONGEST_WORD)


def gain_sentences(found: Advice) -> list[str]:
    """Makes the advice in sentences: what to render, what else is known of it, and the nearest instability."""
    safe, best = found.safe, found.safe.gains
    if not safe.stiffness_N_m:
        return [_NO_WALL]
    margin = _MARGIN.format(", ".join(found.uncertain), safe.corners) if found.uncertain else ""
    nominal = best.tried[best.safe_values]
    said = [
        _RENDER.format(format_stiffness(safe.stiffness_N_m), best.family.phrase(best.safe_values), margin),
        _AS_DESCRIBED.format(format_limit(nominal)),
    ]
    if best is not found.gains[0]:
        said.append(_NO_ELEMENT.format(format_limit(found.gains[0].safe)))
    most = max((gains for gains in found.gains if gains is not best), key=lambda gains: gains.limit.stiffness_N_m)
    if most.limit.stiffness_N_m > _MORE * nominal.stiffness_N_m:
        said.append(
            _TEMPTING.format(format_limit(most.limit), most.family.phrase(most.values), format_limit(most.safe))
        )
    return [*said, _NEAREST.format(safe.nearest.words) if safe.nearest else _NO_NEAREST]


def buzz_sentences(buzz: Buzz) -> list[str]:
    """Makes the explanation in sentences: the cause of the buzzing, or the distance from it."""
    wall, limit = format_stiffness(buzz.stiffness_N_m), buzz.largest
    if buzz.steady:
        if not math.isfinite(limit.not_steady_N_m):
            return [_NEVER_BUZZES.format(format_stiffness(limit.stiffness_N_m))]
        if limit.stiffness_N_m < buzz.stiffness_N_m:
            return [_ISLAND.format(wall, format_stiffness(limit.not_steady_N_m))]
        times = fixed(limit.stiffness_N_m / buzz.stiffness_N_m, 2)
        return [_STEADY.format(wall, times, format_limit(limit))]
    cures = _ranked([one for one in buzz.alone if one.steady and not one.is_element])
    elements = _ranked([one for one in buzz.alone if one.steady and one.is_element])
    sets = _ranked(list(buzz.together))
    if cures:
        said = [_CAUSE.format(cures[0].without[0], _up_to(cures[0]))]
        others = [one for one in cures[1:] if one.largest and one.largest.stiffness_N_m > _MORE * buzz.stiffness_N_m]
        if others:
            said.append(_OTHER_CAUSES.format(_with_limits(others)))
        if elements:
            said.append(_OTHER_ELEMENTS.format(_with_limits(elements)))
    elif elements:
        said = [_ELEMENTS.format(_with_limits(elements))]
    elif sets:
        said = [_TOGETHER.format(_up_to(sets[0]), " and ".join(sets[0].without))]
        if sets[1:]:
            said.append(_OTHER_SETS.format("; ".join(" and ".join(one.without) for one in sets[1:])))
    else:
        said = [_TOO_STIFF if buzz.without_all else _NO_CAUSE]
    helps = [one.without[0] for one in buzz.alone if one.largest and not one.steady
             and one.largest.stiffness_N_m * _MORE < limit.stiffness_N_m]  # fmt: skip
    return [*said, _HELPS.format(", ".join(helps))] if helps else said


def format_stiffness(stiffness_N_m: float) -> str:
    """Formats a stiffness in N/m: ``1.4 N/mm``; softer than 0.01 N/mm in N/m; ``any`` for an infinite one."""
    if not math.isfinite(stiffness_N_m):
        return "any"
    if 0.0 < stiffness_N_m < 10.0:
        return f"{fixed(stiffness_N_m, 2)} N/m"
    return f"{fixed(stiffness_N_m / 1e3)} N/mm" if stiffness_N_m >= 1e3 else f"{fixed(stiffness_N_m / 1e3, 2)} N/mm"


def format_limit(limit: Limit) -> str:
    """Formats a limit: ``none`` where no wall is steady, ``over ...`` where no end was found."""
    if not limit.stiffness_N_m:
        return "none"
    over = "over " if not math.isfinite(limit.not_steady_N_m) else ""
    return over + format_stiffness(limit.stiffness_N_m)


def _ranked(some: list[Ablation]) -> list[Ablation]:
    """Sorts by the stiffest steady wall; sampling, which every loop has, counts only where it stands out."""

    def stands_out(one: Ablation) -> float:
        limit = one.largest.stiffness_N_m if one.largest else 0.0
        return limit / _STANDS_OUT if SAMPLING in one.without else limit

    return sorted(some, key=stands_out, reverse=True)


def _with_limits(some: list[Ablation]) -> str:
    return ", ".join(f"{one.without[0]} (up to {_up_to(one)})" for one in some)


def _up_to(one: Ablation) -> str:
    return format_limit(one.largest) if one.largest else "this"
