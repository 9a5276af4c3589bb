"""Labels of runs in one figure: name, title where the titles differ, and the differences of the scenes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from haploop.protocol.changes import describe
from haploop.tools.figure.data import RunData
from haploop.tools.figure.difference import scene_value, unlike_keys
from haploop.tools.render.scene_units import unit_at
from haploop.tools.render.units import parameters

# Differences of scenes, and letters of a title, that a line of a legend has room for.
_MOST_DIFFERENCES, _MOST_LETTERS = 3, 48


def labels(runs: Sequence[RunData], names: Sequence[str]) -> list[str]:
    """Returns a label for each run, which begins with its name."""
    unlike = unlike_keys([run.scene for run in runs])
    is_titled = len({run.scene.title for run in runs}) > 1
    found = []
    for place, (run, name) in enumerate(zip(runs, names, strict=True)):
        differs = _differs(run, place, runs, unlike) if unlike else ""
        title = run.scene.title if is_titled and run.scene.title != name else ""
        short = title if len(title) <= _MOST_LETTERS else f"{title[: _MOST_LETTERS - 2].rstrip()} …"
        behind = f"{short} ({differs})" if short and differs else title or differs
        found.append(f"{name}: {behind}" if behind else name)
    return found


def _differs(run: RunData, place: int, runs: Sequence[RunData], unlike: Mapping[str, Sequence[Any]]) -> str:
    """Returns what in a run's scene is not the same in all: elements and events in words, then keys."""
    elements, of_elements = _elements(run, place, runs)
    events, of_events = _events(run, place, runs)
    words, told = elements + events, (*of_elements, *of_events)
    for key, values in unlike.items():
        if values[place] is not None and not key.startswith(told):
            words.append(f"{key} {scene_value(values[place])} {unit_at(run.scene, key, run.units)}".rstrip())
    # A run that has none of the keys is described by those of the others.
    words = words or [f"no {key}" for key in unlike]
    more = f" and {len(words) - _MOST_DIFFERENCES} more" if len(words) > _MOST_DIFFERENCES else ""
    return ", ".join(words[:_MOST_DIFFERENCES]) + more


def _elements(run: RunData, place: int, runs: Sequence[RunData]) -> tuple[list[str], list[str]]:
    """Returns the elements that a run has and others do not, or lacks, and the beginnings of their keys."""
    words, told = [], []
    for slot in range(max(len(one.scene.dissipation) for one in runs)):
        there = [one.scene.dissipation[slot] if slot < len(one.scene.dissipation) else None for one in runs]
        if len({element and element.name for element in there}) > 1:
            told.append(f"dissipation.{slot}.")
            if (own := there[place]) is not None:
                numbers = parameters(own.as_dict(), run.units)
                words.append(f"with {own.name}" + (f" ({numbers})" if numbers else ""))
            else:
                words.append(f"without {' or '.join(dict.fromkeys(one.name for one in there if one))}")
    return words, told


def _events(run: RunData, place: int, runs: Sequence[RunData]) -> tuple[list[str], list[str]]:
    """Returns the events that a run has and some others do not, or lacks, and the beginnings of their keys."""
    words, told = [], []
    for slot in range(max(len(one.scene.event) for one in runs)):
        there = [one.scene.event[slot] if slot < len(one.scene.event) else None for one in runs]
        if None in there:
            told.append(f"event.{slot}.")
            if (own := there[place]) is not None:
                units = {key: unit_at(run.scene, key, run.units) for key in own.set or {}}
                words.append(f"at {own.at:g} s {describe(own.as_dict(), {**run.units, **units})}")
            else:
                words.append(f"without event {slot}")
    return words, told
