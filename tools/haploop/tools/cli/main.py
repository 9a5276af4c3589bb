"""The start of the command line: light, so that Ctrl-C and SIGTERM give a sentence from the first moment on."""

from __future__ import annotations

import os
import signal
import sys
from copy import copy
from io import TextIOWrapper

from haploop.protocol.installed import PluginError
from haploop.tools.command.interrupt import SENTENCE, SIGNALS, TYPE_CHECKING, LeavingAtOnce

if TYPE_CHECKING:
    from haploop.launch.processes.early import Started

# The status with which typer exits on Ctrl-C, without a message.
_OF_TYPER = 130


def main() -> None:
    """Runs the command line. Exit status: 0 done, or stopped in order; 1 failed or interrupted; 2 wrong use."""
    early: dict[str, Started] = {}
    before = {number: signal.getsignal(number) for number in SIGNALS}
    try:
        with (leaving := LeavingAtOnce(early)):
            _print_anything()
            from haploop.launch.one_thread import ask_for_one_thread

            ask_for_one_thread(os.environ)
            if sys.argv[1:2] == ["run"]:  # a command that starts no processes need not load this
                from haploop.launch.processes.early import start_early

                start_early(sys.argv[1:], early)
            os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")  # a search through all packages for none
            from haploop.tools.cli.app import app

            # To call the one command asked for, typer would build every command it has, a fifth of the time it takes.
            asked = copy(app)
            asked.registered_commands = [
                command for command in app.registered_commands if command.name in sys.argv[1:2]
            ] or app.registered_commands
        leaving.from_the_second_on()
        _refuse_what_is_no_text(sys.argv[1:])
        asked(obj={"early": early})  # typer adds entries of its own to it
    except OSError as error:  # one for which no command has its own message
        what = error.filename or "What this command prints goes to a place that"
        print(f"{what} cannot be used: {error.strerror or error}.", file=sys.stderr)
        sys.exit(1)
    except PluginError as error:  # met where a module is loaded, before a command has begun
        print(error, file=sys.stderr)
        sys.exit(2)
    except (KeyboardInterrupt, SystemExit) as error:
        if isinstance(error, SystemExit) and error.code != _OF_TYPER:
            raise
        _heed_no_more_interrupts()
        print(SENTENCE if isinstance(error, KeyboardInterrupt) else "Interrupted.", file=sys.stderr)
        sys.exit(1)
    finally:
        if early:
            _heed_no_more_interrupts()
        for process in early.values():  # those that no run has taken over
            process.end()
        for number, handler in before.items():
            signal.signal(number, handler)


def _heed_no_more_interrupts() -> None:
    """Lets this process come to its end, which is near, with the status that it has."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)


def _print_anything() -> None:
    """Makes standard output and error write ? for a letter that the terminal's encoding does not have."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper) and stream.errors == "strict":
            stream.reconfigure(errors="replace")


def _refuse_what_is_no_text(words: list[str]) -> None:
    """Exits with a sentence if an argument is not UTF-8 text, since no file and no message of a run could hold it."""
    for word in words:
        if "\0" in word or (not word.isascii() and any("\ud800" <= letter <= "\udfff" for letter in word)):
            print(f"Every argument, file names included, must be UTF-8 text, but {word!r} was given.", file=sys.stderr)
            sys.exit(2)
