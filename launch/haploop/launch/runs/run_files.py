"""Reads back the files that a run has left: its log, the scene in the log, and the summary."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import haploop.logger
from haploop.controller.dissipation import Element, registry
from haploop.launch.runs.stand_ins import elements_for, standing_in
from haploop.launch.scene.check import resolve
from haploop.launch.scene.mistakes import Mistake, SceneError
from haploop.launch.scene.reading.layers import Layers
from haploop.launch.scene.reading.tables import parse
from haploop.launch.spec import SCENE
from haploop.logger.log import LogError
from haploop.logger.log.recording import Recording, Table
from haploop.logger.summary import SUMMARY, Summary, misfit, read
from haploop.protocol.changes import changes_of
from haploop.protocol.scene.scene import Scene


def recorded_scene(
    directory: Path, attachments: Mapping[str, bytes], kinds: Mapping[str, type[Element]] | None = None
) -> Scene | None:
    """Returns the scene of a run: the one that its log holds, under a checksum, or else the file beside the log.

    Args:
        directory: directory of the run.
        attachments: attachments of its log.
        kinds: the available elements; if None, the scene may also name what is not installed.

    Returns:
        The scene; None if there is neither.

    Raises:
        SceneError: it is not a scene, or not one of this version.
    """
    path = directory / SCENE
    if SCENE in attachments:
        try:
            tables = tomllib.loads(attachments[SCENE].decode())
        except (ValueError, RecursionError) as error:
            raise SceneError([Mistake(str(path), "", "", "The scene in the log is not TOML.")]) from error
    elif path.exists():
        tables = parse(path)
    else:
        return None
    if kinds is not None:
        return resolve(Layers(path, tables), kinds).in_order()
    with standing_in(tables):
        return resolve(Layers(path, tables), registry() | elements_for(tables)).in_order()


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
        LogError: it cannot be read, or is not the log of a run.
    """
    log = haploop.logger.read(directory)
    for topic in _COLUMNS.keys() & log.keys():
        lacking = sorted(_COLUMNS[topic] - log[topic].keys()) if isinstance(log[topic], Table) else ["columns"]
        if lacking:
            raise LogError(f"The log in {directory} is not that of a run: {topic} lacks {', '.join(lacking)}.")
    try:
        events = [(int(event["tick"]), event) for event in log.get("/events", []) if event["timestamp"] >= 0]
        changes_of(events)
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        raise LogError(f"The log in {directory} is not that of a run: an event in it cannot be read.") from error
    return log


# What is read from a summary to show or repeat a run: key -> type, or the same for a nested table.
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
    """Returns the summary of a run; None if it left none.

    Raises:
        LogError: it cannot be read, is damaged, or belongs to something else.
    """
    path = directory / SUMMARY
    if not path.exists():
        return None
    summary = read(path)
    if key := misfit(summary, _NEEDED):
        by = summary.get("versions")
        version = by.get("haploop", "") if isinstance(by, dict) else ""
        raise LogError(
            f"The summary {path} is not that of a run of this version of haploop: {key} is missing or of the wrong type"
            f"{f' (it was written by version {version})' if version else ''}. Without the file the log can be read."
        )
    return summary
