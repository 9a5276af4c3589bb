"""The command line: every command in the order of the help; a command imports what it works with when it is called."""

from __future__ import annotations

from typing import Annotated

import typer

from haploop.tools.cli.explain import explain
from haploop.tools.cli.join import join
from haploop.tools.cli.live_commands import attach, keys, pace, pause, resume, set_, status, step, stop, swap, undo
from haploop.tools.cli.recorded import export, judge, replay
from haploop.tools.cli.run_command import run
from haploop.tools.cli.runs_beside import diff, plot
from haploop.tools.cli.scenes import check, new, plugins, scenes
from haploop.tools.cli.study_commands import advise, dissipate, paper, sweep
from haploop.tools.cli.view import view
from haploop.tools.compare.command import compare
from haploop.tools.cost.command import cost
from haploop.tools.demo.command import demo
from haploop.tools.fmu.command import export_fmu

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _tell_version(is_asked: bool) -> None:
    if is_asked:
        from importlib.metadata import version

        print(f"haploop {version('haploop')}")
        raise typer.Exit


@app.callback()
def haploop(
    version: Annotated[
        bool, typer.Option("--version", callback=_tell_version, is_eager=True, help="print the version and exit")
    ] = False,
) -> None:
    """Simulate a haptic loop: a device in a hand, a sampled controller with a virtual wall, a line with delay."""


# In the order in which the help lists them.
for command in (
    demo, run, scenes, new, check, explain, plugins, status, pause, resume, step, pace, stop, swap, set_, undo, attach,
    view, keys, join, plot, diff, replay, judge, export, export_fmu, cost, sweep, dissipate, paper, advise,
    compare,
):  # fmt: skip
    settings = {"ignore_unknown_options": True} if command in (step, pace) else None  # -1 is a number there
    app.command(command.__name__.rstrip("_").replace("_", "-"), context_settings=settings)(command)
