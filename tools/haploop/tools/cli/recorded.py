"""The commands on the files of a run; they import what they work with when they are called."""

from __future__ import annotations

import dataclasses
import sys
from contextlib import redirect_stdout, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from haploop.tools.command.given import print_note
from haploop.tools.command.options import FAILED, WRONG_USE, Directory, Json, leave, plain_errors, print_json

if TYPE_CHECKING:
    from haploop.logger.summary import Summary


def replay(directory: Directory, json: Json = False) -> None:
    """Repeat a run from its log and say whether all bits agree."""
    from haploop.launch.runs import replay as runs
    from haploop.protocol.transport.prints import unheard

    with plain_errors(), redirect_stdout(sys.stderr):
        try:
            with unheard():
                result = runs.replay(directory)
        except runs.ReplayError as error:
            leave(str(error), WRONG_USE)
    print_note(result.cut)
    if json:
        half = {"half": result.half, "other": result.other} if result.half else {}
        print_json({"agrees": not result.differences, "differences": result.differences, **half, **result.summary})
    elif result.differences:
        print("\n".join([*result.differences, *filter(None, [result.half, result.other])]))
    elif result.half:
        print(f"Every bit of {result.summary['ticks']} ticks agreed. {result.half} {result.other}".rstrip())
    else:
        print(f"Every bit of {result.summary['steps']} steps agreed: {result.summary['trajectory_sha256']}")
    if result.differences:
        raise SystemExit(FAILED)


def judge(directory: Directory, json: Json = False) -> None:
    """Say whether the loop of a run is stable.

    The run is repeated from its log. Then the hand is held still without noise, pushed hard and softly, and the loop
    is watched for up to 64 s of simulated time: does it come to rest? The verdict is steady, limit-cycle, growing,
    diverged, no-contact or undecided.
    """
    from haploop.launch.runs.replay import ReplayError, demand_own, logged_run, repeatable
    from haploop.launch.runs.run_files import recorded_summary
    from haploop.launch.stability.judge import entries_of, judge_scene, seen_in
    from haploop.logger.log import LogError
    from haploop.logger.verdict.measures import WINDOW_S
    from haploop.protocol.transport.prints import unheard
    from haploop.tools.render.report import finding_table
    from haploop.tools.render.terminal import console

    with plain_errors(), redirect_stdout(sys.stderr):
        try:
            recorded = logged_run(directory)
            print_note(recorded.cut)
            with unheard():
                scene, kinds, events = repeatable(directory, recorded)
                demand_own(recorded, scene)
                finding = judge_scene(scene, kinds, events, thorough=True, causes=True)
                last_s = float(recorded["/controller"]["timestamp"][-1])
                summary: Summary = {}
                with suppress(LogError):  # the log is enough for the verdict, if not for all that is told beside it
                    summary = recorded_summary(directory) or {}
                seen = seen_in(summary.get("window", {}))
                found = entries_of(finding, scene, last_s - min(WINDOW_S, last_s / 2.0), *seen)["stability"]
        except ReplayError as error:
            leave(str(error), WRONG_USE)
    if json:
        print_json(dataclasses.asdict(finding) | {"sentence": finding.sentence(), "provisos": found["provisos"]})
    else:
        console().print(finding_table(finding, found))


def export(
    directory: Annotated[Path, typer.Argument(help="directory of a run, or its log", show_default=False)],
    to: Annotated[str, typer.Option(help="csv, npz, parquet or json-mcap (for Foxglove)", show_default=False)],
    out: Annotated[
        Path | None, typer.Option(help="directory (csv, parquet: one file per channel) or file [beside the log]")
    ] = None,
    topics: Annotated[str | None, typer.Option(help="only these channels, comma-separated [all]")] = None,
    force: Annotated[bool, typer.Option("--force", help="overwrite existing files")] = False,
) -> None:
    """Write a run's log in a format for other programs. Names and units are kept; stdout names the files.

    Memory use does not depend on the length of the log. A missing number, such as an element's before it was swapped
    in, is NaN in npz and parquet, an empty cell in csv, and left out in json-mcap, as are numbers that are not finite.
    """
    from haploop.tools.export.command import export_run

    export_run(directory, to, out, topics, force)
