"""The summary of a run: the figures that people and programs ask for."""

from __future__ import annotations

import contextlib
import json
import math
import platform
import zlib
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from haploop.logger.books.balance import BooksState, moved_J, residual_J, stored_J, total_J
from haploop.logger.books.ideal_wall import DISSIPATED
from haploop.logger.log import LogError
from haploop.logger.verdict.measures import NO_SWING, UNTOLD, WINDOW_S, RunMeasures
from haploop.protocol.files import read_text
from haploop.protocol.scene.scene import Scene
from haploop.protocol.transport.machine import MACHINE, Machine

if TYPE_CHECKING:
    from haploop.controller.active_elements import Description

SUMMARY = "summary.json"
# A summary as summary.json holds it, or an entry of it.
Summary = dict[str, Any]
# Entries that differ between two runs of the same scene.
OF_THE_MACHINE = ("wall_s", "real_time_factor", "lateness", "versions")
# Runs of processes that are longer than this, in simulated seconds, are not repeated for their verdict.
REPEATED_S = 60.0
_FINITE = (str, int, bool)


class Account(NamedTuple):
    """The book of one element with one set of parameters, at work from ``from_tick`` up to ``to_tick``."""

    book: int
    kind: str
    parameters: dict[str, float | str]
    from_tick: int
    to_tick: int


def note_accounts(accounts: dict[int, Account], elements: Iterable[Description], to_tick: int) -> None:
    """Records by book that these elements, as telemetry describes them, have been at work up to a tick."""
    for element in elements:
        book, first = element["book"], element["from_tick"]
        known = accounts.get(book) or Account(book, element["kind"], element["parameters"], first, to_tick)
        accounts[book] = known._replace(to_tick=to_tick)


def versions() -> dict[str, str]:
    """Returns the versions of the software that the run was made with."""
    return {**_packages(), "python": platform.python_version()}


@cache
def _packages() -> dict[str, str]:
    """Returns the versions of packages; each is searched for among all installed ones, which takes 1 ms or more."""
    from importlib.metadata import version  # which takes a tenth of the logger's start

    return {name: version(name) for name in ("haploop", "numpy", "pyzmq", "msgpack")}


def energy(books: BooksState, accounts: Sequence[Account], has_wall: bool) -> Summary:
    """Returns the ``energy`` entry: the total of every book so far; arrays over the members if the books are a batch's.

    The wall's leak is its true book, less what an ideal wall would hold now (``ideal_J``, relative to the start),
    without what changes of the wall in contact put into it (``changes_J``), and less what its law takes
    (``dissipated_J``).
    """

    def pair(account: str | int) -> Summary:
        return {f"{side}_J": total_J(books, f"{account}.{side}") for side in ("sampled", "true")}

    wall = pair("wall")
    if has_wall:
        steps = [*(total_J(books, name) for name in ("ideal", "sampled_and_held", "quantised")), wall["true_J"]]
        causes = ("sampling_and_hold_J", "quantisation_J", "delay_J")
        parts = {cause: after - before for cause, before, after in zip(causes, steps[:-1], steps[1:], strict=True)}
        wall |= {"ideal_J": steps[0] + books.wall_changes_J, "changes_J": books.wall_changes_J}
        if DISSIPATED in books.names:
            wall |= {f"{DISSIPATED}_J": (lost := total_J(books, DISSIPATED))}
            steps[0] = steps[0] + lost
            parts["sampling_and_hold_J"] = steps[1] - steps[0]
        wall |= {"leak": {"total_J": steps[-1] - steps[0], **parts}}
    beside = [name for name in books.names if name.endswith(("_heat", "_work")) or name == "actuator"]
    return {
        "elements": [
            {"kind": kind, "parameters": parameters, "from_tick": first, "to_tick": end, **pair(book)}
            for book, kind, parameters, first, end in accounts
        ],
        "wall": wall,
        **{f"{name}_J": total_J(books, name) for name in beside},
        "stored_at_start_J": books.stored_at_start_J,
        "stored_J": stored_J(books),
        "moved_J": moved_J(books),
        "residual_J": residual_J(books),
    }


