"""The terminal report of ``haploop advise``: the answer first, then the tables it rests on."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from haploop.protocol.amounts import amount, fixed
from haploop.tools.advise.advice import READING, Advice, Changed
from haploop.tools.advise.changes import CLOSE
from haploop.tools.advise.walls.felt import felt_force_N
from haploop.tools.advise.walls.limit import LEAST_N_M, Limit
from haploop.tools.advise.walls.store import Failure
from haploop.tools.advise.withstand import ROUGH, WORTH, Best
from haploop.tools.linear.linearity import installed_kinds
from haploop.tools.linear.terms import one_count
from haploop.tools.render.terminal import make_facts, make_table
from haploop.tools.render.units import format_stiffness

_NO_WALL = "none: no wall withstands every case"
_NOTHING_BREAKS = "nothing that was tried"
# Trials compare force and motion with what is felt, with friction projected on the steps; a run is judged differently.
_SHOWN_AT_END = "; advice_breaks.toml ends with it: its swing and its force are felt there, whatever its verdict"
_SHOWN_BY_NONE = "; no scene shows it: with friction solved exactly, as in a run, no hand would feel it"
_FELT, _FELT_BOTH = {True: "force", False: "motion"}, "force and as motion"
_AT, _TURNS = "at {hz:.0f} Hz", "at no single frequency, turning {turns} times in {within:g} s"
# A changed limit tells something if it differs by more than this, which is more than its tolerance.
_TELLS = 1.2
_NONE_MAKES = "no single change that was tried makes a wall possible"
_NO_CHANGE, _NO_LOSS = "no single change that was tried gains a fifth", "no single change that was tried costs a sixth"
_TUNED, _TIMES, _TIMES_ALONE = ", with the element tuned again", "{0}: {1} times", " ({0} without an element)"
_GAINS_ALONE = "the wall without an element gains from more changes: {0}"
_IN_CORNERS = "of {0}, a wall that withstands the hardest corners, but not the attack: "
_HAND = "of {0} kg, {1} N s/m and {2} N/m{3}, each 20 % more or less; another hand may make this wall buzz (--hand)"
_GRIP = ", holding through a grip of {0} N s/m and {1} N/m"
_NO_HAND = "none, only its force: a hand may make this wall buzz (--hand)"
_SAFE = "{0} with {1}: at rest, or swinging by less than a hand feels"
_SLOWLY = "after {at_s:.3g} s it still swings slowly, or is off the wall, {width} peak to peak; {case}"
_GRITTY = "; counts may be felt as grit"
# What the run of the advised scene adds to "steady"; the search has tried the wall at every hold.
_SOME_HOLDS = "tried at only some holds of its hand"
_ADDS = "haploop run adds to its verdict on advice.toml: {0}"
_PUSHED = "it pushes the loop at only some holds of its hand; this wall was tried at all of them"
_STEP = "with each count of the encoder, the wall's force changes by {0}"
_KICK = " and the element's force jumps by up to {0} and back, in all by {1} peak to peak"
_GRIT = (
    ": in a slow press, grit, which is no swing; a vibration of that force at {0:.0f} Hz would be {1} times what a "
    "hand feels"
)
# Where a hand feels a vibration best, about.
_BEST_FELT_HZ = 100.0
# Of what happens in one of n cases, N cases miss e^(-N/n): a twentieth for n = N / 3.
_TRIED = "{0} cases; a buzz that comes in fewer than one of {1:.0f} such cases may have been missed"
_ALONE = "{0} without one, searched and attacked in the same way"
# What is assumed, how much that costs, and what to measure.
_ASSUMED = "{0}, neither measured nor published: the wall withstands {1} at half and at twice its value. {2}"
_COSTS = "If {0} were right: about {1} with {2}, not attacked. {3}"
_SAME = "If {0} were right, the wall would be equally stiff within a tenth."
_MEASURE = "Measure {0} first: it affects the wall most."


def report(told: Advice) -> RenderableType:
    """Makes the report, 80 columns wide; the first lines are the answer."""
    style = "bold yellow" if told.is_ideal else "bold"
    parts: list[RenderableType] = [
        Text(told.headline, style=style),
        make_facts(answer(told), least_width=11),
        Text(),
        *(Text(note, style="dim") for note in told.notes),
        Text(f"Tried with {told.tried_by}.", style="dim"),
        _elements(told),
        Text(READING, style="dim"),
        _limits(told),
        _changes(told),
    ]
    return Group(*parts, *([_assumed(told)] if told.assumed else []))


def answer(told: Advice) -> list[tuple[str, str]]:
    """Returns the lines that a builder reads first, each with its name."""
    found, best = told.found, told.found.advised
    at_a_count, times_felt = describe_count(told)
    safe = _SAFE.format(format_stiffness(found.stiffness_N_m), best.family.phrase(best.values))
    safe += _GRITTY if times_felt >= 1.0 else ""
    lines = [("at most" if told.is_ideal else "safe up to", safe if found.stiffness_N_m else _NO_WALL)]
    if found.stiffness_N_m and told.provisos:
        lines.append(("its run", describe_run(told.provisos)))
    if at_a_count:
        lines.append(("at a count", at_a_count))
    lines.append(("for a hand", describe_hand(told)))
    if found.stiffness_N_m:
        lines.append(("tried in", _TRIED.format(found.cases, found.cases / 3.0)))
    if found.as_assumed:
        lines.append(("assumes", assumes(told, found.as_assumed)))
    if found.stiffness_N_m and best.values:
        lines.append(("no element", _ALONE.format(format_stiffness(found.alone_N_m)) if found.alone_N_m else _NO_WALL))
    broken = found.breaks
    breaks = f"{format_stiffness(broken[0])}: {describe(broken[1])}" if broken else _NOTHING_BREAKS
    if broken and not (told.breaks and told.breaks.run.verdict == "pushed"):
        breaks += _SHOWN_AT_END if told.breaks else _SHOWN_BY_NONE
    lines.append(("breaks first", breaks))
    if not told.unchanged.limit.stiffness_N_m:
        return [*lines, ("gains most", _from_none(told)), *_known(told)]
    gains = [_times(told, row) for row in told.changed if row.factor >= _TELLS]
    of = "" if found.stiffness_N_m else _IN_CORNERS.format(format_limit(told.unchanged.limit))
    lines.append(("gains most", of + ("; ".join(gains[:3]) or _NO_CHANGE + _TUNED * bool(best.values))))
    of_alone = [row for row in told.changed if row.alone_factor >= _TELLS > row.factor]
    if best.values and of_alone:
        of_alone.sort(key=lambda row: -row.alone_factor)
        some = [_TIMES.format(row.words, fixed(row.alone_factor, 2)) for row in of_alone[:3]]
        lines.append(("without one", _GAINS_ALONE.format("; ".join(some))))
    worst = sorted((*told.changed, *told.without), key=lambda row: row.factor)
    loses = [_times(told, row) for row in worst if row.factor * _TELLS <= 1.0]
    return [*lines, ("loses most", of + ("; ".join(loses[:3]) or _NO_LOSS)), *_known(told)]


def _from_none(told: Advice) -> str:
    """Describes which changes make a wall possible where there is none without."""
    stiffest = sorted((*told.changed, *told.without), key=lambda row: -row.limit.stiffness_N_m)
    return (
        "; ".join(f"{row.words}: {format_limit(row.limit)}" for row in stiffest[:3] if row.limit.stiffness_N_m)
        or _NONE_MAKES
    )


def _known(told: Advice) -> list[tuple[str, str]]:
    """Returns the lines on published values and on the scene's own wall."""
    lines = list[tuple[str, str]]()
    if told.published:
        values = [f"{format_stiffness(value.stiffness_N_m)} ({value.by})" for value in told.published]
        lines.append(("published", ", ".join(values)))
    if told.own:
        own, failure = told.own
        does = f"buzzes: {describe(failure)}" if failure else "withstands every case"
        lines.append(("its own wall", f"{format_stiffness(own)} {does}"))
    return lines


