"""The commands that run many scenes, or study motion."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from haploop.tools.command.options import Delay, Device, Estimator, Hand, Json, Plugin, Set, SweepFile, parse_seconds


def sweep(
    sweep: SweepFile,
    set: Set = None,
    out: Annotated[
        Path | None, typer.Option(help="directory; one that holds this sweep is continued [runs/SWEEP-TIME]")
    ] = None,
    workers: Annotated[int | None, typer.Option(help="processes [one per core]", show_default=False)] = None,
    dask: Annotated[str | None, typer.Option(metavar="ADDRESS", help="scheduler of a Dask cluster to run on")] = None,
    jax: Annotated[bool, typer.Option("--jax", help="run compiled, on CPU or GPU, within a tolerance")] = False,
    plugin: Plugin = None,
    json: Json = False,
) -> None:
    """Run a scene over one to three axes into a table. With [bisect], find where its verdict changes.

    It can be stopped or killed; the same command with the same --out continues it. `haploop plot DIR` draws the map.
    """
    from haploop.tools.sweep.command import Request
    from haploop.tools.sweep.command import sweep as run_sweep

    run_sweep(Request(sweep, set or [], out, workers, dask, jax, plugin or []), json)


def dissipate(
    recording: Annotated[Path, typer.Argument(help="CSV, TSV, directory of a run or its log", show_default=False)],
    damping: Annotated[list[str] | None, typer.Option(metavar="B", help='damping, N s/m or "0.0027 N s/mm"')] = None,
    mass: Annotated[list[str] | None, typer.Option(metavar="M", help="bi- and unidirectional inertia, kg")] = None,
    element: Annotated[
        list[str] | None, typer.Option(metavar="ELEMENT", help='any other element: "KIND KEY=VALUE ..."')
    ] = None,
    position: Annotated[
        str | None, typer.Option(metavar="COLUMN", help="column of the position, name or number from 1 [x or position]")
    ] = None,
    time: Annotated[
        str | None, typer.Option(metavar="COLUMN", help="column of the time [t, time or timestamp]")
    ] = None,
    rate: Annotated[float | None, typer.Option(min=1e-6, max=1e9, help="samples per second, in place of times")] = None,
    velocity: Annotated[
        str | None, typer.Option(metavar="COLUMN", help="column of a recorded velocity, else estimated")
    ] = None,
    acceleration: Annotated[
        str | None, typer.Option(metavar="COLUMN", help="column of a recorded acceleration, else estimated")
    ] = None,
    force: Annotated[
        str | None, typer.Option(metavar="COLUMN", help="commanded force on the device: its work, and the sum F v T")
    ] = None,
    unit: Annotated[
        str | None, typer.Option(help="unit of the position, such as mm, or metres per count [the header's (unit), m]")
    ] = None,
    time_unit: Annotated[str | None, typer.Option(help="such as ms [the header's (unit), s]")] = None,
    velocity_unit: Annotated[str | None, typer.Option(help="such as mm/s [the header's (unit), m/s]")] = None,
    acceleration_unit: Annotated[str | None, typer.Option(help="such as g_0 [the header's (unit), m/s^2]")] = None,
    force_unit: Annotated[str | None, typer.Option(help="such as mN [the header's (unit), N]")] = None,
    wall: Annotated[str | None, typer.Option(metavar="POSITION", help="elements act only beyond it, m or text")] = None,
    occupies: Annotated[str, typer.Option(metavar="below|above", help="on which side of it the wall is")] = "below",
    delay: Annotated[
        str | None, typer.Option(metavar="TIME", help="age of a force when it acts [0; that of a run]")
    ] = None,
    set: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="velocity.cutoff, acceleration.estimator ...")
    ] = None,
    plugin: Plugin = None,
    out: Annotated[Path | None, typer.Option(help="the figure's file [beside the recording]")] = None,
    json: Json = False,
) -> None:
    """Compute what elements would have dissipated on a recording. They do not change its motion.

    If a force was recorded, too: its true work, held from sample to sample, and whether it is passive. The recording
    is read once, in constant memory. The last line names the figure's file.
    """
    from haploop.tools.dissipate.command import Request, Selection
    from haploop.tools.dissipate.command import dissipate as book
    from haploop.tools.dissipate.recording.text_recording import Layout

    selection = Selection(damping or [], mass or [], element or [], wall, occupies, set or [])
    units = unit, time_unit, velocity_unit, acceleration_unit
    layout = Layout(position, time, rate, velocity, acceleration, *units, force, force_unit)
    book(Request(recording, selection, layout, parse_seconds(delay, "--delay"), plugin or [], out), json)


def paper(
    figure: Annotated[list[int] | None, typer.Option(help="number of a figure; may be repeated [all]")] = None,
    out: Annotated[Path, typer.Option(help="directory for pictures, data, scenes and the page")] = Path("runs/paper"),
    small: Annotated[bool, typer.Option("--small", help="few runs, done in seconds, to see that it works")] = False,
    workers: Annotated[int | None, typer.Option(min=1, help="processes [one per core]")] = None,
) -> None:
    """Make the figures of the paper and the table of its claims.

    Each figure is a PNG with its data and scenes beside it. The last line names the page. After a stop, the same
    command continues where it stopped.
    """
    from haploop.tools.studies.choi2022.command import paper as make

    make(figure or [], out, small, workers)


def advise(
    device: Device,
    hand: Hand = None,
    delay: Delay = None,
    estimator: Estimator = None,
    set: Set = None,
    plugin: Plugin = None,
    workers: Annotated[int | None, typer.Option(help="processes [one per core]", show_default=False)] = None,
    out: Annotated[
        Path | None, typer.Option(help="directory; that of a stopped advice is continued [runs/advice-DEVICE-TIME]")
    ] = None,
    json: Json = False,
) -> None:
    """Say how stiff a wall a device can render safely.

    Also with which element, what breaks it, and which change would gain most.

    It can be stopped; the same command with --out DIR, the directory of the stopped one, continues it.
    """
    from haploop.tools.advise.command import advise as give

    give(device, hand, delay, estimator, set or [], plugin or [], workers, out, json)
