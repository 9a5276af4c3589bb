"""The commands that take a scene or the files of a run; they import what they work with when they are called."""

from __future__ import annotations

import dataclasses
import sys
from contextlib import redirect_stdout
from json import dumps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from haploop.tools.command.given import kinds_with, notes_in_place, print_note, print_notes
from haploop.tools.command.options import (
    FAILED,
    WRONG_USE,
    Directory,
    Json,
    Plugin,
    Set,
    complete,
    leave,
    plain_errors,
    print_json,
    told,
)

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element

# More samples of a recorded force than this are not printed to a terminal.
_MOST_PRINTED = 20


def check(
    scene: Annotated[
        Path | None,
        typer.Argument(
            help="scene file (TOML)",
            show_default=False,
            autocompletion=complete("scenes"),
            callback=told("scenes"),
        ),
    ] = None,
    set: Set = None,
    plugin: Plugin = None,
    schema: Annotated[bool, typer.Option("--schema", help="print the JSON Schema of scenes instead")] = False,
    json: Json = False,
) -> None:
    """Report what is wrong or probably unintended in a scene."""
    from haploop.launch.plan.effects import notes
    from haploop.launch.runs.start import load_tried
    from haploop.launch.scene.file import recording_told
    from haploop.launch.scene.mistakes import SceneError
    from haploop.launch.scene.schema import json_schema
    from haploop.launch.scene.toml_writer import to_toml
    from haploop.protocol.scene.scene import hand_is_unmodelled

    with plain_errors():
        if schema:
            print(dumps(json_schema(kinds_with(plugin or [])), indent=2))
            return
        if scene is None:
            raise typer.BadParameter("A scene file was expected, or --schema.")
        try:
            resolved, kinds, _ = load_tried(scene, set or [], plugin or [], any_hand=True)
        except SceneError as error:
            if json:
                print_json({"mistakes": [str(mistake) for mistake in error.mistakes]})
            raise
    if json:
        print_json({**resolved.as_dict(), "notes": print_notes(resolved, kinds, scene, set or [])})
    else:
        tables = resolved.as_dict()
        force = tables.get("hand", {}).get("force", {})
        if sys.stdout.isatty() and len(force.get("time", ())) > _MOST_PRINTED:  # a file gets all of it
            for name in ("time", "force"):
                force[name] = f"{len(force[name])} numbers from {min(force[name]):g} to {max(force[name]):g}"
        print(to_toml(tables), end="", flush=True)
        with_a = " with your own plant (--node plant=COMMAND)" if hand_is_unmodelled(resolved) else ""
        no_wall = "" if resolved.wall else " It has no [wall]: nothing pushes the device back."
        recording = recording_told(scene, set or [])
        if recording or notes(resolved, kinds):
            print(file=sys.stderr)  # sets the notes apart from all that is above
        if recording:
            print(recording, file=sys.stderr)
        noted = print_notes(resolved, kinds, scene, set or [])
        but = " The notes above say what is probably unintended." if noted else ""
        print(f"{scene} can be run{with_a}.{no_wall}{but}", file=sys.stderr)


def plugins(plugin: Plugin = None, json: Json = False) -> None:
    """List elements, and what else a plugin adds, with parameters."""
    from haploop.controller.trial import check_units
    from haploop.protocol.installed import all_brought

    with plain_errors():
        kinds: dict[str, Any] = dict(kinds_with(plugin or []))
        noted = notes_in_place(kinds)
        for named in all_brought().values():
            kinds |= named
        check_units(kinds, ", ".join(map(str, plugin or [])))
    for note in noted:
        print_note(note)
    if json:
        print_json({kind: _parameters(element) for kind, element in kinds.items()})
        return
    from haploop.tools.render.listings import plugins_table
    from haploop.tools.render.terminal import console

    console().print(plugins_table(kinds))


def _parameters(element: type[Element]) -> dict[str, dict[str, str | float | None]]:
    return {
        name: quantity.as_dict() | ({} if default is dataclasses.MISSING else {"default": default})
        for name, (quantity, default) in element.parameters().items()
    }


def replay(directory: Directory, json: Json = False) -> None:
    """Repeat a run from its log and say whether all bits agree."""
    from haploop.launch.runs import replay as runs
    from haploop.protocol.transport.prints import unheard

    with plain_errors(), redirect_stdout(sys.stderr):
        try:
            with unheard():
                result = runs.replay(directory)
        except runs.ReplayError as error:
            leave(str(error), WRONG_USE)
    print_note(result.cut)
    if json:
        half = {"half": result.half, "other": result.other} if result.half else {}
        print_json({"agrees": not result.differences, "differences": result.differences, **half, **result.summary})
    elif result.differences:
        print("\n".join([*result.differences, *filter(None, [result.half, result.other])]))
    elif result.half:
        print(f"Every bit of {result.summary['ticks']} ticks agreed. {result.half} {result.other}".rstrip())
    else:
        print(f"Every bit of {result.summary['steps']} steps agreed: {result.summary['trajectory_sha256']}")
    if result.differences:
        raise SystemExit(FAILED)


def judge(directory: Directory, json: Json = False) -> None:
    """Say whether the loop of a run is stable.

    The run is repeated from its log. Then the hand is held still without noise, pushed hard and softly, and the loop
    is watched for up to 64 s of simulated time: does it come to rest? The verdict is steady, limit-cycle, growing,
    diverged, no-contact or undecided.
    """
    from haploop.launch.runs.replay import ReplayError, demand_own, logged_run, repeatable
    from haploop.launch.stability.judge import entries_of, judge_scene
    from haploop.logger.verdict.measures import WINDOW_S
    from haploop.protocol.transport.prints import unheard
    from haploop.tools.render.report import finding_table
    from haploop.tools.render.terminal import console

    with plain_errors(), redirect_stdout(sys.stderr):
        try:
            recorded = logged_run(directory)
            print_note(recorded.cut)
            with unheard():
                scene, kinds, events = repeatable(directory, recorded)
                demand_own(recorded, scene)
                finding = judge_scene(scene, kinds, events, thorough=True, causes=True)
                last_s = float(recorded["/controller"]["timestamp"][-1])
                found = entries_of(finding, scene, last_s - min(WINDOW_S, last_s / 2.0))["stability"]
        except ReplayError as error:
            leave(str(error), WRONG_USE)
    if json:
        print_json(dataclasses.asdict(finding) | {"sentence": finding.sentence(), "provisos": found["provisos"]})
    else:
        console().print(finding_table(finding, found))


def export(
    directory: Annotated[Path, typer.Argument(help="directory of a run, or its log", show_default=False)],
    to: Annotated[str, typer.Option(help="csv, npz, parquet or json-mcap (for Foxglove)", show_default=False)],
    out: Annotated[
        Path | None, typer.Option(help="directory (csv, parquet: one file per channel) or file [beside the log]")
    ] = None,
    topics: Annotated[str | None, typer.Option(help="only these channels, comma-separated [all]")] = None,
    force: Annotated[bool, typer.Option("--force", help="overwrite existing files")] = False,
) -> None:
    """Write a run's log in a format for other programs. Names and units are kept; stdout names the files.

    Memory use does not depend on the length of the log. A missing number, such as an element's before it was swapped
    in, is NaN in npz and parquet, an empty cell in csv, and left out in json-mcap, as are numbers that are not finite.
    """
    from haploop.tools.export.command import export_run

    export_run(directory, to, out, topics, force)