def _times(told: Advice, row: Changed) -> str:
    words = _TIMES.format(row.words, fixed(row.factor, 2))
    if not told.found.advised.values or not told.unchanged.alone.stiffness_N_m:
        return words
    return words + _TIMES_ALONE.format(fixed(row.alone_factor, 2))


def assumes(told: Advice, right: Best) -> str:
    """Describes what is assumed, and how stiff a wall would be if that were right."""
    it, them = ("it", "it") if len(told.assumed) == 1 else ("they", "each")
    of, half, double = min(told.assumed, key=lambda row: min(row[1].stiffness_N_m, row[2].stiffness_N_m))
    measure = _MEASURE.format(of.key)
    if not right.safe or right.safe.stiffness_N_m <= WORTH * told.found.stiffness_N_m:
        costs = _SAME.format(it)
    else:
        phrase = right.family.phrase(right.values)
        costs = _COSTS.format(
            it, format_limit(right.safe), phrase, measure if moves(half, double, told.unchanged.limit) else ""
        )
    return _ASSUMED.format(", ".join(of.key for of, _, _ in told.assumed), them, costs).strip()


def sentences(told: Advice) -> list[str]:
    """Returns headline and answer as lines of text."""
    return [told.headline, *(f"{name}: {words.rstrip('.')}." for name, words in answer(told))]


