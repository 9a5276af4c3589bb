"""The command line: every command, its arguments and its help; the work is done elsewhere and imported when needed."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

app = typer.Typer(
    help="Simulate a haptic loop: a device in a hand, a sampled controller with a virtual wall, a line with delay.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)

Scene = Annotated[Path, typer.Argument(help="scene file (TOML)", show_default=False)]
Directory = Annotated[Path, typer.Argument(help="directory of a run", show_default=False)]
Set = Annotated[list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="change a key of the scene")]
Plugin = Annotated[list[Path] | None, typer.Option("--plugin", metavar="FILE", help="Python file with elements")]
Run = Annotated[str | None, typer.Option("--run", metavar="ID", help="which run, when several are live")]
Json = Annotated[bool, typer.Option("--json", help="one JSON object on stdout")]
At = Annotated[str | None, typer.Option("--at", metavar="TIME", help='simulated time, s or "1500 ms"; at once without')]


@app.command()
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
    from haploop.tools.run import run_scene
    from haploop.tools.view import viewing

    rate = pace or ("1" if view else "free")
    with viewing(view, in_process) as announced:
        run_scene(scene, set or [], out, in_process, rate, plugin or [], tcp, keys, json, announced)


@app.command()
def check(
    scene: Annotated[Path | None, typer.Argument(help="scene file (TOML)", show_default=False)] = None,
    set: Set = None,
    plugin: Plugin = None,
    schema: Annotated[bool, typer.Option("--schema", help="print the JSON Schema of scenes instead")] = False,
    json: Json = False,
) -> None:
    """Say everything that is wrong with a scene, or that nothing is; start nothing."""
    from haploop.tools.scenes import check_scene, print_schema

    if schema:
        print_schema(plugin or [])
    elif scene is None:
        raise typer.BadParameter("A scene file was expected, or --schema.")
    else:
        check_scene(scene, set or [], plugin or [], json)


@app.command()
def explain(scene: Scene, set: Set = None, plugin: Plugin = None, json: Json = False) -> None:
    """Show what a scene comes to: bodies, states, what happens in which order, and what each effect costs."""
    from haploop.tools.explain import explain_scene

    explain_scene(scene, set or [], plugin or [], json)


@app.command()
def plugins(plugin: Plugin = None, json: Json = False) -> None:
    """List the dissipation elements with their parameters."""
    from haploop.tools.scenes import list_plugins

    list_plugins(plugin or [], json)


@app.command()
def status(run: Run = None, json: Json = False) -> None:
    """Show the live runs: every node, its tick, its lag, whom it waits for, what it skipped."""
    from haploop.tools.live import show_status

    show_status(run, json)


def _ask(run_id: str | None, json: bool, verb: str, **arguments: Any) -> None:
    from haploop.tools.live import command

    command(run_id, json, verb, arguments)


@app.command()
def pause(run: Run = None, json: Json = False) -> None:
    """Stand still at the next tick that can."""
    _ask(run, json, "pause")


@app.command()
def resume(run: Run = None, json: Json = False) -> None:
    """Go on after a pause."""
    _ask(run, json, "resume")


@app.command()
def step(ticks: Annotated[int, typer.Argument(help="control ticks")] = 1, run: Run = None, json: Json = False) -> None:
    """Go on for some ticks, then stand still."""
    _ask(run, json, "step", ticks=ticks)


@app.command()
def pace(
    rate: Annotated[str, typer.Argument(help="free, or simulated seconds per second", show_default=False)],
    run: Run = None,
    json: Json = False,
) -> None:
    """Go on at another pace."""
    from haploop.tools.live import pace_of

    _ask(run, json, "pace", pace=pace_of(rate))


@app.command()
def stop(run: Run = None, json: Json = False) -> None:
    """End the run in order, with a summary of what ran."""
    _ask(run, json, "stop")


@app.command()
def swap(
    kind: Annotated[str, typer.Argument(help='kind of element, or "none" to remove', show_default=False)],
    parameters: Annotated[list[str] | None, typer.Argument(metavar="[KEY=VALUE]...", show_default=False)] = None,
    element: Annotated[int, typer.Option(help="which element; one past the end adds one")] = 0,
    at: At = None,
    reload: Annotated[bool, typer.Option("--reload", help="load the kind's --plugin file anew first")] = False,
    run: Run = None,
    json: Json = False,
) -> None:
    """Replace a dissipation element of a running loop."""
    from haploop.tools.live import assignments, seconds

    table = {"kind": kind, **assignments(parameters or [])}
    _ask(run, json, "swap", swap=table, element=element, at=seconds(at), reload=reload)


@app.command(name="set")
def set_(
    parameters: Annotated[list[str], typer.Argument(metavar="KEY=VALUE...", show_default=False)],
    at: At = None,
    run: Run = None,
    json: Json = False,
) -> None:
    """Change numbers of a running loop: wall.stiffness, wall.position, dissipation.0.mass ..."""
    from haploop.tools.live import assignments, seconds

    _ask(run, json, "set", set=assignments(parameters), at=seconds(at))


@app.command()
def attach(
    what: Annotated[str, typer.Argument(help="logger, print or plotjuggler", show_default=False)],
    out: Annotated[Path | None, typer.Option(help="directory of the attached logger [runs/RUN-TIME]")] = None,
    port: Annotated[
        int | None, typer.Option(min=0, max=65535, help="of this machine, for PlotJuggler; 0: any free one [9872]")
    ] = None,
    run: Run = None,
) -> None:
    """Join a running loop: with a second logger, to show it as a live table, or to pass it on to PlotJuggler.

    The logger holds the loop up rather than miss anything; the others never do, and say what they skipped.
    """
    from haploop.tools.attach import attach_to

    attach_to(what, out, run, port)


@app.command()
def view(
    run: Annotated[str | None, typer.Option("--run", metavar="ID", help="which run to show first [the newest]")] = None,
    port: Annotated[int, typer.Option(min=0, max=65535, metavar="PORT", help="of this machine; 0: any free one")] = 0,
    since: Annotated[str, typer.Option(metavar="start|now", help="with what was logged before, or without")] = "start",
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="open the page")] = True,
    led: Annotated[bool, typer.Option("--led", hidden=True)] = False,
) -> None:
    """Look at runs of this machine in the browser as they go, and steer them; until Ctrl-C."""
    from haploop.tools.view import view as show

    show(run, port, since, browser, led)


@app.command()
def plot(directory: Directory) -> None:
    """Draw a run, or the map of a sweep as far as it goes; the last line names the figure's file."""
    from haploop.tools.scenes import plot_directory

    plot_directory(directory)


