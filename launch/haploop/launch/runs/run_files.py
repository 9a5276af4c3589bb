"""The files that a run has left, read back: its log, the scene that the log holds, and the summary."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import haploop.logger
from haploop.controller.dissipation import Element, registry
from haploop.controller.dissipation.element import hint_of
from haploop.launch.scene.check import resolve
from haploop.launch.scene.layers import Layers
from haploop.launch.scene.mistakes import Mistake, SceneError
from haploop.launch.scene.reading.tables import parse
from haploop.launch.spec import SCENE
from haploop.logger.log import LogError
from haploop.logger.log.recording import Recording, Table
from haploop.logger.summary import SUMMARY, Summary, misfit, read
from haploop.protocol.changes import changes_of
from haploop.protocol.quantity import Quantity
from haploop.protocol.scene.scene import NO_ELEMENT, Scene
from haploop.protocol.scene.table import Tables


def recorded_scene(
    directory: Path, attachments: Mapping[str, bytes], kinds: Mapping[str, type[Element]] | None = None
) -> Scene | None:
    """Returns the scene of a run: that which its log holds, under a checksum, or else the file beside the log.

    Args:
        directory: of the run.
        attachments: of its log.
        kinds: the elements at hand; when None, elements that are not installed may stand in the scene, too.

    Returns:
        None where there is neither.

    Raises:
        SceneError: it is no scene, or none of this version.
    """
    path = directory / SCENE
    if SCENE in attachments:
        try:
            tables = tomllib.loads(attachments[SCENE].decode())
        except (ValueError, RecursionError) as error:
            raise SceneError([Mistake(str(path), "", "", "The scene that the log holds is no TOML.")]) from error
    elif path.exists():
        tables = parse(path)
    else:
        return None
    return resolve(Layers(path, tables), registry() | _stand_ins(tables) if kinds is None else kinds).in_order()


def _stand_ins(tables: Tables) -> dict[str, type[Element]]:
    """Makes an element for each kind that a scene names, with the values that it gives, whatever they mean."""
    given: dict[str, dict[str, list[Any]]] = {}
    for table in _elements(tables):
        values = given.setdefault(table["kind"], {})
        for name in table:
            if name.isidentifier() and name not in ("kind", "acts"):
                values.setdefault(name, []).append(table[name])
    events = tables.get("event")
    sets = [event.get("set") for event in events if isinstance(event, dict)] if isinstance(events, list) else []
    later = [value for each in sets if isinstance(each, dict) for value in each.values()]
    made = {}
    for kind, values in given.items():
        hints = {name: hint_of(Quantity("", choices=_choices(of, later))) for name, of in values.items()}
        body = {"kind": kind, "force": lambda self, motion: 0.0, "__annotations__": hints}
        made[kind] = type("StandIn", (Element,), body)
    return made


def _choices(values: list[Any], later: list[Any]) -> tuple[str | bool, ...]:
    """Returns what a parameter with these values may be: no choices of a number, all texts there are of a text."""
    if any(isinstance(value, bool) for value in values):
        return False, True
    if not any(isinstance(value, str) for value in values):
        return ()
    return tuple(dict.fromkeys(value for value in (*values, *later) if isinstance(value, str)))


def _elements(tables: Tables) -> Iterator[Tables]:
    installed = registry()
    lists = [tables.get(key) for key in ("dissipation", "event")]
    entries = [entry for one in lists if isinstance(one, list) for entry in one if isinstance(entry, dict)]
    for entry in entries:
        table = entry.get("swap", entry)
        kind = table.get("kind") if isinstance(table, dict) else None
        if isinstance(kind, str) and kind not in (*installed, NO_ELEMENT):
            yield table


def holds_readings(scene: Scene) -> bool:
    """Tells whether the accelerations in a run's log are readings of an accelerometer, unfiltered."""
    table = scene.acceleration
    return table is not None and table.source == "accelerometer" and table.cutoff is None


# Columns that every run logs, by topic.
_COLUMNS = {
    "/plant": {"timestamp", "t", "x", "v", "force"},
    "/controller": {"timestamp", "x", "v", "a", "wall", "total", "in_contact"},
    "/energy": {"timestamp"},
}


def recorded_log(directory: Path) -> Recording:
    """Returns the log of a run, whole or as far as it goes.

    Raises:
        FileNotFoundError: there is no log.
        LogError: it cannot be read, or is none of a run.
    """
    log = haploop.logger.read(directory)
    for topic in _COLUMNS.keys() & log.keys():
        lacking = sorted(_COLUMNS[topic] - log[topic].keys()) if isinstance(log[topic], Table) else ["columns"]
        if lacking:
            raise LogError(f"The log in {directory} is none of a run: {topic} lacks {', '.join(lacking)}.")
    try:
        events = [(int(event["tick"]), event) for event in log.get("/events", []) if event["timestamp"] >= 0]
        changes_of(events)
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        raise LogError(f"The log in {directory} is none of a run: an event in it cannot be read.") from error
    return log


# What is read of a summary by those that show or repeat a run: key -> type, or the same of a table within.
_NUMBER = (int, float, type(None))
_PAIR = {"sampled_J": _NUMBER, "true_J": _NUMBER}
_NEEDED: Mapping[str, Any] = {
    "ended": str,
    "verdict": str,
    "ticks": int,
    "window": dict.fromkeys(("from_s", "oscillation_m", "outside_fraction", "displayed_stiffness_N_m"), _NUMBER),
    "energy": {"elements": [_PAIR], "wall": _PAIR, "residual_J": _NUMBER, "moved_J": _NUMBER},
    "lost": {},
}


def recorded_summary(directory: Path) -> Summary | None:
    """Returns the summary of a run, None where it left none.

    Raises:
        LogError: it cannot be read, is damaged, or is that of something else.
    """
    path = directory / SUMMARY
    if not path.exists():
        return None
    summary = read(path)
    if key := misfit(summary, _NEEDED):
        by = summary.get("versions")
        version = by.get("haploop", "") if isinstance(by, dict) else ""
        raise LogError(
            f"The summary {path} is none of a run of this version of haploop: {key} is missing or of another type"
            f"{f' (it was written by version {version})' if version else ''}. Without the file the log reads by itself."
        )
    return summary