def describe_count(told: Advice) -> tuple[str, float]:
    """Describes by how much the forces of the advised scene jump where a count is crossed; "" without an encoder.

    Returns also how many times what a hand feels a vibration of that force would be.
    """
    if not told.scene or not (of := one_count(told.scene, installed_kinds())):
        return "", 0.0
    kick_N = sum(of.elements_N)
    times = of.total_N / float(felt_force_N(told.scene)(np.array([_BEST_FELT_HZ]))[0])
    words = _STEP.format(amount(of.wall_N, "N")) + (
        _KICK.format(amount(kick_N, "N"), amount(of.total_N, "N")) if kick_N else ""
    )
    return words + _GRIT.format(_BEST_FELT_HZ, fixed(times, 2)), times


def describe_run(provisos: Sequence[str]) -> str:
    """Describes the provisos in the verdict of a run of the advised scene."""
    told = [proviso for proviso in provisos if proviso != _SOME_HOLDS]
    adds = _ADDS.format(", ".join(told)) if told else ""
    return "; ".join(filter(None, [adds, _PUSHED if _SOME_HOLDS in provisos else ""]))


def describe_hand(told: Advice) -> str:
    """Describes the hand that the wall was tried with, with its grip."""
    if not told.hand:
        return _NO_HAND
    mass, damping, stiffness = map(fixed, told.hand)
    grip = _GRIP.format(*map(fixed, told.grip)) if told.grip else ""
    return _HAND.format(mass, damping, stiffness, grip)


def describe(failure: Failure) -> str:
    """Describes what a wall does in the case that it does not bear."""
    if failure.gone:
        return f"the device leaves its limits; {failure.case}"
    if failure.motion_m and not failure.frequency_Hz:
        return _SLOWLY.format(width=amount(failure.motion_m, "m", 2), at_s=failure.at_s, case=failure.case)
    if not failure.frequency_Hz:
        return failure.case
    felt = _FELT[failure.by_force] if failure.other_felt < 1.0 else _FELT_BOTH
    swing = f"{amount(failure.force_N, 'N', 2)} commanded and {amount(failure.motion_m, 'm', 2)} peak to peak"
    words = _AT if failure.is_line else _TURNS
    when = words.format(hz=failure.frequency_Hz, turns=failure.turns, within=failure.within_s)
    return f"{swing} {when}, felt as {felt}; {failure.case}"