@app.command()
def replay(directory: Directory, json: Json = False) -> None:
    """Repeat a run from its own log and say whether every bit agreed."""
    from haploop.tools.replay import replay_run

    replay_run(directory, json)


@app.command()
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
    from haploop.tools.export import export_run

    export_run(directory, to, out, topics, force)


@app.command()
def cost(
    scenes: Annotated[
        list[Path] | None, typer.Argument(metavar="[SCENE]...", help="scene files [the accuracy scenes]")
    ] = None,
    rates: Annotated[str, typer.Option(help="plant rates, Hz")] = "1k,2k,5k,10k,20k,50k,100k",
    methods: Annotated[str | None, typer.Option(help="integrators, comma-separated [all]")] = None,
    out: Annotated[Path, typer.Option(help="directory; what it holds is not measured again")] = Path("runs/cost"),
    tolerance: Annotated[float, typer.Option(help="RMS error the advice is for, m")] = 1e-6,
    repeats: Annotated[int, typer.Option(help="of each time")] = 20,
    processes: Annotated[bool, typer.Option("--processes/--no-processes", help="time runs as processes too")] = True,
    json: Json = False,
) -> None:
    """Measure what accuracy costs in time: error and time of every method at every plant rate, and advice.

    Can be stopped; the same command goes on.
    """
    from haploop.tools.cost import Request
    from haploop.tools.cost import cost as measure

    measure(Request(scenes or [], methods, rates, out, tolerance, repeats, processes), json)


