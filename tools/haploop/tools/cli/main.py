"""The start of the command line: light, so that Ctrl-C and SIGTERM are a sentence from the first moment on."""

from __future__ import annotations

import os
import signal
import sys

from haploop.tools.cli.interrupt import SENTENCE, LeavingAtOnce

# The status with which typer leaves at Ctrl-C, without a word.
_OF_TYPER = 130


def main() -> None:
    """Runs the command line. Exit status: 0 done, 1 the run failed or was interrupted, 2 wrong usage or scene."""
    with LeavingAtOnce():
        from haploop.launch.processes.one_thread import ask_for_one_thread

        ask_for_one_thread(os.environ)
        from haploop.tools.cli.app import app
    try:
        signal.signal(signal.SIGTERM, signal.default_int_handler)
        app()
    except (KeyboardInterrupt, SystemExit) as error:
        if isinstance(error, SystemExit) and error.code != _OF_TYPER:
            raise
        print(SENTENCE if isinstance(error, KeyboardInterrupt) else "Interrupted.", file=sys.stderr)
        sys.exit(1)