def moves(half: Limit, double: Limit, nominal: Limit) -> bool:
    """Tells whether halving or doubling an assumed number moves the limit by more than its tolerance."""
    ends = [limit.stiffness_N_m for limit in (half, double)]
    return min(ends) * _TELLS < nominal.stiffness_N_m or max(ends) > _TELLS * nominal.stiffness_N_m


def _elements(told: Advice) -> Table:
    heads = f"as described\nto {ROUGH * 100:.0f} %", f"every corner\nto {CLOSE * 100:.0f} %", "attacked"
    table = make_table("element", "parameter", *heads, numbers=heads)
    for best in told.found.bests:
        is_advised = best is told.found.advised
        safe = format_limit(best.safe) if best.safe else "–"
        row = (best.family.name, best.family.words(best.values), format_limit(best.nominal) + _island(best), safe)
        table.add_row(*row, format_attacked(told, best), style="bold" if is_advised else "")
    return table


def format_attacked(told: Advice, best: Best) -> str:
    """Formats the wall that withstood the attack with an element, or that did not; a dash if none was attacked."""
    if not (found := told.found.attacked(best)):
        return "–"
    stiffness_N_m, withstood = found
    return ("" if withstood else "below ") + (format_stiffness(stiffness_N_m) if stiffness_N_m else "none")


def _island(best: Best) -> str:
    return "*" if best.nominal.borne_above_N_m else ""


def _limits(told: Advice) -> Table:
    table = make_table("limit or published value", "with", "wall", numbers=("wall",))
    for row in told.formulas:
        value = format_stiffness(row.stiffness_N_m)
        table.add_row(f"{row.formula}\n{row.source}", f"{row.numbers}; beyond, it {row.means}", value)
    for value in told.published:
        table.add_row(value.by, value.source, format_stiffness(value.stiffness_N_m))
    return table


def _changes(told: Advice) -> Table:
    """Makes a row per change: with the element tuned again, and without one; the latter alone if none is advised."""
    has_element = bool(told.found.advised.values)
    close = f"to {CLOSE * 100:.0f} %"
    heads = (
        (f"element tuned\nagain, {close}", "times\n", f"no element,\n{close}", " times\n")
        if has_element
        else (close, "times")
    )
    table = make_table("one change, or an ideal", *heads, numbers=heads)
    for row in (told.unchanged, *told.changed, *told.without):
        style = "bold" if max(row.factor, row.alone_factor) >= _TELLS else ""
        base = told.unchanged
        times = [_factor(row.factor, base.limit), _factor(row.alone_factor, base.alone)]
        numbers = (format_limit(row.limit), times[0], format_limit(row.alone), times[1])
        table.add_row(row.words, *numbers[: len(heads)], style=style)
    return table


def _factor(factor: float, base: Limit) -> str:
    """Formats a multiple of a limit; "same" for 1, a dash where no wall is borne that it could multiply."""
    if not base.stiffness_N_m:
        return "–"
    return "same" if factor == 1.0 else fixed(factor, 2)


def _assumed(told: Advice) -> Table:
    heads = f"halved\nto {CLOSE * 100:.0f} %", f"doubled\nto {CLOSE * 100:.0f} %"
    table = make_table("assumed about the device", "why", *heads, numbers=heads)
    for of, half, double in told.assumed:
        table.add_row(of.key, of.words, format_limit(half), format_limit(double))
    return table


def format_limit(limit: Limit) -> str:
    """Formats a limit to two digits: ``over ...`` if no wall was found that fails.

    It is ``below ...`` if no wall that was tried is soft enough to bear all cases, and ``none`` if no wall at all is.
    """
    if not limit.stiffness_N_m:
        return f"below {format_stiffness(limit.fails_N_m, 2)}" if limit.fails_N_m > LEAST_N_M else "none"
    over = "over " if not math.isfinite(limit.fails_N_m) else ""
    return over + format_stiffness(limit.stiffness_N_m, 2)
