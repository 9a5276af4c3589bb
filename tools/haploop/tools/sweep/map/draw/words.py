"""The words of a map: what was swept, what came of it, and what a device builder takes from it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from haploop.tools.render.units import spring
from haploop.tools.sweep.map.answer import StiffestSteady
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
from haploop.tools.sweep.map.draw.look import words_of

# What fits into the line below the title; the base scene's title is cut short before anything else is.
_BETWEEN, _LETTERS, _LEAST_LETTERS = "   ·   ", 185, 12
_REASON_LETTERS = 160


def description(data: MapData, cells: Cells) -> str:
    """One line: the base scene, what was swept, the seeds, and how many cells came to which verdict."""
    return about(data, tally(cells))


def about(data: MapData, came: str) -> str:
    """One line: the base scene, what was swept, the seeds, and what came of it."""
    swept = " × ".join(f"{axis.key} {_span(axis)}" for axis in data.axes)
    seeds = f"{len(data.seeds)} seeds" if len(data.seeds) > 1 else f"seed {data.seeds[0]}" if data.seeds else ""
    rest = _BETWEEN.join(part for part in (swept, seeds, came) if part)
    room = max(_LEAST_LETTERS, _LETTERS - len(rest))
    base = data.base if len(data.base) <= room else f"{data.base[: room - 1].rstrip()}…"
    return f"from “{base}”{_BETWEEN}{rest}"


def tally(cells: Cells) -> str:
    """How many cells came to which verdict, and how many are still to come."""
    counts = counted(cells)
    missing = int((cells.verdict == NOT_RUN).sum())
    words = [f"{count} {words_of(number)}" for number, count in counts.items()]
    words += [f"{missing} not run yet"] if missing else []
    return f"{cells.verdict.size} cells: {', '.join(words)}" if cells.verdict.size > 1 else ", ".join(words)


def counted(cells: Cells) -> dict[int, int]:
    """How many cells came to each verdict that any came to, the mildest first."""
    counts = {number: int((cells.verdict == number).sum()) for number in range(len(VERDICTS))}
    return {number: count for number, count in counts.items() if count}


def _span(axis: Axis) -> str:
    """First and last value and how many: ``"500–8000 N/m (16)"``."""
    if axis.names:
        return f"({len(axis.names)})"
    values = axis.planned
    if len(values) == 1:
        return axis.word(0)
    factor, unit = with_prefix(values, axis.unit)
    return f"{short(values[0] / factor)}–{short(values[-1] / factor)} {unit}".rstrip() + f" ({len(values)})"


def star_words(axes: Sequence[Axis], found: StiffestSteady) -> tuple[str, ...]:
    """The label of the stiffest steady wall, and a shorter one: ``"steady up to 300 N/m"``, ``"300 N/m"``."""
    stiffness = next(axis.values[i] for axis, i in zip(axes, found.index, strict=True) if axis.key == STIFFNESS)
    words = spring(float(stiffness))
    if found.open_end:
        return f"steady up to {words} and perhaps beyond", f"≥ {words}"
    return f"steady up to {words}", words


def answer(axes: Sequence[Axis], found: StiffestSteady | None) -> str:
    """A sentence or two about the stiffest steady wall; empty where the wall was not swept."""
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
    """How many runs failed, and the commonest reason; empty if none did."""
    failed = np.flatnonzero(data.verdicts == FAILED)
    if not len(failed):
        return ""
    whys = data.columns.get("why", [""] * len(data.columns["verdict"]))
    reasons = Counter(str(whys[row] or "no reason given") for row in failed.tolist())
    [(reason, count)] = reasons.most_common(1)
    reason = reason if len(reason) <= _REASON_LETTERS else f"{reason[:_REASON_LETTERS].rstrip()}…"
    return f"{len(failed)} failed" + (f", {count} of them" if len(reasons) > 1 else "") + f": {reason}"


def unknown_amplitudes(data: MapData, cells: Cells) -> str:
    """Why limit cycles have one colour, where they have."""
    swinging = cells.verdict == LIMIT_CYCLE
    if not swinging.any() or (swinging & np.isfinite(cells.amplitude_m)).any():
        return ""
    return "How far limit cycles swing was not recorded." if not data.has_amplitudes else ""