def outcome(
    scene: Scene, ran: Summary, measures: RunMeasures, diverged: str | None, changed_s: float | None = None
) -> Summary:
    """Returns the entries of ``summary.json`` except energies: what was run, the verdict and what it rests on.

    Args:
        ran: duration_s, ticks, steps, ended, final, lost and other counts, trajectory_sha256.
        diverged: why the plant itself ended the run, or None.
        changed_s: when the loop was last changed within the window, or None.
    """
    verdict = measures.verdict(diverged, measures.untold(ran["ticks"], ran["ended"], changed_s))
    if verdict.word == NO_SWING and ran["duration_s"] < WINDOW_S:  # too short to see a swing
        verdict = verdict._replace(rule=f"{UNTOLD['short']} {verdict.rule}")
    if changed_s is not None:
        measures = measures.of_two_loops(changed_s)
    return {
        "title": scene.title,
        "seed": scene.seed,
        **ran,
        "verdict": verdict.word,
        "verdict_rule": verdict.rule,
        "extremes": measures.extremes._asdict(),
        "window": measures.window.figures._asdict(),
    }


def awaits_verdict(scene: Scene, summary: Summary) -> bool:
    """Tells whether the summary of a run of processes has its window's word only until the launcher has judged the run.

    A loop is judged if its scene asks for that, and its run ended by itself and was not too long to be repeated. A loop
    with a foreign plant or controller is not judged: copies of haploop's own would say nothing about it.
    """
    if "programs" in summary:
        return False
    by_itself = summary["ended"] in ("done", "stopped", "diverged") and 0.0 < summary["duration_s"] <= REPEATED_S
    return scene.run.verdict == "pushed" and by_itself and "stability" not in summary


# Key of the checksum in summary.json: CRC-32 of everything else in it.
_CHECKSUM = "checksum"


def write(summary: Summary, path: Path, machine: Machine = MACHINE) -> None:
    """Writes a summary as JSON, in one piece: a reader never sees half a file. Non-finite numbers become null."""
    temporary = path.with_suffix(".part")
    content = finite(summary)
    text = json.dumps({**content, _CHECKSUM: _checksum(content)}, indent=2)
    try:
        machine.write(temporary, f"{text}\n".encode())
        machine.rename(temporary, path)
    except OSError:
        with contextlib.suppress(OSError):
            temporary.unlink()
        raise


def _checksum(content: Summary) -> str:
    return f"{zlib.crc32(json.dumps(content, sort_keys=True).encode()):08x}"


def read(path: Path) -> Summary:
    """Returns what ``write`` wrote; raises LogError where the file cannot be read, or holds something else."""
    why = "it is damaged"
    try:
        summary = json.loads(read_text(path))
        told = summary.pop(_CHECKSUM, None)
        if told in (None, _checksum(summary)):
            return summary
        why = "it does not match its checksum"
    except OSError as error:
        why = (error.strerror or "it cannot be read").rstrip(".")
    except (ValueError, RecursionError, AttributeError, TypeError) as error:
        raise LogError(f"The summary {path} is not a JSON object that haploop wrote, or {why}.") from error
    raise LogError(f"The summary {path} cannot be used: {why}.")


def misfit(found: Any, expected: Any, at: str = "") -> str:
    """Returns the dotted key of the first entry of a summary that is not of the expected type; "" if there is none.

    Args:
        expected: a type or several, a mapping of such by key, or a list of the one that every entry must be.
    """
    if isinstance(expected, Mapping):
        if not isinstance(found, dict):
            return at or "the whole"
        inner = ((found.get(key, ...), one, key) for key, one in expected.items())
    elif isinstance(expected, list):
        if not isinstance(found, list):
            return at
        inner = ((entry, expected[0], str(number)) for number, entry in enumerate(found))
    else:
        return "" if isinstance(found, expected) else at
    return next((key for value, one, name in inner if (key := misfit(value, one, f"{at}.{name}".lstrip(".")))), "")


def write_summary(summary: Summary, out: Path, machine: Machine = MACHINE) -> None:
    """Writes the summary into the directory of its run; raises LogError where that fails."""
    try:
        write(summary, out / SUMMARY, machine)
    except OSError as error:
        raise LogError(f"The summary {out / SUMMARY} could not be written: {error.strerror}.") from error


def finite(value: Any) -> Any:
    """Returns the same structure with None for every number that JSON cannot hold."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {
            key: entry
            if (kind := entry.__class__) in _FINITE or (kind is float and math.isfinite(entry))
            else finite(entry)
            for key, entry in value.items()
        }
    return [finite(entry) for entry in value] if isinstance(value, list | tuple) else value
