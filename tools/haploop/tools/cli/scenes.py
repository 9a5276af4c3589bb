"""The commands on scenes and plugins; they import what they work with when they are called."""

from __future__ import annotations

import contextlib
import dataclasses
import shlex
import sys
from json import dumps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from haploop.tools.command.given import kinds_with, notes_in_place, print_note, print_notes
from haploop.tools.command.options import (
    FAILED,
    WRONG_USE,
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

_YOURS = "your own file is used here: {0}"
# More samples of a recorded force than this are not printed to a terminal.
_MOST_PRINTED = 20


def scenes(
    name: Annotated[str | None, typer.Argument(help="print this one's file, to copy it", show_default=False)] = None,
    json: Json = False,
) -> None:
    """List the available scenes, devices, hands and sweeps. A name means your own file first, then one of these."""
    from haploop.launch.scene.bundled import FOLDERS, about, bundled, of_name, own_file
    from haploop.protocol.names import meant

    if name is not None:
        path = next(filter(None, (of_name(name, folder) for folder in FOLDERS)), None)
        if path is None:
            hint = meant(name, [one for folder in FOLDERS for one in bundled(folder)])
            leave(f"{name} does not come with haploop{hint}; haploop scenes lists what does.", WRONG_USE)
        print(path.read_text(encoding="utf-8"), end="")
        return
    listed = {
        folder: {
            name: _YOURS.format(own) if (own := own_file(name, folder)) else about(path)
            for name, path in bundled(folder).items()
        }
        for folder in FOLDERS
    }
    if json:
        print_json(listed)
        return
    from haploop.tools.render.listings import bundled_table
    from haploop.tools.render.terminal import console

    console().print(bundled_table(listed))


def new(
    file: Annotated[Path, typer.Argument(help="scene file to write; it must not exist yet", show_default=False)],
    device: Annotated[
        str,
        typer.Option(
            metavar="NAME", help="one that haploop scenes lists, or your own file", autocompletion=complete("devices")
        ),
    ] = "premium15",
    hand: Annotated[
        str, typer.Option(metavar="NAME", help="likewise", autocompletion=complete("hands"))
    ] = "fu_cavusoglu_y",
    wall: Annotated[
        str | None,
        typer.Option(
            metavar="STIFFNESS", help="stiffness of the wall [that of the files, or 0.5 N/mm]", show_default=False
        ),
    ] = None,
) -> None:
    """Write a commented scene to start from. A hand moves a device into a wall and holds it there."""
    from haploop.launch.scene.file import load
    from haploop.launch.scene.first_scene import FirstSceneError, first_scene
    from haploop.launch.scene.mistakes import SceneError

    with plain_errors():
        try:
            text = first_scene(device, hand, wall, file.parent)
        except FirstSceneError as error:
            leave(str(error), WRONG_USE)
        except OSError as error:
            leave(f"{error.filename} cannot be read: {error.strerror}.", WRONG_USE)
        is_new = False
        try:
            with file.open("x", encoding="utf-8") as new_file:
                is_new = True
                new_file.write(text)
        except FileExistsError:
            leave(f"{file} already exists; name a file that does not.", WRONG_USE)
        except OSError as error:
            if is_new:
                with contextlib.suppress(OSError):  # a full disk leaves a broken file, which is removed
                    file.unlink()
            leave(f"{file} cannot be written: {error.strerror}.", FAILED)
        try:
            load(file)
        except SceneError:
            file.unlink()
            raise
    name = shlex.quote(str(file))
    print(f"Next: haploop run {name}, haploop explain {name}, haploop advise {name}.")


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
