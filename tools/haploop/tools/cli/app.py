"""The command line: every command in the order of the help; what a command works with is imported when it is called."""

from __future__ import annotations

import typer

from haploop.tools.cli.bundled import new, scenes
from haploop.tools.cli.explain import explain
from haploop.tools.cli.live_commands import attach, keys, pace, pause, resume, set_, status, step, stop, swap, undo
from haploop.tools.cli.run_command import run
from haploop.tools.cli.scenes import check, export, judge, plot, plugins, replay
from haploop.tools.cli.study_commands import advise, dissipate, paper, sweep
from haploop.tools.cli.view import view
from haploop.tools.cost.command import cost
from haploop.tools.fmu.command import export_fmu

app = typer.Typer(
    help="Simulate a haptic loop: a device in a hand, a sampled controller with a virtual wall, a line with delay.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
# In the order in which the help lists them.
for command in (
    run, scenes, new, check, explain, plugins, status, pause, resume, step, pace, stop, swap, set_, undo, attach, view,
    keys, plot, replay, judge, export, export_fmu, cost, sweep, dissipate, paper, advise,
):  # fmt: skip
    app.command(command.__name__.rstrip("_").replace("_", "-"))(command)
