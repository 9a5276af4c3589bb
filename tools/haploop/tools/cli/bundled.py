"""The commands for a first scene: list what comes with haploop, and write a scene of one's own from it."""

from __future__ import annotations

import contextlib
import shlex
from pathlib import Path
from typing import Annotated

import typer

from haploop.tools.command.options import FAILED, WRONG_USE, Json, complete, leave, plain_errors, print_json

_YOURS = "your own file is used here: {0}"


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
