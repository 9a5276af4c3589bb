"""The sentences of a map: the sweep, the counts of verdicts, the answer, and what went wrong."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from haploop.tools.render.units import spring
from haploop.tools.sweep.map.data import (
    FAILED,
    LIMIT_CYCLE,
    NOT_RUN,
    STIFFNESS,
    VERDICTS,
    Axis,
    Cells,
    MapData,
    short,
    with_prefix,
)
from haploop.tools.sweep.map.edges import ALL_HOLD, FOUND, NONE_HOLDS, UNKNOWN, Edges, StiffestSteady, stiffest_steady
from haploop.tools.sweep.map.legend import verdict_words
from haploop.tools.sweep.map.lines import PanelLines
from haploop.tools.sweep.map.sheet import Layout

# What fits into the line below the title; the base scene's title is cut short before anything else is.
_BETWEEN, _LETTERS, _LEAST_LETTERS = "   ·   ", 185, 12
_REASON_LETTERS = 160

FEW_PANELS = "The first {shown} of {all} panels are drawn."
FEW_LINES = "The first {shown} of {all} lines are drawn."
NO_LIMIT = "No exact limit, since the loop is not linear: {reasons}."
NO_LIMIT_IN_SOME = "No exact limit in some panels, since the loop is not linear: {reasons}."
OUTSIDE = "Outside the panel: {names}."
OUTSIDE_SOME = "Outside the panels that do not show them: {names}."
WORST_SEED = (
    "The worst verdict of the seeds is shown; a number such as 2/5 (a dot in small cells): so many of them came to it, "
    "the others to milder ones."
)
LEAST_SWING = "Upright lines reach down to the seed that swings least."
UNKNOWN_SWINGS = "How far limit cycles swing was not recorded."
BRACKETS = "Upright bars are the brackets. Each boundary is the first change from {begin} on."
BRACKETS_OF_SEEDS = (
    "Upright bars are the brackets; a point is the seed that is {holds} least far, its bar covers all seeds. Each "
    "boundary is the first change from {begin} on."
)
HOLDS_UPWARDS = "▲ {holds} at every point that was tried."
HOLDS_DOWNWARDS = "▼ {holds} at every point that was tried."
HOLDS_NOWHERE = "× not {holds} where the search begins."
FAILED_BEFORE = "? a run failed before a boundary was found."
CHANGED_MORE = "{more} of {all} searches changed more than once."


def description(data: MapData, cells: Cells) -> str:
    """Returns one line: the base scene, what was swept, the seeds, and how many cells came to which verdict."""
    return about(data, describe_counts(cells))


def about(data: MapData, came: str) -> str:
    """Returns one line: the base scene, what was swept, the seeds, and what came of it."""
    swept = " × ".join(f"{axis.key} {_span(axis)}" for axis in data.axes)
    seeds = f"{len(data.seeds)} seeds" if len(data.seeds) > 1 else f"seed {data.seeds[0]}" if data.seeds else ""
    rest = _BETWEEN.join(part for part in (swept, seeds, came) if part)
    room = max(_LEAST_LETTERS, _LETTERS - len(rest))
    base = data.base if len(data.base) <= room else f"{data.base[: room - 1].rstrip()}…"
    return f"from “{base}”{_BETWEEN}{rest}"


def describe_counts(cells: Cells) -> str:
    """Returns how many cells came to which verdict, and how many are still to come."""
    counts = count_verdicts(cells)
    missing = int((cells.verdict == NOT_RUN).sum())
    words = [f"{count} {verdict_words(number)}" for number, count in counts.items()]
    words += [f"{missing} not run yet"] if missing else []
    return f"{cells.verdict.size} cells: {', '.join(words)}" if cells.verdict.size > 1 else ", ".join(words)


def count_verdicts(cells: Cells) -> dict[int, int]:
    """Counts the cells of each verdict that any came to, the mildest first."""
    counts = {number: int((cells.verdict == number).sum()) for number in range(len(VERDICTS))}
    return {number: count for number, count in counts.items() if count}


def _span(axis: Axis) -> str:
    """Returns first and last value and how many: ``"500–8000 N/m (16)"``."""
    if axis.names:
        return f"({len(axis.names)})"
    values = axis.planned
    if len(values) == 1:
        return axis.word(0)
    factor, unit = with_prefix(values, axis.unit)
    return f"{short(values[0] / factor)}–{short(values[-1] / factor)} {unit}".rstrip() + f" ({len(values)})"


def star_words(axes: Sequence[Axis], found: StiffestSteady) -> tuple[str, ...]:
    """Returns the label of the stiffest steady wall, and a shorter one: ``"steady up to 300 N/m"``, ``"300 N/m"``."""
    stiffness = next(axis.values[i] for axis, i in zip(axes, found.index, strict=True) if axis.key == STIFFNESS)
    words = spring(float(stiffness))
    if found.open_end:
        return f"steady up to {words} and perhaps beyond", f"≥ {words}"
    return f"steady up to {words}", words


def answer(axes: Sequence[Axis], found: StiffestSteady | None) -> str:
    """Returns a sentence or two about the stiffest steady wall; empty where the wall was not swept."""
    if not any(axis.key == STIFFNESS for axis in axes):
        return ""
    if found is None:
        return "No wall is steady from the softest one on that was tried."
    others = [f"{axis.key} {axis.word(i)}" for axis, i in zip(axes, found.index, strict=True) if axis.key != STIFFNESS]
    at = f" at {', '.join(others)}" if others else ""
    stiffness = next(axis.values[i] for axis, i in zip(axes, found.index, strict=True) if axis.key == STIFFNESS)
    more = "No stiffer one was tried." if found.open_end else "Every softer one tried there is steady, too."
    return f"★ Stiffest steady wall: {spring(float(stiffness))}{at}. {more}"


def failures(data: MapData) -> str:
    """Returns how many runs failed, and the commonest reason; empty if none did."""
    failed = np.flatnonzero(data.verdicts == FAILED)
    if not len(failed):
        return ""
    whys = data.columns.get("why", [""] * len(data.columns["verdict"]))
    reasons = Counter(str(whys[row] or "no reason given") for row in failed.tolist())
    [(reason, count)] = reasons.most_common(1)
    reason = reason if len(reason) <= _REASON_LETTERS else f"{reason[:_REASON_LETTERS].rstrip()}…"
    return f"{len(failed)} failed" + (f", {count} of them" if len(reasons) > 1 else "") + f": {reason}"


def map_notes(data: MapData, cells: Cells, layout: Layout, lines: Sequence[PanelLines]) -> list[str]:
    """Returns the notes beside a map, the answer first."""
    panels, reasons = layout.count(data.axes), _reasons(lines)
    outside = list(dict.fromkeys(line.name for panel in lines for line in panel.lines if not line.pieces))
    swinging = cells.verdict == LIMIT_CYCLE
    every, one = all(panel.why_none for panel in lines), len(lines) == 1
    notes = [
        (True, answer(data.axes, stiffest_steady(data.axes, cells))),
        (panels > len(lines), FEW_PANELS.format(shown=len(lines), all=panels)),
        (reasons, (NO_LIMIT if every else NO_LIMIT_IN_SOME).format(reasons=reasons)),
        (outside, (OUTSIDE if one else OUTSIDE_SOME).format(names=", ".join(outside))),
        ((cells.agree < cells.seeds).any(), WORST_SEED),
        (layout.y is None and len(data.seeds) > 1, LEAST_SWING),
        (swinging.any() and not data.has_amplitudes, UNKNOWN_SWINGS),
        (True, failures(data)),
    ]
    return [sentence for applies, sentence in notes if applies and sentence]


def _reasons(lines: Sequence[PanelLines]) -> str:
    return ", ".join(dict.fromkeys(panel.why_none for panel in lines if panel.why_none))


@dataclass(frozen=True)
class Furthest:
    """The combination that holds furthest: its index, the boundary, and what to write beside it."""

    index: tuple[int, ...]
    value: float
    words: str


def furthest(edges: Edges) -> Furthest | None:
    """Finds what holds furthest from where the search begins; None where no boundary was found and nothing holds."""
    found = edges.state == FOUND
    if (throughout := np.argwhere(edges.state == ALL_HOLD)).size:
        end = -1 if edges.rising else 0
        words = f"{edges.holds} up to {edges.along.word(end)} and perhaps beyond"
        middle = tuple(int(i) for i in throughout[len(throughout) // 2])
        return Furthest(middle, float(edges.along.values[end]), words)
    if not found.any():
        return None
    far = np.where(found, edges.nearest if edges.rising else -edges.nearest, -np.inf)
    index = tuple(int(i) for i in np.unravel_index(int(far.argmax()), far.shape))
    value = float(edges.nearest[index])
    return Furthest(index, value, f"{edges.holds} up to {_amount(edges, value)}")


def edge_description(data: MapData, edges: Edges) -> str:
    """Returns one line: the base scene, what was swept and bisected, the seeds, and what was found."""
    words = {
        FOUND: "found",
        ALL_HOLD: f"{edges.holds} throughout",
        NONE_HOLDS: f"not {edges.holds} at {edges.along.word(0 if edges.rising else -1)}",
        UNKNOWN: "unknown",
    }
    counts = {state: int((edges.state == state).sum()) for state in words}
    came = ", ".join(f"{count} {words[state]}" for state, count in counts.items() if count)
    return about(data, f"boundaries: {came}")


def edge_notes(data: MapData, edges: Edges, lines: Sequence[PanelLines]) -> list[str]:
    """Returns the notes beside the boundaries of a search, of which these lines are drawn; the answer first."""
    best, reasons, several = furthest(edges), _reasons(lines), len(data.seeds) > 1
    at = [f"{axis.key} {axis.word(i)}" for axis, i in zip(edges.others, best.index, strict=True)] if best else []
    rows = len(edges.others[1].values) if len(edges.others) > 1 else 1
    begin = edges.along.word(0 if edges.rising else -1)
    notes = [
        (best, f"★ Furthest: {best.words if best else ''} at {', '.join(at)}."),
        (len(lines) < rows, FEW_LINES.format(shown=len(lines), all=rows)),
        (True, (BRACKETS_OF_SEEDS if several else BRACKETS).format(holds=edges.holds, begin=begin)),
        (
            (edges.state == ALL_HOLD).any(),
            (HOLDS_UPWARDS if edges.rising else HOLDS_DOWNWARDS).format(holds=edges.holds),
        ),
        ((edges.state == NONE_HOLDS).any(), HOLDS_NOWHERE.format(holds=edges.holds)),
        ((edges.state == UNKNOWN).any(), FAILED_BEFORE),
        (edges.more, CHANGED_MORE.format(more=edges.more, all=len(data.boundary["low"]))),
        (reasons, NO_LIMIT.format(reasons=reasons)),
        (True, failures(data)),
    ]
    return [sentence for applies, sentence in notes if applies and sentence]


def _amount(edges: Edges, value: float) -> str:
    factor, unit = with_prefix([value], edges.along.unit)
    return f"{short(value / factor)} {unit}".strip()