@app.command()
def sweep(
    sweep: Annotated[Path, typer.Argument(help="sweep file (TOML)", show_default=False)],
    set: Set = None,
    out: Annotated[
        Path | None, typer.Option(help="directory; one that holds this sweep goes on [runs/SWEEP-TIME]")
    ] = None,
    workers: Annotated[int | None, typer.Option(help="processes [one a core]", show_default=False)] = None,
    dask: Annotated[str | None, typer.Option(metavar="ADDRESS", help="scheduler of a Dask cluster to run on")] = None,
    jax: Annotated[bool, typer.Option("--jax", help="run compiled, on CPU or GPU, within a tolerance")] = False,
    plugin: Plugin = None,
    json: Json = False,
) -> None:
    """Run a scene over one to three axes into a table (Parquet); with [bisect], find where its verdict changes.

    Can be stopped or killed; the same command with the same --out goes on. `haploop plot DIR` draws the map.
    """
    from haploop.tools.sweep.command import Request
    from haploop.tools.sweep.command import sweep as run_sweep

    run_sweep(Request(sweep, set or [], out, workers, dask, jax, plugin or []), json)


@app.command()
def dissipate(
    recording: Annotated[Path, typer.Argument(help="CSV, TSV, directory of a run or its log", show_default=False)],
    damping: Annotated[list[str] | None, typer.Option(metavar="B", help='damping, N s/m or "0.0027 N s/mm"')] = None,
    mass: Annotated[list[str] | None, typer.Option(metavar="M", help="bi- and unidirectional inertia, kg")] = None,
    element: Annotated[
        list[str] | None, typer.Option(metavar="ELEMENT", help='any other: "KIND KEY=VALUE ..."')
    ] = None,
    position: Annotated[
        str | None, typer.Option(metavar="COLUMN", help="name or number from 1 [x or position]")
    ] = None,
    time: Annotated[str | None, typer.Option(metavar="COLUMN", help="of the time [t, time or timestamp]")] = None,
    rate: Annotated[float | None, typer.Option(min=1e-6, max=1e9, help="samples a second, in place of times")] = None,
    velocity: Annotated[str | None, typer.Option(metavar="COLUMN", help="recorded, not estimated")] = None,
    acceleration: Annotated[str | None, typer.Option(metavar="COLUMN", help="recorded, not estimated")] = None,
    unit: Annotated[
        str | None, typer.Option(help="of length, such as mm, or metres a count [the header's (unit), m]")
    ] = None,
    time_unit: Annotated[str | None, typer.Option(help="such as ms [the header's (unit), s]")] = None,
    wall: Annotated[str | None, typer.Option(metavar="POSITION", help="elements act beyond it only, m or text")] = None,
    occupies: Annotated[str, typer.Option(metavar="below|above", help="which side of it the wall is")] = "below",
    delay: Annotated[str | None, typer.Option(metavar="TIME", help="age of a force as it acts [0; a run's]")] = None,
    set: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="velocity.cutoff, acceleration.estimator ...")
    ] = None,
    plugin: Plugin = None,
    out: Annotated[Path | None, typer.Option(help="the figure's file [beside the recording]")] = None,
    json: Json = False,
) -> None:
    """Tell what elements would have dissipated on a motion that was recorded, which they do not change.

    One pass in flat memory. The last line names the figure's file.
    """
    from haploop.tools.dissipate.command import Request
    from haploop.tools.dissipate.command import dissipate as book
    from haploop.tools.dissipate.setting import Asked
    from haploop.tools.dissipate.text_recording import Layout
    from haploop.tools.live import seconds

    asked = Asked(damping or [], mass or [], element or [], wall, occupies, set or [])
    layout = Layout(position, time, rate, velocity, acceleration, unit, time_unit)
    book(Request(recording, asked, layout, seconds(delay, "--delay"), plugin or [], out), json)


def main() -> None:
    """Entry point. Exit status: 0 done, 1 the run failed, 2 wrong usage or scene."""
    app()


if __name__ == "__main__":
    main()
