"""Comparisons as docs/comparison.md with its figure: ``make comparison``."""

from __future__ import annotations

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
from haploop.tools.advise.subject import make_subject
from haploop.tools.command.given import kinds_with
from haploop.tools.command.options import FAILED, WRONG_USE, leave
from haploop.tools.compare.command import ROWS, find
from haploop.tools.compare.comparison import Comparison, OfLoop
from haploop.tools.compare.figure import figure_of
from haploop.tools.compare.ranking import best, choice, held, ranking, without
from haploop.tools.compare.report import (
    READING,
    again_sentence,
    cells,
    join,
    loops_rows,
    most_sentence,
    task_sentence,
)
from haploop.tools.figure.data import FigureError
from haploop.tools.figure.style import write_figure
from haploop.tools.render.terminal import markdown_table
from haploop.tools.render.units import format_stiffness

PAGE, FIGURE = "comparison.md", "comparison.png"
# Devices with their round trip.
DEVICES = {"premium15_cable": None, "touch": "1 ms", "omega3": "1 ms"}
_INTRO = """\
Every stabilizer that comes with haploop, each tuned by the same search with the same effort on the same task, then
tried under seeds that the search has not seen. Written by `make comparison`; `haploop compare DEVICE` does the same
for a device or a scene of yours. One is said to hold *more* than another if their difference, seed by seed under the
same conditions, is more than three of its standard errors, in the same direction under two sets of seeds that share
nothing, tuning included; otherwise the two cannot be told apart. A device file without a cable is taken as rigid.
Without a delay, such a device would withstand walls that no device renders, so here it has a round trip of 1 ms."""
_HELPS = "so adaptive inertia helps, but nowhere more than every other element"
_BEST = "so adaptive inertia helps, and on {0} it is what to take"
_MIXED = "so adaptive inertia helps on some loops and harms on others"
_HARMS, _NOT = (
    "so adaptive inertia does not help, and does harm",
    "so adaptive inertia does not help, as far as can be told",
)
_HEADS = {
    "element": "element", "parameter": "parameter", "wall": "wall set, N/mm", "held": "wall held, N/mm",
    "more": "more than none, N/mm", "contact": "contact, N/mm", "ripple": "ripple", "extra": "extra", "±20 %": "±20 %",
    "device ±20 %": "device ±20 %", "breaks first": "breaks first",
}  # fmt: skip
_BESIDE = """\
On similar loops: what is held without any element, and how much more with each, N/mm. Parameters are searched
only around those above: {around} with {tuning} seeds, the best {finalists} and those above with {last}; tried with
{seeds}."""
_LIMITS = """\
Seeds draw holds, sways, taps, device, hand and delay; they do not draw another friction, another hand or another task,
and numbers that the device files assume are taken as given. Parameters are tuned for what is held, not for the ripple.
A virtual coupling holds less than its wall. What is marked as at the end of a search may hold more with other
parameters."""

# What inertia adds: to a passivity controller, and by itself.
_ADAPTIVE = ((ADAPTIVE_BOTH, ADAPTIVE_DAMPING), (ADAPTIVE_INERTIA, NOTHING))
# A loop by the names of its device and of itself.
Place = tuple[str, str]
Loops = dict[Place, OfLoop]


def sentences(comparisons: Sequence[Comparison]) -> list[str]:
    """Returns five sentences, their parts divided by semicolons; each names the loops to which it applies."""
    loops = {(told.name, of.name): of for told in comparisons for of in told.loops}
    taken: dict[str, list[Place]] = {}
    for place, of in loops.items():
        taken.setdefault(choice(of).family, []).append(place)
    take = "; ".join(f"{family} on {places(of, loops)}" for family, of in taken.items())
    inertia = "; ".join(versus(UNIDIRECTIONAL, other, loops) for other in (NOTHING, DAMPING, BIDIRECTIONAL))
    adaptive = "; ".join(versus(*pair, loops) for pair in _ADAPTIVE)
    return [
        "What holds most in the loop as described: "
        f"{'; '.join(_most(told.name, told.loops[0]) for told in comparisons)}.",
        f"Take the first in the list that is shown to hold more than no element and not shown to hold less than "
        f"any other, or nothing if there is none: {take}.",
        _sentence(versus(DAMPING, NOTHING, loops)),
        _sentence(inertia),
        _sentence(f"{adaptive}; {_verdict(loops)}"),
    ]


def versus(some: Family, other: Family, loops: Loops) -> str:
    """Says on how many loops of each device some family holds more than another, and on how many less."""
    where, than = _compared(some, other, loops), "no element" if other is NOTHING else other.name
    told = [f"{word} {_counted(where[word], loops)}" for word in ("more", "less") if where[word]]
    if not told:
        return f"{some.name} cannot be told apart from {than} on any of these loops"
    elsewhere = ", and cannot be told apart from it elsewhere" * bool(where["alike"])
    return f"{some.name} holds {', '.join(told)} than {than}{elsewhere}"


