"""The work of the commands that take a scene, or the directory of a run: run, check, plugins, plot and replay."""

from __future__ import annotations

import dataclasses
import json
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from haploop.tools.cli.exit_codes import FAILED, WRONG_USE, leave, plain_errors, print_json
from haploop.tools.cli.options import parse_pace

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element
    from haploop.protocol.scene.scene import Scene
    from haploop.protocol.transport import Transport
    from haploop.tools.cli.view import Viewing


def run_scene(
    scene_path: Path,
    overrides: list[str],
    out: Path | None,
    in_process: bool,
    pace: str,
    plugins: list[Path],
    tcp: str | None,
    keys: Path | None,
    as_json: bool,
    viewing: Viewing,
) -> None:
    """Runs a scene with progress, and shows its summary."""
    from haploop.launch.runs.start import prepare, run
    from haploop.launch.spec import RunFailed
    from haploop.tools.render.progress import ProgressLine
    from haploop.tools.render.report import print_summary

    with plain_errors():
        rate = parse_pace(pace)
        if rate != "free" and in_process:
            leave("--pace needs the clock of a run as processes; leave out --in-process.", WRONG_USE)
        transport = _transport(tcp, keys, in_process)
        prepared = prepare(scene_path, overrides, plugins, out)
        print_notes(prepared.scene)
        try:
            with ProgressLine(prepared.scene.title, prepared.scene.duration) as line:

                def told(run_id: str) -> None:
                    line.announce(run_id)
                    viewing.on_started(run_id)

                summary = run(
                    prepared,
                    in_process=in_process,
                    pace=math.inf if rate == "free" else rate,
                    transport=transport,
                    on_progress=line.update,
                    on_started=told,
                    start_gate=viewing.may_start,
                )
        except RunFailed as error:
            leave(f"{error}\nWhat was logged is in {prepared.out}.", FAILED)
        except KeyboardInterrupt:
            leave(f"Interrupted at once; what was logged is in {prepared.out}.", FAILED)
    if as_json:
        print_json({**summary, "directory": str(prepared.out)})
    else:
        print_summary(summary)
        print(f"{prepared.out}", file=sys.stderr)
    if summary["ended"] == "failed":
        leave(f"The run failed: {summary['why']}.", FAILED)


def _transport(host: str | None, keys: Path | None, in_process: bool) -> Transport:
    """Returns the transport: local sockets, or TCP where an address was given."""
    from haploop.protocol.transport import Transport, TransportError

    if host and in_process:
        leave("--tcp needs the sockets of a run as processes; leave out --in-process.", WRONG_USE)
    try:
        return Transport.from_options(host, keys)
    except TransportError as error:
        leave(str(error), WRONG_USE)


def replay_run(directory: Path, as_json: bool) -> None:
    """Repeats a run from its log; exit status 1 when a bit differs."""
    from haploop.launch.runs.replay import ReplayError, replay

    with plain_errors():
        try:
            result = replay(directory)
        except ReplayError as error:
            leave(str(error), WRONG_USE)
    if as_json:
        print_json({"agrees": not result.differences, "differences": result.differences, **result.summary})
    elif result.differences:
        print("\n".join(result.differences))
    else:
        print(f"Every bit of {result.summary['steps']} steps agreed: {result.summary['trajectory_sha256']}")
    if result.differences:
        raise SystemExit(FAILED)


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


def _parameters(element: type[Element]) -> dict[str, dict[str, str | float | None]]:
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
