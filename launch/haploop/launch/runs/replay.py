"""Repeats a run from its own log: the scene, the plugins and every event, live ones included."""

from __future__ import annotations

import dataclasses
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

import haploop.logger
from haploop.controller.dissipation import Element, load_plugin, registry
from haploop.launch.runs.half_replay import beside_own, foreign_programs, named, repeat_controller, repeat_plant
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.runs.run_files import holds_readings, recorded_log, recorded_scene, recorded_summary
from haploop.launch.spec import PLUGINS, SCENE, RunFailed, kept_name
from haploop.logger.log import LogError
from haploop.logger.log.recording import Recording
from haploop.logger.summary import REPEATED_S, Summary, finite
from haploop.protocol.changes import Event
from haploop.protocol.files import read_file
from haploop.protocol.scene.scene import Scene, accelerometer_is_used
from haploop.protocol.transport.wire import Message

_NO_READINGS = (
    "The controller of this run cannot be repeated: the accelerometer samples sent to it are not in the log, which "
    'holds the readings only with acceleration.source = "accelerometer" and no cutoff'
)

_TOLD_OTHERWISE = "Either the log was changed, or the controller sent other forces than it reported."


class ReplayError(Exception):
    """The run cannot be repeated; the message says what is missing."""


@dataclasses.dataclass(frozen=True)
class Replay:
    """The outcome of repeating a run.

    Attributes:
        summary: summary of the repetition.
        differences: where recorded and repeated run disagree, as sentences; empty when every bit agreed.
        cut: where the log ends if it was cut off, else "".
        half: if only one half of the run was haploop's own, which half was repeated and what program the other was;
            else "".
        other: for such a run, how far the other half was from what haploop's own would have done in its place.
    """

    summary: Summary
    differences: list[str]
    cut: str
    half: str = ""
    other: str = ""


def replay(directory: Path) -> Replay:
    """Repeats a run from its log, in one process, and compares bit by bit.

    Every logged step, tick and book is compared, and the whole trajectory if the summary holds its digest. If the plant
    was a foreign program, the controller is repeated from the recorded samples; if the controller was one, the plant is
    repeated from the recorded commands.

    Raises:
        ReplayError, LogError, SceneError: the directory does not hold a run that can be repeated.
    """
    recorded = logged_run(directory)
    scene, kinds, events = repeatable(directory, recorded)
    before = recorded_summary(directory)
    if foreign := foreign_programs(recorded, scene):
        return _replay_half(scene, kinds, events, recorded, before, foreign)
    with tempfile.TemporaryDirectory(prefix="haploop-replay-") as scratch:
        try:
            summary = run_in_process(scene, kinds, out=Path(scratch), events=events, causes=True)
        except RunFailed:  # then ticks are missing, and the comparison says so
            summary = recorded_summary(Path(scratch)) or {}
        except LogError as error:
            why = getattr(error.__cause__, "strerror", None) or "it could not be written"
            raise LogError(
                f"The repetition keeps a temporary log in {scratch}: {why}. Free some space or set TMPDIR."
            ) from error
        repeated = haploop.logger.read(scratch)
    failed = before is not None and before["ended"] == "failed"
    differences = _compare_scenes(directory, recorded) + _compare(recorded, repeated, failed)
    if before and not failed:
        differences += _compare_summaries(before, finite(summary), scene)
    return Replay(summary, differences, recorded.cut)


def _replay_half(
    scene: Scene,
    kinds: dict[str, type[Element]],
    events: list[tuple[int, Event]],
    recorded: Recording,
    before: Summary | None,
    foreign: dict[str, Message],
) -> Replay:
    others, role = named(foreign), next(iter(foreign))
    if len(foreign) > 1:
        raise ReplayError(f"Neither half of this run was haploop's own, so there is nothing to repeat: {others}.")
    failed, rows = before is not None and before["ended"] == "failed", recorded["/controller"]
    summary: Summary = {"ticks": len(rows["x"])}
    other = beside_own(role, scene, kinds, events, recorded)
    if "plant" in foreign:
        if accelerometer_is_used(scene) and not holds_readings(scene):
            raise ReplayError(f"{_NO_READINGS} ({others}).")
        half = repeat_controller(scene, kinds, events, recorded)
        differences = _compare({"/controller": rows}, half, failed)
        how = f"The controller was repeated from its samples; {others}."
        return Replay(summary, differences, recorded.cut, how, other)
    half, digest = repeat_plant(scene, events, recorded)
    samples = {"/controller": {name: rows[name] for name in ("timestamp", "x")}}
    plant = {topic: recorded[topic] for topic in ("/plant",) if topic in recorded}
    differences = _compare(samples | plant, half, failed)
    if before and not failed:
        summary["trajectory_sha256"] = digest
        differences += ["trajectory_sha256 of the summary differs."] * (before["trajectory_sha256"] != digest)
    other = _TOLD_OTHERWISE if differences else other
    return Replay(summary, differences, recorded.cut, f"The plant was repeated from its commands; {others}.", other)