def places(of: Sequence[Place], loops: Loops) -> str:
    """Names loops by device: ``every loop of touch``, or ``touch (as described, drive of 100 Hz)``."""
    words = []
    for device, (named, every) in _by_device(of, loops).items():
        whole = f"every loop of {device}" if len(every) > 1 else device
        words.append(whole if len(named) == len(every) else f"{device} ({', '.join(named)})")
    return join(words)


def _counted(of: Sequence[Place], loops: Loops) -> str:
    """Counts loops by device: ``on touch (4 of 4) and omega3 (1 of 4)``."""
    each = _by_device(of, loops).items()
    return f"on {join([f'{device} ({len(named)} of {len(every)})' for device, (named, every) in each])}"


def _by_device(of: Sequence[Place], loops: Loops) -> dict[str, tuple[list[str], list[str]]]:
    """Returns, for every device that has any of these loops, the names of these and of all its loops."""
    return {
        device: ([name for on, name in of if on == device], [name for on, name in loops if on == device])
        for device in dict.fromkeys(device for device, _ in of)
    }


def _compared(some: Family, other: Family, loops: Loops) -> dict[str, list[Place]]:
    found: dict[str, list[Place]] = {"more": [], "less": [], "alike": []}
    for place, of in loops.items():
        found[ranking(of).versus(some.name, other.name)].append(place)
    return found


def _verdict(loops: Loops) -> str:
    """Says whether inertia of an adaptive element helps on any loop, harms on any, and is the element to use on any."""
    helps = [_compared(*pair, loops) for pair in _ADAPTIVE]
    more, less = (any(each[word] for each in helps) for word in ("more", "less"))
    if not more or less:
        return _MIXED if more else _HARMS if less else _NOT
    best = [place for place, of in loops.items() if choice(of).family in (ADAPTIVE_INERTIA.name, ADAPTIVE_BOTH.name)]
    return _BEST.format(places(best, loops)) if best else _HELPS


def _most(device: str, of: OfLoop) -> str:
    (found, tied), alone = best(of), format_stiffness(held(without(of.rows)).value)
    if choice(of).family == NOTHING.name:
        return f"on {device}, no element is shown to hold more than none, {alone}"
    # Some names have a comma.
    alike = f"may hold as much: {' / '.join(row.family for row in tied)}" if tied else "more than every other"
    return f"on {device}, {found.family}: {format_stiffness(held(found).value)} against {alone} without ({alike})"


def _sentence(words: str) -> str:
    return f"{words[:1].upper()}{words[1:]}."


def _in_lines(sentence: str) -> str:
    """Returns a sentence with its parts, which semicolons divide, as a list after its colon, or as sentences."""
    lead, colon, rest = sentence.partition(": ")
    if not colon:
        return ". ".join(part[:1].upper() + part[1:] for part in sentence.split("; "))
    return "\n    - ".join([f"{lead}:", *rest.split("; ")])


def page(comparisons: Sequence[Comparison]) -> str:
    """Returns the page in Markdown."""
    lines = [f"{place}. {_in_lines(words)}" for place, words in enumerate(sentences(comparisons), 1)]
    parts = ["# Stabilizers compared", _INTRO, "## In short", "\n".join(lines)]
    parts += [f"![How much more every stabilizer holds, with intervals, and the force it adds]({FIGURE})"]
    parts += [f"{READING} {task_sentence(comparisons[0])}"]
    for told in comparisons:
        first, *others = told.loops
        parts += [f"## {told.name}, round trip {first.delay_s * 1e3:g} ms", " ".join(told.notes)]
        parts += [most_sentence(first), again_sentence(first), _table(first)]
        if others:
            rows = loops_rows(told.loops)
            parts += [_BESIDE.format(**vars(told.beside))]
            parts += [markdown_table(["element", *(of.name for of in told.loops)], rows)]
    return "\n\n".join(filter(None, [*parts, "## What it does not say", _LIMITS])) + "\n"


def _table(of: OfLoop) -> str:
    found, tied = best(of)
    rows = [[cells(row, of)[name] for name in _HEADS] for row in of.rows]
    for row, words in zip(of.rows, rows, strict=True):
        if row is found or row in tied:
            words[0] = f"**{words[0]}**"
    return markdown_table([*_HEADS.values()], rows, range(2, 4))


def write(rows: Path, docs: Path) -> Path:
    """Compares on every device, except what is kept in ``rows``, and writes page and figure; returns the page's file.

    Raises FigureError without matplotlib.
    """
    comparisons = list[Comparison]()
    for device, delay in DEVICES.items():
        (rows / device).mkdir(parents=True, exist_ok=True)
        subject = make_subject(device, None, delay, None, [], kinds_with([]))
        comparisons.append(find(subject, grid=True, workers=None, rows=rows / device / ROWS))
    write_figure(figure_of(comparisons), docs / FIGURE)
    (docs / PAGE).write_text(page(comparisons), encoding="utf-8")
    return docs / PAGE


if __name__ == "__main__":
    try:
        print(write(Path(sys.argv[1]), Path(sys.argv[2])))
    except KeyboardInterrupt:
        leave("Interrupted; the same command continues.", FAILED)
    except FigureError as error:
        leave(str(error), WRONG_USE)
