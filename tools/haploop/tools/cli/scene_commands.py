"""The commands that take a scene, or what runs have left."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from haploop.tools.cli.options import Directory, Json, Plugin, Scene, Set


def run(
    scene: Scene,
    set: Set = None,
    out: Annotated[Path | None, typer.Option(help="directory to write to, new or empty [runs/SCENE-TIME]")] = None,
    in_process: Annotated[bool, typer.Option("--in-process", help="everything in one process, same bits")] = False,
    pace: Annotated[
        str | None, typer.Option(help="free, or simulated seconds per second [free; 1 with --view]", show_default=False)
    ] = None,
    view: Annotated[bool, typer.Option("--view", help="show it in the browser, which may steer it")] = False,
    plugin: Plugin = None,
    tcp: Annotated[str | None, typer.Option(metavar="ADDRESS", help="TCP sockets, such as 127.0.0.1")] = None,
    keys: Annotated[Path | None, typer.Option(metavar="DIR", help="CURVE keys for TCP; made where missing")] = None,
    json: Json = False,
) -> None:
    """Run a scene to its end; other terminals can steer and watch it meanwhile."""
    from haploop.tools.cli.scenes import run_scene
    from haploop.tools.cli.view import viewing

    rate = pace or ("1" if view else "free")
    with viewing(view, in_process) as viewing_it:
        run_scene(scene, set or [], out, in_process, rate, plugin or [], tcp, keys, json, viewing_it)


def check(
    scene: Annotated[Path | None, typer.Argument(help="scene file (TOML)", show_default=False)] = None,
    set: Set = None,
    plugin: Plugin = None,
    schema: Annotated[bool, typer.Option("--schema", help="print the JSON Schema of scenes instead")] = False,
    json: Json = False,
) -> None:
    """Say everything that is wrong with a scene, or that nothing is; start nothing."""
    from haploop.tools.cli.scenes import check_scene, print_schema

    if schema:
        print_schema(plugin or [])
    elif scene is None:
        raise typer.BadParameter("A scene file was expected, or --schema.")
    else:
        check_scene(scene, set or [], plugin or [], json)


def explain(scene: Scene, set: Set = None, plugin: Plugin = None, json: Json = False) -> None:
    """Show what a scene comes to: bodies, states, what happens in which order, and what each effect costs."""
    from haploop.tools.cli.explain import explain_scene

    explain_scene(scene, set or [], plugin or [], json)


def plugins(plugin: Plugin = None, json: Json = False) -> None:
    """List the dissipation elements with their parameters."""
    from haploop.tools.cli.scenes import list_plugins

    list_plugins(plugin or [], json)


def plot(directory: Directory) -> None:
    """Draw a run, or the map of a sweep as far as it goes; the last line names the figure's file."""
    from haploop.tools.cli.scenes import plot_directory

    plot_directory(directory)


def replay(directory: Directory, json: Json = False) -> None:
    """Repeat a run from its own log and say whether every bit agreed."""
    from haploop.tools.cli.scenes import replay_run

    replay_run(directory, json)


def export(
    directory: Annotated[Path, typer.Argument(help="directory of a run, or its log", show_default=False)],
    to: Annotated[str, typer.Option(help="csv, npz, parquet or json-mcap (for Foxglove)", show_default=False)],
    out: Annotated[
        Path | None, typer.Option(help="directory (csv, parquet: a file a channel) or file [beside the log]")
    ] = None,
    topics: Annotated[str | None, typer.Option(help="only these channels, comma-separated [all]")] = None,
    force: Annotated[bool, typer.Option("--force", help="write over files that exist")] = False,
) -> None:
    """Write a run's log in the format of other programs, names and units kept; stdout names the files.

    Any length of log takes the same memory. A number that is not there, an element's before it was swapped in, is NaN
    in npz and parquet, an empty cell in csv, and left out in json-mcap, as are numbers that are not finite.
    """
    from haploop.tools.export.command import export_run

    export_run(directory, to, out, topics, force)