def logged_run(directory: Path) -> Recording:
    """Returns the log of a run that can be repeated, from its first tick on.

    Raises:
        ReplayError: there is no log, it does not start at tick 0, or it holds no tick.
        LogError: it cannot be read.
    """
    try:
        recorded = recorded_log(directory)
    except FileNotFoundError as error:
        raise ReplayError(str(error)) from error
    seen = recorded["/controller"]["timestamp"][:1] if "/controller" in recorded else []
    if not len(seen):
        raise ReplayError(f"The log in {directory} holds no tick, so there is nothing to repeat. {recorded.cut}")
    if seen[0] > 0.0:
        raise ReplayError(f"{directory} was logged from {seen[0]:g} s on; replay the directory of the run itself.")
    return recorded


def demand_own(recorded: Recording, scene: Scene) -> None:
    """Raises ReplayError if plant or controller of a run was a foreign program, so that its loop cannot be judged."""
    if foreign := foreign_programs(recorded, scene):
        raise ReplayError(
            f"Whether this loop is stable cannot be determined: {named(foreign)}, "
            "which cannot be held still and pushed here. Its summary holds what its last half second showed."
        )


def repeatable(directory: Path, recorded: Recording) -> tuple[Scene, dict[str, type[Element]], list[tuple[int, Event]]]:
    """Returns what a run can be repeated from: its scene, the available elements, and every event with its tick.

    Args:
        recorded: its log, as ``logged_run`` returns it.

    Raises:
        ReplayError, SceneError: the directory does not hold a run that can be repeated.
    """
    kinds = registry(_launch_plugins(directory, recorded))
    scene = recorded_scene(directory, recorded.attachments, kinds)
    if scene is None:
        raise ReplayError(f"{directory} holds no {SCENE}; a directory written by haploop run was expected.")
    events = [_event(dict(event), directory) for event in recorded.get("/events", [])]
    # A run that was cut off is repeated as far as its log goes.
    return scene, kinds, [*events, (len(recorded["/controller"]["x"]), {"stop": True})]


def _compare_scenes(directory: Path, recorded: Recording) -> list[str]:
    held, file = recorded.attachments.get(SCENE), directory / SCENE
    if held is None:
        return []
    try:
        same = read_file(file) == held
    except OSError as error:
        return [f"{file} cannot be read: {error.strerror}."]
    return [] if same else [f"{file} differs from the scene in the log, from which the run was repeated."]


def _launch_plugins(directory: Path, recorded: Recording) -> list[Path]:
    """Returns the files of the plugins the run began with; those taken up later are in its events."""
    names = [name for name in recorded.attachments if name.startswith(f"{PLUGINS}/")]
    return [_kept_plugin(directory, name) for name in names]


def _kept_plugin(directory: Path, name: str) -> Path:
    """Returns the file of a plugin in the directory of its run, the very same one: its name ends with its digest."""
    path = directory / PLUGINS / Path(name).name
    if not path.is_file():
        raise ReplayError(f"{path} is missing; the run cannot be repeated without its plugin.")
    if kept_name(path) != path.name:
        raise ReplayError(f"{path} has changed since the run was made; the run cannot be repeated.")
    return path


def _event(event: Event, directory: Path) -> tuple[int, Event]:
    """Returns tick and event of a logged event; its plugin is loaded from the run's directory."""
    del event["timestamp"]
    tick = event.pop("tick")
    if "plugin" in event:
        path = _kept_plugin(directory, event["plugin"])
        event["plugin"] = str(path)
        load_plugin(path)
    return tick, event


def _compare(recorded: Mapping[str, Any], repeated: Mapping[str, Any], failed: bool) -> list[str]:
    """Returns the differences between two logs as far as the recorded one goes, one sentence per column.

    The force in the end state of a failed run is left out: it is the one held before, not the one that would follow.
    """
    differences = []
    for topic in ("/plant", "/controller", "/energy"):
        if topic not in recorded:
            continue
        for name, whole in recorded[topic].items():
            before = whole[:-1] if failed and (topic, name) == ("/plant", "force") else whole
            after = repeated.get(topic, {}).get(name, np.zeros(0))[: len(before)]
            differs = np.ones(len(before), bool)
            differs[: len(after)] = before[: len(after)].view(np.uint64) != after.view(np.uint64)
            if differs.any():
                first = int(np.argmax(differs))
                t = float(recorded[topic]["timestamp"][first])
                differences.append(
                    f"{topic} {name} differs in {int(differs.sum())} of {len(before)} rows, first at {t:g} s."
                )
    return differences


def _compare_summaries(before: Summary, after: Summary, scene: Scene) -> list[str]:
    keys = ("ticks", "trajectory_sha256", "final", "extremes", "window", "energy", "lost", "actuator", "accelerometer")
    # A run of processes longer than REPEATED_S was not judged; the repetition is.
    was_judged = "stability" in before or scene.run.verdict != "pushed" or before["duration_s"] <= REPEATED_S
    of_verdict = ("verdict", "stability") if was_judged else ()
    return [f"{key} of the summary differs." for key in (*keys, *of_verdict) if before.get(key) != after.get(key)]
