"""The commands that take what runs have left."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from haploop.tools.cli.options import Directory, Json


def plot(directory: Directory) -> None:
    """Draw a run, or the map of a sweep as far as it goes; the last line names the figure's file."""
    from haploop.tools.cli.scenes import plot_directory

    plot_directory(directory)


def replay(directory: Directory, json: Json = False) -> None:
    """Repeat a run from its own log and say whether every bit agreed."""
    from haploop.tools.cli.replay import replay_run

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
