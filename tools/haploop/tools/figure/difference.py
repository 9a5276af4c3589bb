"""Differences between two runs: keys of their scenes, their results, and the tick at which they part."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from haploop.protocol.scene.scene import Scene
from haploop.protocol.scene.table import Tables
from haploop.tools.figure.data import TOGETHER, RunData
from haploop.tools.figure.event_words import event_words
from haploop.tools.figure.run_names import run_names
from haploop.tools.render.report import plant_books
from haploop.tools.render.scene_units import unit_at
from haploop.tools.render.terminal import told

Pair = tuple[Any, Any]


@dataclass(frozen=True)
class Parting:
    """The first tick at which a logged column of the controller differs in any bit."""

    tick: int
    at_s: float
    column: str


@dataclass(frozen=True)
class Difference:
    """Two runs beside each other.

    Attributes:
        runs: the names of their directories; names: their titles.
        scene: dotted key -> both values, where they differ; None where one scene has no such key.
        units: of the numbers among these keys, "" for none.
        events: of either run in words, those made live too, where they differ.
        results: results of both runs, by name: verdict, end, hash.
        energies_J: by the name of the book, in J; None where one run has no such book.
        ticks: number of ticks that both logs hold.
        parting: where they part; None where all of these ticks are the same, or cannot be compared (``why_not``).
    """

    runs: tuple[str, str]
    names: tuple[str, str]
    scene: Mapping[str, Pair]
    units: Mapping[str, str]
    events: tuple[Sequence[str], Sequence[str]]
    results: Mapping[str, Pair]
    energies_J: Mapping[str, tuple[float | None, float | None]]
    ticks: int
    parting: Parting | None
    why_not: str = field(default="")


def difference(a: RunData, b: RunData, *, runs: tuple[str, str] = ("first", "second")) -> Difference:
    """Returns the differences between two runs, called ``runs``; one that was killed counts as far as its log goes."""
    ticks, parting, why_not = _parting(a, b)
    results = [_results(run) for run in (a, b)]
    energies = [_energies_J(run) for run in (a, b)]
    scene = unlike_keys([a.scene, b.scene])
    events = event_words(a), event_words(b)
    return Difference(
        runs=runs,
        names=(a.scene.title, b.scene.title),
        scene=scene,
        units={key: unit_at(a.scene, key, a.units) or unit_at(b.scene, key, b.units) for key in scene},
        events=events if events[0] != events[1] else ((), ()),
        results={name: (results[0].get(name), results[1].get(name)) for name in results[0] | results[1]},
        energies_J={name: (energies[0].get(name), energies[1].get(name)) for name in energies[0] | energies[1]},
        ticks=ticks,
        parting=parting,
        why_not=why_not,
    )


def unlike_keys(scenes: Sequence[Scene]) -> dict[str, tuple[Any, ...]]:
    """Returns the dotted keys whose values differ between scenes, with the value in each; the title does not count."""
    flat = [dict(_leaves(scene.as_dict())) for scene in scenes]
    keys = dict.fromkeys(key for one in flat for key in one if key != "title")
    found = {key: tuple(one.get(key) for one in flat) for key in keys}
    return {key: values for key, values in found.items() if any(value != values[0] for value in values)}


def _leaves(table: Tables | Sequence[Any], before: str = "") -> list[tuple[str, Any]]:
    items = table.items() if isinstance(table, dict) else enumerate(table)
    found = []
    for name, value in items:
        key = f"{before}{name}"
        # Lists of numbers, as those of a recorded force, are one value.
        is_node = isinstance(value, dict) or (isinstance(value, list) and value and isinstance(value[0], dict))
        found += _leaves(value, f"{key}.") if is_node else [(key, value)]
    return found


def scene_value(value: Any) -> str:
    """Returns a value of a scene, numbers with all their digits; a dash for none, a list's length for a list."""
    if value is None:
        return "–"
    return f"a list of {len(value)}" if isinstance(value, list) else f"{value}".removesuffix(".0")


def _results(run: RunData) -> dict[str, Any]:
    summary = run.summary
    if not summary:
        return {"verdict": None, "ended": "killed" if run.cut else None, "logged_s": run.span_s[1]}
    found = summary.get("stability", {})
    return {
        "verdict": told(summary),
        "provisos": ", ".join(found.get("provisos", ())) or None,
        "ended": summary["ended"],
        "logged_s": run.span_s[1],
        "oscillation_m": summary["window"]["oscillation_m"],
        "force_swing_N": summary["window"].get("force_swing_N"),
        "force_ripple_N": summary["window"].get("force_ripple_N"),
        "width_m": found.get("width_m"),
        "frequency_Hz": found.get("frequency_Hz") or None,
        "trajectory_sha256": summary.get("trajectory_sha256"),
    }


def _energies_J(run: RunData) -> dict[str, float | None]:
    if run.cut:  # its books end wherever the log does
        return {}
    energy = run.summary.get("energy", {})
    books = {book.name: book.ends_J[0] for book in run.books()}
    if books:  # a single book holds everything
        books[TOGETHER] = [*books.values()][-1]
    return books | {words: energy[key] for key, words in plant_books(energy).items()}


def _parting(a: RunData, b: RunData) -> tuple[int, Parting | None, str]:
    """Compares the columns that both controllers logged, bit by bit, from tick to tick."""
    if a.control_rate != b.control_rate:
        return 0, None, f"Ticks are not compared: one run has {a.control_rate} a second, the other {b.control_rate}."
    if round(a.ticks_s[0] * a.control_rate) != round(b.ticks_s[0] * b.control_rate):
        return 0, None, "Ticks are not compared: the logs begin at different ticks."
    ticks = min(len(a.ticks_s), len(b.ticks_s))
    first: tuple[int, str] | None = None
    for name in a.controller:
        if name == "timestamp" or name not in b.controller:
            continue
        unlike = a.controller[name][:ticks].view(np.uint64) != b.controller[name][:ticks].view(np.uint64)
        if unlike.any() and (first is None or int(np.argmax(unlike)) < first[0]):
            first = int(np.argmax(unlike)), name
    if first is None:
        return ticks, None, ""
    at_s = float(a.ticks_s[first[0]])
    return ticks, Parting(round(at_s * a.control_rate), at_s, first[1]), ""


def difference_of(first: Path, second: Path) -> Difference:
    """Returns the differences between the runs of two directories; raises what ``RunData.from_directory`` does."""
    a, b = (RunData.from_directory(directory) for directory in (first, second))
    name_a, name_b = run_names([first, second])
    return difference(a, b, runs=(name_a, name_b))
