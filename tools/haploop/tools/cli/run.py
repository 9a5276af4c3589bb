"""Running a scene with progress on the way, and repeating a run from its log."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from haploop.tools.cli.exit_codes import FAILED, WRONG_USE, leave, plain_errors, print_json
from haploop.tools.cli.options import parse_pace
from haploop.tools.cli.scenes import print_notes

if TYPE_CHECKING:
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
    from haploop.tools.render.progress import ProgressLine
    from haploop.tools.render.report import print_summary

    with plain_errors():
        rate = _pace(pace, in_process)
        transport = _transport(tcp, keys, in_process)
        prepared = prepare(scene_path, overrides, plugins, out)
        print_notes(prepared.scene)
        title, duration_s = prepared.scene["title"], prepared.scene["duration"]
        from haploop.launch.spec import RunFailed

        try:
            with ProgressLine(title, duration_s) as line:

                def told(run_id: str) -> None:
                    line.announce(run_id)
                    viewing.on_started(run_id)

                summary = run(
                    prepared,
                    in_process=in_process,
                    pace=rate,
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


def _pace(text: str, in_process: bool) -> float:
    """Returns the pace: infinite, or a positive number."""
    rate = parse_pace(text)
    if rate == "free":
        return math.inf
    if in_process:
        leave("--pace needs the clock of a run as processes; leave out --in-process.", WRONG_USE)
    return rate


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
