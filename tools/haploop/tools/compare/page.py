"""Comparisons as docs/comparison.md with its figure: ``make comparison``."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path

from haploop.tools.advise.families import (
    ADAPTIVE_BOTH,
    ADAPTIVE_DAMPING,
    ADAPTIVE_INERTIA,
    BIDIRECTIONAL,
    DAMPING,
    NOTHING,
    UNIDIRECTIONAL,
    Family,
)
from haploop.tools.advise.report import format_stiffness
from haploop.tools.cli.options import WRONG_USE, leave
from haploop.tools.compare.command import COMPARISON
from haploop.tools.compare.comparison import Comparison, OfLoop, as_comparison
from haploop.tools.compare.figure import figure_of
from haploop.tools.compare.ranking import best, held, ranking
from haploop.tools.compare.report import READING, again_sentence, cells, join, most_sentence, task_sentence
from haploop.tools.figure.data import FigureError
from haploop.tools.figure.style import write_figure
from haploop.tools.render.terminal import markdown_table

PAGE, FIGURE = "comparison.md", "comparison.png"
_INTRO = """\
Every stabilizer that comes with haploop, each tuned by the same search with the same effort on the same task, then
tried under seeds that the search has not seen. Written by `make comparison`; `haploop compare DEVICE` does the same
for a device or a scene of yours, also with more delay, a finer encoder and a slower drive. Two are *ranked* where the
95 % interval of their difference, seed by seed under the same conditions, does not hold 0, the same way under two sets
of seeds that share nothing, tuning included; all else cannot be told apart. Every loop is named by its device and its
round-trip delay: a device without a cable is taken as rigid, and without a delay would bear walls that no device
renders. *Held* may be more than the wall where counts of the encoder are coarse: it reads deeper than the device is."""
_MOST = "Most is rendered {0}."
_TAKE = "Take the simplest of those that cannot be told from the best: {0}."
_WHERE = {"more": "renders more on {0}", "less": "renders less on {0}", "alike": "cannot be told from it on {0}"}
_EVERYWHERE = {"more": "each of these loops", "less": "each of these loops", "alike": "any of these loops"}
_HELPS, _MIXED = "adaptive inertia helps there", "adaptive inertia is no remedy"
_NOT = "adaptive inertia does not help, as far as can be told"
_HEADS = ("element", "parameter", "wall", "held", "contact", "ripple", "extra", "±20 %", "device ±20 %", "breaks first")
_STIFFNESSES = ("wall", "held", "contact")
_LIMITS = """\
Seeds draw holds, sways, taps, device, hand and delay; they do not draw another friction, another hand or another task,
and numbers that the device files assume are taken as they are. Parameters are tuned for what is held, not for the
ripple. A virtual coupling holds less than its wall; force bounding counts on the damping that the device declares, and
where that is 0 it lets no force pass. What is told as at the end of a search may be more with other parameters."""


def sentences(comparisons: Sequence[Comparison]) -> list[str]:
    """Returns the five sentences; each name of a loop in them is put there by a condition on its rankings."""
    loops = repeated(comparisons)
    helps = [_compared(ADAPTIVE_BOTH, ADAPTIVE_DAMPING, loops), _compared(ADAPTIVE_INERTIA, NOTHING, loops)]
    more, less = (any(each[place] for each in helps) for place in ("more", "less"))
    verdict = (_MIXED if less else _HELPS) if more else _NOT
    others = (NOTHING, DAMPING, BIDIRECTIONAL)
    stands = ". ".join(versus(UNIDIRECTIONAL, other, loops) for other in others)
    return [
        _MOST.format("; ".join(f"on {name}: {_first(of)}" for name, of in loops.items())),
        _TAKE.format("; ".join(f"on {name} {simplest(of)}" for name, of in loops.items())),
        f"{versus(DAMPING, NOTHING, loops)}.",
        f"{stands}.",
        f"{versus(ADAPTIVE_BOTH, ADAPTIVE_DAMPING, loops)}. {versus(ADAPTIVE_INERTIA, NOTHING, loops)}: {verdict}.",
    ]


def repeated(comparisons: Sequence[Comparison]) -> dict[str, OfLoop]:
    """Returns the loops that were tried under both sets of seeds, by device and round-trip delay."""
    return {f"{told.name} at {of.delay_s * 1e3:g} ms": of for told in comparisons for of in told.loops if of.again}


def simplest(of: OfLoop) -> str:
    """Returns the first in the list of stabilizers of those that cannot be told from the best."""
    found, tied = best(of)
    return next(row.family for row in of.rows if row is found or row in tied)


def versus(some: Family, other: Family, loops: dict[str, OfLoop]) -> str:
    """Says where some family renders more than another, where less, and where it cannot be told from it."""
    where = _compared(some, other, loops)
    places = {word: _EVERYWHERE[word] if len(names) == len(loops) else join(names) for word, names in where.items()}
    told = "; it ".join(_WHERE[word].format(place) for word, place in places.items() if where[word])
    return f"{_capital(some.name)} against {other.name}: it {told}"


def _compared(some: Family, other: Family, loops: dict[str, OfLoop]) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {"more": [], "less": [], "alike": []}
    for name, of in loops.items():
        found[ranking(of).versus(some.name, other.name)].append(name)
    return found


def _first(of: OfLoop) -> str:
    found, tied = best(of)
    without = next(row for row in of.rows if row.family == NOTHING.name)
    if without is found or without in tied:
        return f"no element holds more than none, {format_stiffness(held(without).value)}, as far as can be told"
    alike = f", not told from {join([row.family for row in tied])}" if tied else ", more than every other"
    return f"{found.family}, {format_stiffness(held(found).value)}{alike}"


def _capital(words: str) -> str:
    return words[:1].upper() + words[1:]


def page(comparisons: Sequence[Comparison]) -> str:
    """Returns the page in Markdown."""
    lines = [f"{place}. {words}" for place, words in enumerate(sentences(comparisons), 1)]
    parts = ["# Stabilizers compared", _INTRO, "## In five sentences", "\n".join(lines)]
    parts += [f"![What every stabilizer holds, with intervals, and the force it adds]({FIGURE})"]
    parts += [f"{READING} {task_sentence(comparisons[0])}"]
    for told in comparisons:
        parts += [f"## {told.name}", " ".join(told.notes)]
        for of in told.loops:
            if of.again:
                heads = [f"{name}, N/mm" if name in _STIFFNESSES else name for name in _HEADS]
                rows = [[cells(row)[name] for name in _HEADS] for row in of.rows]
                parts += [f"### {of.name}, round trip {of.delay_s * 1e3:g} ms", most_sentence(of), again_sentence(of)]
                parts += [markdown_table(heads, rows, range(2, 5))]
        others = [of for of in told.loops if not of.again]
        if others:
            rows = [[some[0].family, *(cells(row)["held"] for row in some)]
                    for some in zip(*(of.rows for of in others), strict=True)]  # fmt: skip
            parts += ["Held on like loops, N/mm, under one set of seeds and not ranked:"]
            parts += [markdown_table(["element", *(of.name for of in others)], rows)]
    return "\n\n".join(filter(None, [*parts, "## What it does not say", _LIMITS])) + "\n"


def write(directory: Path, docs: Path) -> Path:
    """Writes page and figure from the comparisons below a directory into ``docs``; returns the page's file.

    Raises FigureError without matplotlib, OSError or ValueError for a comparison that cannot be read.
    """
    files = sorted(directory.glob(f"*/{COMPARISON}"))
    comparisons = [as_comparison(json.loads(file.read_text(encoding="utf-8"))) for file in files]
    comparisons.sort(key=lambda told: told.loops[0].delay_s)
    if not comparisons:
        raise ValueError(f"{directory} has no {COMPARISON} in any directory below it; run haploop compare first.")
    write_figure(figure_of(comparisons), docs / FIGURE)
    (docs / PAGE).write_text(page(comparisons), encoding="utf-8")
    return docs / PAGE


if __name__ == "__main__":
    try:
        print(write(Path(sys.argv[1]), Path(sys.argv[2])))
    except (OSError, ValueError, FigureError) as error:
        leave(str(error), WRONG_USE)
