"""The start of the command line: light, so that Ctrl-C is a sentence from the first moment on."""

from __future__ import annotations

import os
import sys

# The status with which typer leaves at Ctrl-C, without a word.
_OF_TYPER = 130


def main() -> None:
    """Runs the command line. Exit status: 0 done, 1 the run failed or was interrupted, 2 wrong usage or scene."""
    try:
        from haploop.launch.processes.one_thread import ask_for_one_thread

        ask_for_one_thread(os.environ)
        from haploop.tools.cli.app import app
        from haploop.tools.cli.options import FAILED, WRONG_USE, leave

        for word in sys.argv[1:]:
            if "\0" in word or (not word.isascii() and any("\ud800" <= letter <= "\udfff" for letter in word)):
                leave(f"Every argument, names of files too, must be UTF-8 text, but {word!r} was given.", WRONG_USE)
        try:
            app()
        except OSError as error:  # one that no command has words of its own for
            leave(f"{error.filename or 'A file'} cannot be used: {error.strerror or error}.", FAILED)
    except (KeyboardInterrupt, SystemExit) as error:
        if isinstance(error, SystemExit) and error.code != _OF_TYPER:
            raise
        print("Interrupted.", file=sys.stderr)
        sys.exit(1)
