"""The words of a bisecting sweep's figure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from haploop.tools.sweep.map.boundary import ALL_HOLD, FOUND, NONE_HOLDS, UNKNOWN, Edges
from haploop.tools.sweep.map.data import MapData, short, with_prefix
from haploop.tools.sweep.map.draw.words import about, failures
from haploop.tools.sweep.map.lines.over import Over


@dataclass(frozen=True)
class Furthest:
    """The combination that holds furthest: its index, the boundary, and what to write beside it."""

    index: tuple[int, ...]
    value: float
    words: str


def furthest(edges: Edges) -> Furthest | None:
    """What holds furthest from where the search begins; None where no boundary was found and nothing holds."""
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
    """One line: the base scene, what was swept and bisected, the seeds, and what was found."""
    words = {
        FOUND: "found",
        ALL_HOLD: f"{edges.holds} throughout",
        NONE_HOLDS: f"not {edges.holds} at {edges.along.word(0 if edges.rising else -1)}",
        UNKNOWN: "unknown",
    }
    counts = {state: int((edges.state == state).sum()) for state in words}
    came = ", ".join(f"{count} {words[state]}" for state, count in counts.items() if count)
    return about(data, f"boundaries: {came}")


def edge_notes(data: MapData, edges: Edges, overs: Sequence[Over], lines: int) -> list[str]:
    """What there is to say; the answer first."""
    notes = []
    if best := furthest(edges):
        at = ", ".join(f"{axis.key} {axis.word(i)}" for axis, i in zip(edges.others, best.index, strict=True))
        notes.append(f"★ Furthest: {best.words} at {at}.")
    if len(edges.others) > 1 and lines < len(edges.others[1].values):
        notes.append(f"The first {lines} of {len(edges.others[1].values)} lines are drawn.")
    bars = "Upright bars are the brackets"
    seeds = f"; a point is the seed that is {edges.holds} least far, its bar covers all seeds" * (len(data.seeds) > 1)
    notes.append(
        f"{bars}{seeds}. Each boundary is the first change from {edges.along.word(0 if edges.rising else -1)} on."
    )
    if (edges.state == ALL_HOLD).any():
        notes.append(f"{'▲' if edges.rising else '▼'} {edges.holds} at every point that was tried.")
    if (edges.state == NONE_HOLDS).any():
        notes.append(f"× not {edges.holds} where the search begins.")
    if (edges.state == UNKNOWN).any():
        notes.append("? a run failed before a boundary was found.")
    if edges.more:
        notes.append(f"{edges.more} of {len(data.boundary['low'])} searches changed more than once.")
    reasons = list(dict.fromkeys(over.why_none for over in overs if over.why_none))
    notes += [f"No exact limit, since the loop is not linear: {', '.join(reasons)}."] if reasons else []
    return [note for note in [*notes, failures(data)] if note]


def _amount(edges: Edges, value: float) -> str:
    factor, unit = with_prefix([value], edges.along.unit)
    return f"{short(value / factor)} {unit}".strip()
