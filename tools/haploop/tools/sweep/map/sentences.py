"""The sentences of a map: the sweep, the counts of verdicts, the answer, and what went wrong."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from textwrap import shorten

import numpy as np

from haploop.tools.render.units import spring
from haploop.tools.sweep.map.axis import Axis, short
from haploop.tools.sweep.map.data import NOT_RUN, STIFFNESS, WIDTH, Cells, Layout, MapData, Verdict
from haploop.tools.sweep.map.edges import Answer, Edges, State, stiffest_steady
from haploop.tools.sweep.map.lines import PanelLines
from haploop.tools.sweep.table import PROVISOS

# Letters that fit into the line below the title; the base scene's title is cut before anything else is.
_BETWEEN, _LETTERS, _LEAST_LETTERS = "   ·   ", 185, 12
_REASON_LETTERS = 160
# For pushed runs, and for those of which only the window was looked at.
_NONE = (
    "No wall is steady, counting from the softest one tried.",
    "There is no wall, counting from the softest one tried, on which no swing was seen.",
)
_STIFFEST = (
    ("Stiffest steady wall", "Every softer wall tried there is steady, too."),
    ("Stiffest wall on which no swing was seen", "None was seen on any softer wall tried there, either."),
)
_ONE_HOLD = "Every run has the hand and the hold of its scene; haploop advise tries others."
_UNPUSHED = "No run was pushed: the words describe its last half second, and say little about stability."


def description(data: MapData, cells: Cells) -> str:
    """Returns one line: the base scene, what was swept, the seeds, and how many cells came to which verdict."""
    words = [f"{count} {data.word(number)}" for number, count in cells.count().items()]
    if missing := int((cells.verdict == NOT_RUN).sum()):
        words.append(f"{missing} not run yet")
    counted = f"{cells.verdict.size} cells: " if cells.verdict.size > 1 else ""
    return _about(data, counted + ", ".join(words))


def edge_description(data: MapData, edges: Edges) -> str:
    """Returns one line: the base scene, what was swept and bisected, the seeds, and what was found."""
    words = {
        State.FOUND: "found",
        State.ALL_HOLD: f"{edges.holds} throughout",
        State.NONE_HOLDS: f"not {edges.holds} at {edges.begin}",
        State.UNKNOWN: "unknown",
    }
    counts = Counter(edges.state.ravel().tolist())
    return _about(data, "boundaries: " + ", ".join(f"{counts[s]} {word}" for s, word in words.items() if counts[s]))


def _about(data: MapData, came: str) -> str:
    swept = " × ".join(f"{axis.key} {_span(axis)}" for axis in data.axes)
    seeds = f"{len(data.seeds)} seeds" if len(data.seeds) > 1 else f"seed {data.seeds[0]}" if data.seeds else ""
    rest = _BETWEEN.join(part for part in (swept, seeds, came) if part)
    base = shorten(data.base, max(_LEAST_LETTERS, _LETTERS - len(rest)), placeholder="…")
    return f"from “{base}”{_BETWEEN}{rest}"


def _span(axis: Axis) -> str:
    """Returns first and last value and how many: ``"500–8000 N/m (16)"``."""
    if axis.names:
        return f"({len(axis.names)})"
    if len(axis.planned) == 1:
        return axis.word(0)
    factor, unit = axis.factor_and_unit
    first, last = (short(value / factor) for value in axis.planned[[0, -1]])
    return f"{first}–{last} {unit}".rstrip() + f" ({len(axis.planned)})"


def _answer(data: MapData, cells: Cells) -> str:
    axes, found = data.axes, stiffest_steady(data.axes, cells)
    if not any(axis.key == STIFFNESS for axis in axes):
        return ""
    if found is None:
        return _NONE[data.is_unpushed]
    others = _place(pair for pair in zip(axes, found.index, strict=True) if pair[0].key != STIFFNESS)
    stiffest, softer = _STIFFEST[data.is_unpushed]
    more = "No stiffer wall was tried." if found.open_end else softer
    told = data.provisos(int(cells.row[found.index]))
    on = f" Condition: {', '.join(told)}." if told else ""
    return f"★ {stiffest}: {spring(found.value)}{others}. {more}{on}"


def _provisos(data: MapData) -> str:
    """Returns how many steady runs rest on each proviso, or that this is not known."""
    if PROVISOS not in data.columns:
        is_missing = Verdict.STEADY in data.verdicts and not data.is_unpushed
        return "What the steady runs rest on was not recorded." if is_missing else ""
    counts = Counter(
        proviso for row in np.flatnonzero(data.verdicts == Verdict.STEADY).tolist() for proviso in data.provisos(row)
    )
    listed = ", ".join(f"{proviso} ({count})" for proviso, count in counts.most_common())
    return f"Conditions of the steady runs: {listed}." if listed else ""


def _place(at: Iterable[tuple[Axis, int]]) -> str:
    """Returns values of some axes: ``" at device.mass 0.1 kg"``; empty without any axis."""
    words = [f"{axis.key} {axis.word(index)}" for axis, index in at]
    return f" at {', '.join(words)}" if words else ""


def _failures(data: MapData) -> str:
    failed = np.flatnonzero(data.verdicts == Verdict.FAILED).tolist()
    if not failed:
        return ""
    whys = data.columns.get("why", [""] * len(data.columns["verdict"]))
    reasons = Counter(str(whys[row] or "no reason given") for row in failed)
    [(reason, count)] = reasons.most_common(1)
    share = f", {count} of them" if len(reasons) > 1 else ""
    return f"{len(failed)} failed{share}: {shorten(reason, _REASON_LETTERS, placeholder='…')}"


def map_notes(data: MapData, cells: Cells, layout: Layout, lines: Sequence[PanelLines]) -> list[str]:
    """Returns the notes beside a map, the answer first."""
    panels, reasons = layout.count(data.axes), _reasons(lines)
    outside = ", ".join(dict.fromkeys(line.name for panel in lines for line in panel.lines if not line.pieces))
    some = "" if all(panel.why_none for panel in lines) else " in some panels"
    where = "panel" if len(lines) == 1 else "panels that do not show them"
    return _those({
        _answer(data, cells): True,
        _provisos(data): True,
        _UNPUSHED: data.is_unpushed,
        _ONE_HOLD: Verdict.STEADY in data.verdicts,
        f"The first {len(lines)} of {panels} panels are drawn.": panels > len(lines),
        f"No exact limit{some}, since the loop is not linear: {reasons}.": reasons,
        f"Outside the {where}: {outside}.": outside,
        "The worst verdict of the seeds is shown; a number such as 2/5 (a dot in small cells) says how "
        "many came to it; the others came to milder ones.": (cells.agree < cells.seeds).any(),
        "Vertical lines reach down to the seed that swings least.": layout.y is None and len(data.seeds) > 1,
        "Limit cycles: the swing that lasts after a push; all else: at the end of its run.": layout.y is None
        and WIDTH in data.columns,
        "How far limit cycles swing was not recorded.": not data.has_amplitudes
        and Verdict.LIMIT_CYCLE in cells.verdict,
        _failures(data): True,
    })  # fmt: skip


def edge_notes(data: MapData, edges: Edges, best: Answer | None, lines: Sequence[PanelLines]) -> list[str]:
    """Returns the notes beside the boundaries of a search, of which these lines are drawn; the answer first."""
    reasons, holds = _reasons(lines), edges.holds
    rows = len(edges.others[1].values) if len(edges.others) > 1 else 1
    more = " (for the seed that gets least far; bars span all seeds)" if len(data.seeds) > 1 else ""
    return _those({
        f"★ Furthest: {best.words[0]}{_place(zip(edges.others, best.index, strict=True))}." if best else "": True,
        f"The first {len(lines)} of {rows} lines are drawn.": len(lines) < rows,
        f"Points are the last values that were seen to be {holds}{more}; vertical bars reach to the first that was "
        f"seen not to be, across undecided ones. Each boundary is the first change from {edges.begin} on.": True,
        f"{'▲' if edges.rising else '▼'} {holds} at every point that was tried.": State.ALL_HOLD in edges.state,
        f"× not {holds} where the search begins.": State.NONE_HOLDS in edges.state,
        "? a run failed before a boundary was found.": State.UNKNOWN in edges.state,
        f"{edges.more} of {len(data.boundary['low'])} searches changed more than once.": edges.more,
        _provisos(data): True,
        _UNPUSHED: data.is_unpushed,
        _ONE_HOLD: Verdict.STEADY in data.verdicts,
        f"No exact limit, since the loop is not linear: {reasons}.": reasons,
        _failures(data): True,
    })  # fmt: skip


def _those(notes: dict[str, object]) -> list[str]:
    """Returns the sentences that apply."""
    return [sentence for sentence, applies in notes.items() if applies and sentence]


def _reasons(lines: Iterable[PanelLines]) -> str:
    return ", ".join(dict.fromkeys(panel.why_none for panel in lines if panel.why_none))
