"""``haploop replay``: is a run what its log says?"""

from __future__ import annotations

from pathlib import Path

from haploop.tools.cli.exit_codes import FAILED, WRONG_USE, leave, plain_errors, print_json


def replay_run(directory: Path, as_json: bool) -> None:
    """Repeat a run from its log; exit status 1 when a bit differs."""
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
