"""The sentences of a map: the sweep, the counts of verdicts, the answer, and what went wrong."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

import numpy as np

from haploop.tools.render.units import spring
from haploop.tools.sweep.map.data import (
    FAILED,
    LIMIT_CYCLE,
    NOT_RUN,
    STIFFNESS,
    VERDICTS,
    WIDTH,
    Axis,
    Cells,
    MapData,
    short,
    with_prefix,
)
from haploop.tools.sweep.map.edges import (
    ALL_HOLD,
    FOUND,
    NONE_HOLDS,
    UNKNOWN,
    Edges,
    StiffestSteady,
    furthest,
    stiffest_steady,
)
from haploop.tools.sweep.map.legend import verdict_words
from haploop.tools.sweep.map.lines import PanelLines
from haploop.tools.sweep.map.sheet import Layout

# What fits into the line below the title; the base scene's title is cut short before anything else is.
_BETWEEN, _LETTERS, _LEAST_LETTERS = "   ·   ", 185, 12
_REASON_LETTERS = 160


def description(data: MapData, cells: Cells) -> str:
    """Returns one line: the base scene, what was swept, the seeds, and how many cells came to which verdict."""
    words = [f"{count} {verdict_words(number)}" for number, count in count_verdicts(cells).items()]
    if missing := int((cells.verdict == NOT_RUN).sum()):
        words.append(f"{missing} not run yet")
    counted = f"{cells.verdict.size} cells: " if cells.verdict.size > 1 else ""
    return _about(data, counted + ", ".join(words))


def edge_description(data: MapData, edges: Edges) -> str:
    """Returns one line: the base scene, what was swept and bisected, the seeds, and what was found."""
    words = {
        FOUND: "found",
        ALL_HOLD: f"{edges.holds} throughout",
        NONE_HOLDS: f"not {edges.holds} at {edges.begin}",
        UNKNOWN: "unknown",
    }
    counts = {state: int((edges.state == state).sum()) for state in words}
    came = ", ".join(f"{count} {words[state]}" for state, count in counts.items() if count)
    return _about(data, f"boundaries: {came}")


def _about(data: MapData, came: str) -> str:
    swept = " × ".join(f"{axis.key} {_span(axis)}" for axis in data.axes)
    seeds = f"{len(data.seeds)} seeds" if len(data.seeds) > 1 else f"seed {data.seeds[0]}" if data.seeds else ""
    rest = _BETWEEN.join(part for part in (swept, seeds, came) if part)
    room = max(_LEAST_LETTERS, _LETTERS - len(rest))
    base = data.base if len(data.base) <= room else f"{data.base[: room - 1].rstrip()}…"
    return f"from “{base}”{_BETWEEN}{rest}"


def _span(axis: Axis) -> str:
    """Returns first and last value and how many: ``"500–8000 N/m (16)"``."""
    if axis.names:
        return f"({len(axis.names)})"
    values = axis.planned
    if len(values) == 1:
        return axis.word(0)
    factor, unit = with_prefix(values, axis.unit)
    return f"{short(values[0] / factor)}–{short(values[-1] / factor)} {unit}".rstrip() + f" ({len(values)})"


def count_verdicts(cells: Cells) -> dict[int, int]:
    """Counts the cells of each verdict that any came to, the mildest first."""
    counts = {number: int((cells.verdict == number).sum()) for number in range(len(VERDICTS))}
    return {number: count for number, count in counts.items() if count}


def star_words(found: StiffestSteady) -> tuple[str, ...]:
    """Returns the label of the stiffest steady wall, and a shorter one: ``"steady up to 300 N/m"``, ``"300 N/m"``."""
    words = spring(found.stiffness_N_m)
    if found.open_end:
        return f"steady up to {words} and perhaps beyond", f"≥ {words}"
    return f"steady up to {words}", words


def _answer(axes: Sequence[Axis], found: StiffestSteady | None) -> str:
    if not any(axis.key == STIFFNESS for axis in axes):
        return ""
    if found is None:
        return "No wall is steady from the softest one on that was tried."
    others = [f"{axis.key} {axis.word(i)}" for axis, i in zip(axes, found.index, strict=True) if axis.key != STIFFNESS]
    at = f" at {', '.join(others)}" if others else ""
    more = "No stiffer one was tried." if found.open_end else "Every softer one tried there is steady, too."
    return f"★ Stiffest steady wall: {spring(found.stiffness_N_m)}{at}. {more}"


def _failures(data: MapData) -> str:
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
    outside = ", ".join(dict.fromkeys(line.name for panel in lines for line in panel.lines if not line.pieces))
    some = "" if all(panel.why_none for panel in lines) else " in some panels"
    where = "panel" if len(lines) == 1 else "panels that do not show them"
    return _those(
        (True, _answer(data.axes, stiffest_steady(data.axes, cells))),
        (panels > len(lines), f"The first {len(lines)} of {panels} panels are drawn."),
        (reasons, f"No exact limit{some}, since the loop is not linear: {reasons}."),
        (outside, f"Outside the {where}: {outside}."),
        (
            (cells.agree < cells.seeds).any(),
            "The worst verdict of the seeds is shown; a number such as 2/5 (a dot in small cells): so many of them "
            "came to it, the others to milder ones.",
        ),
        (layout.y is None and len(data.seeds) > 1, "Upright lines reach down to the seed that swings least."),
        (
            layout.y is None and WIDTH in data.columns,
            "Limit cycles as they swing on after a push, all else at the end of its run.",
        ),
        (
            (cells.verdict == LIMIT_CYCLE).any() and not data.has_amplitudes,
            "How far limit cycles swing was not recorded.",
        ),
        (True, _failures(data)),
    )


def edge_notes(data: MapData, edges: Edges, lines: Sequence[PanelLines]) -> list[str]:
    """Returns the notes beside the boundaries of a search, of which these lines are drawn; the answer first."""
    best, reasons, holds = furthest(edges), _reasons(lines), edges.holds
    at = [f"{axis.key} {axis.word(i)}" for axis, i in zip(edges.others, best.index, strict=True)] if best else []
    rows = len(edges.others[1].values) if len(edges.others) > 1 else 1
    bars = "Upright bars are the brackets."
    if len(data.seeds) > 1:
        bars = (
            f"Upright bars are the brackets; a point is the seed that is {holds} least far, its bar covers all seeds."
        )
    return _those(
        (best, f"★ Furthest: {best.words if best else ''} at {', '.join(at)}."),
        (len(lines) < rows, f"The first {len(lines)} of {rows} lines are drawn."),
        (True, f"{bars} Each boundary is the first change from {edges.begin} on."),
        ((edges.state == ALL_HOLD).any(), f"{'▲' if edges.rising else '▼'} {holds} at every point that was tried."),
        ((edges.state == NONE_HOLDS).any(), f"× not {holds} where the search begins."),
        ((edges.state == UNKNOWN).any(), "? a run failed before a boundary was found."),
        (edges.more, f"{edges.more} of {len(data.boundary['low'])} searches changed more than once."),
        (reasons, f"No exact limit, since the loop is not linear: {reasons}."),
        (True, _failures(data)),
    )


def _those(*notes: tuple[object, str]) -> list[str]:
    return [sentence for applies, sentence in notes if applies and sentence]


def _reasons(lines: Iterable[PanelLines]) -> str:
    return ", ".join(dict.fromkeys(panel.why_none for panel in lines if panel.why_none))
