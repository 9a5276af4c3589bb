"""Commands that read and show: check, plugins, plot."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from haploop.tools.cli.exit_codes import WRONG_USE, leave, plain_errors, print_json

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element
    from haploop.protocol.scene.scene import Scene


def kinds_with(plugins: list[Path]) -> dict[str, type[Element]]:
    """Returns the installed elements and those of some files."""
    from haploop.controller.dissipation import registry

    return registry(plugins)


def check_scene(scene_path: Path, overrides: list[str], plugins: list[Path], as_json: bool) -> None:
    """Prints the resolved scene, and whether it can be run."""
    from haploop.launch.scene.file import load
    from haploop.launch.scene.toml_writer import to_toml

    with plain_errors():
        scene = load(scene_path, overrides, kinds_with(plugins))
    print_notes(scene)
    if as_json:
        print_json(scene.as_dict())
    else:
        print(to_toml(scene.as_dict()), end="")
        print(f"{scene_path} can be run.", file=sys.stderr)


def print_notes(scene: Scene) -> None:
    """Prints on stderr what in a resolved scene may not be what was meant."""
    from haploop.launch.plan.effects import notes

    for note in notes(scene):
        print(f"Note: {note}", file=sys.stderr)


def print_schema(plugins: list[Path]) -> None:
    """Prints the JSON Schema of scene files, for editors."""
    from haploop.launch.scene.schema import json_schema

    with plain_errors():
        print(json.dumps(json_schema(kinds_with(plugins)), indent=2))


def list_plugins(plugins: list[Path], as_json: bool) -> None:
    """Prints every kind of element with its parameters."""
    with plain_errors():
        kinds = kinds_with(plugins)
    if as_json:
        print_json({kind: _parameters(element) for kind, element in kinds.items()})
        return
    from haploop.tools.render.report import plugins_table
    from haploop.tools.render.terminal import console

    console().print(plugins_table(kinds))


def _parameters(element: type[Element]) -> dict[str, Any]:
    import dataclasses

    return {
        name: quantity.as_dict() | ({} if default is dataclasses.MISSING else {"default": default})
        for name, (quantity, default) in element.parameters().items()
    }


def plot_directory(directory: Path) -> None:
    """Draws the figure of a run, or the map of a sweep, and names its file."""
    from haploop.tools.figure.data import FigureError
    from haploop.tools.sweep.table import is_sweep

    if is_sweep(directory):
        from haploop.tools.sweep.map.figure import draw_map as draw
    else:
        from haploop.tools.figure.run_figure import draw

    with plain_errors():
        try:
            target = draw(directory)
        except FigureError as error:
            leave(str(error), WRONG_USE)
    print(target)
