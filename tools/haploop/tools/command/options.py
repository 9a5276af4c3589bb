"""Arguments and options that several commands share, and how their texts are read."""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any, Literal, NoReturn

import typer


def complete(folder: str) -> Callable[[str], list[str]]:
    """Returns a shell completion: the names of what comes with haploop in a folder, and files of one's own."""

    def completed(begun: str) -> list[str]:
        from glob import escape, glob

        from haploop.launch.scene.bundled import bundled

        own = [f"{path}/" if Path(path).is_dir() else path for path in sorted(glob(f"{escape(begun)}*"))]  # noqa: PTH207
        names = [name for name in bundled(folder) if name.startswith(begun)]
        return [*names, *(path for path in own if path.endswith(("/", ".toml")))]

    return completed


_INSTEAD = "Note: {0} is your own {1}, used in place of the one that comes with haploop."


def told(folder: str) -> Callable[[Any], Any]:
    """Returns a callback that notes on stderr when a name means one's own file although one comes with haploop."""

    def as_given(name: Any) -> Any:
        from haploop.launch.scene.bundled import taken_instead

        if name is not None and (file := taken_instead(str(name), folder)):
            print(_INSTEAD.format(name, file), file=sys.stderr)
        return name

    return as_given


_A_HAND = "a hand that comes with haploop, a file with one, or none"
SceneFile = Annotated[
    Path,
    typer.Argument(
        help="scene file (TOML)", show_default=False, autocompletion=complete("scenes"), callback=told("scenes")
    ),
]
SweepFile = Annotated[
    Path,
    typer.Argument(
        help="sweep file (TOML)", show_default=False, autocompletion=complete("sweeps"), callback=told("sweeps")
    ),
]
Device = Annotated[
    str,
    typer.Argument(
        help="a device that comes with haploop, a file with one, or a scene",
        show_default=False,
        autocompletion=complete("devices"),
    ),
]
Hand = Annotated[
    str | None,
    typer.Option(metavar="HAND", help=_A_HAND, autocompletion=complete("hands")),
]
Delay = Annotated[str | None, typer.Option(metavar="TIME", help='round-trip delay, s or "2 ms"')]
Estimator = Annotated[
    str | None, typer.Option(metavar="NAME", help="difference, window, foaw, kalman or accelerometer")
]
Directory = Annotated[Path, typer.Argument(help="directory of a run", show_default=False)]
Set = Annotated[list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="change a key of the scene")]
Plugin = Annotated[
    list[Path] | None,
    typer.Option("--plugin", metavar="FILE", help="Python file with elements, walls, estimators or hand forces"),
]
Run = Annotated[str | None, typer.Option("--run", metavar="ID", help="which run, if several are live")]
Json = Annotated[bool, typer.Option("--json", help="one JSON object on stdout")]


def parse_assignments(texts: list[str]) -> dict[str, Any]:
    """Returns ``KEY=VALUE`` words as a table; a value is TOML where it parses, else text ("0.15 N/mm")."""
    from haploop.launch.scene.reading.layers import split_assignment

    pairs = [split_assignment(text) for text in texts]
    if None in pairs:
        leave(f"KEY=VALUE was expected, but {texts[pairs.index(None)]!r} was given.", WRONG_USE)
    return dict(pair for pair in pairs if pair)


def parse_pace(text: str) -> float | Literal["free"]:
    """Returns ``free``, or a number of simulated seconds per second."""
    from haploop.launch.clock.pace import PaceError, pace_of

    if text == "free":
        return "free"
    given: float | str = text
    with suppress(ValueError):
        given = float(text.removesuffix("x"))
    try:
        return pace_of(given)
    except PaceError as error:
        leave(f"{error} 1 is real time.", WRONG_USE)


def parse_ticks(text: str) -> int:
    """Returns a whole number of ticks; the run knows how many are allowed."""
    try:
        return int(text)
    except ValueError:
        leave(f"A step lasts a whole number of ticks, such as 100, but {text[:40]!r} was given.", WRONG_USE)


def parse_seconds(text: str | None, option: str = "--at") -> float | None:
    """Returns a time in s, given in seconds or with its unit; None if none is given."""
    if text is None:
        return None
    with suppress(ValueError):
        return float(text)
    from haploop.launch.scene.number import TIME

    try:
        return float(TIME.read(text))
    except ValueError as error:
        leave(f"{option} must be a time such as 1.5 or '1500 ms', but {text!r} was given: {error}", WRONG_USE)


FAILED, WRONG_USE = 1, 2
_NO_NUMBA = "Note: numba is not installed; with it this takes a fraction of the time: pip install 'haploop[numba]'."
# Parts of a log that end within this time of each other, s, are said to end together.
_APART_S = 0.01
_LOGGED = "What was logged is in {0}: {1}. The books end where the first of these does."


def note_without_numba() -> None:
    """Notes on stderr that many runs would take less time with numba, where it is not installed."""
    from importlib.util import find_spec

    if find_spec("numba") is None:
        print(_NO_NUMBA, file=sys.stderr)


def leave(message: str, status: int) -> NoReturn:
    """Prints a message for people and exits."""
    print(message, file=sys.stderr)
    raise SystemExit(status)


def what_was_logged(directory: Path) -> str:
    """Tells where the log of a failed run is and, if its parts end at different times, until when each was logged."""
    from haploop.logger import stream
    from haploop.logger.log import LogError

    ends: dict[str, float] = {}
    with suppress(LogError, OSError):
        for batch in stream(directory, columns=["timestamp"]):
            if not isinstance(batch.rows, list) and len(batch.log_times_ns):
                ends[batch.topic] = float(batch.rows["timestamp"][-1])
    if not ends or max(ends.values()) - min(ends.values()) < _APART_S:
        return f"What was logged is in {directory}."
    return _LOGGED.format(directory, ", ".join(f"{topic} to {end_s:.3f} s" for topic, end_s in ends.items()))


def print_json(data: Any) -> None:
    """Prints one JSON object on stdout; numbers that are not finite become null."""
    from haploop.logger.summary import finite

    print(json.dumps(finite(data)), flush=True)


@contextlib.contextmanager
def plain_errors() -> Iterator[None]:
    """Turns errors of the lower packages into messages; the exit status is 2 for wrong use, 1 for a run that failed."""
    from haploop.controller.dissipation import ElementError, PluginError
    from haploop.launch.processes.run_directory import CommandRefused, RunNotFound
    from haploop.launch.scene.mistakes import SceneError
    from haploop.launch.spec import NeverBegan, OutputError
    from haploop.logger.log import LogError
    from haploop.protocol.transport.keys import KeysError

    try:
        yield
    except SceneError as error:
        count = len(error.mistakes)
        leave(f"{error}\n{count} mistake{'s' * (count != 1)}; nothing was started.", WRONG_USE)
    except (PluginError, ElementError, OutputError, CommandRefused, RunNotFound, KeysError) as error:
        leave(str(error), WRONG_USE)
    except (LogError, NeverBegan) as error:
        leave(str(error), FAILED)
