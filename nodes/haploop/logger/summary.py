"""The summary of a run: the figures people and programs ask for."""

from __future__ import annotations

import contextlib
import json
import math
import platform
from importlib.metadata import version
from pathlib import Path
from typing import Any

from haploop.logger.books.books import BooksState, moved_J, residual_J, stored_J, total_J
from haploop.logger.verdict.verdict import RunMeasures

# A summary as summary.json holds it.
Summary = dict[str, Any]
# Entries that differ between two runs of the same scene.
OF_THE_MACHINE = ("wall_s", "real_time_factor", "versions")
_FINITE = (str, int, bool)


def versions() -> dict[str, str]:
    """Returns the versions of what the run was made with."""
    packages = {name: version(name) for name in ("haploop", "numpy", "pyzmq", "msgpack")}
    return {**packages, "python": platform.python_version()}


def energy(books: BooksState, accounts: list[dict[str, Any]], has_wall: bool) -> dict[str, Any]:
    """Returns the ``energy`` entry: every book as it stands; arrays over the members where the books are of a batch.

    The wall's leak is its true book less what an ideal spring would hold now (``ideal_J``, against the start), but for
    what changes of the wall in contact put into that spring (``changes_J``).
    """

    def total(name: str) -> Any:
        return total_J(books, name)

    elements = []
    for account in accounts:
        pair = {"sampled_J": total(f"{account['book']}.sampled"), "true_J": total(f"{account['book']}.true")}
        elements.append({key: value for key, value in account.items() if key != "book"} | pair)
    wall: dict[str, Any] = {"sampled_J": total("wall.sampled"), "true_J": total("wall.true")}
    if has_wall:
        steps = [total("ideal"), total("sampled_and_held"), total("quantised"), wall["true_J"]]
        causes = ("sampling_and_hold_J", "quantisation_J", "delay_J")
        parts = {cause: after - before for cause, before, after in zip(causes, steps[:-1], steps[1:], strict=True)}
        wall |= {"ideal_J": steps[0] + books.wall_changes_J, "changes_J": books.wall_changes_J}
        wall |= {"leak": {"total_J": steps[-1] - steps[0], **parts}}
    beside = [name for name in books.names if name.endswith(("_heat", "_work")) or name == "actuator"]
    plants = {f"{name}_J": total(name) for name in beside if name != "hand_work"}
    return {
        "elements": elements,
        "wall": wall,
        "hand_work_J": total("hand_work"),
        **plants,
        "stored_J": stored_J(books),
        "moved_J": moved_J(books),
        "residual_J": residual_J(books),
    }


def summary(
    scene: dict[str, Any],
    ran: dict[str, Any],
    measures: RunMeasures,
    books: BooksState,
    accounts: list[dict[str, Any]],
    diverged: str | None,
) -> dict[str, Any]:
    """Returns all entries of ``summary.json``.

    Args:
        scene: the resolved scene.
        ran: entries on the run: duration_s, ticks, steps, wall_s, ended, final, lost and what else was counted,
            trajectory_sha256.
        measures, books: as they stand at the end.
        accounts: every element's book: kind, parameters, from_tick, to_tick.
        diverged: why the plant ended by itself, or None.
    """
    wall_s = ran.pop("wall_s")
    factor = ran["duration_s"] / wall_s if wall_s else 0.0
    ran |= {"versions": versions(), "wall_s": wall_s, "real_time_factor": factor}
    return outcome(scene, ran, measures, diverged) | {"energy": energy(books, accounts, "wall" in scene)}


def outcome(scene: dict[str, Any], ran: dict[str, Any], measures: RunMeasures, diverged: str | None) -> dict[str, Any]:
    """Returns the entries of the summary but for energies: ``ran``, the verdict and what it rests on."""
    verdict = measures.verdict(diverged)
    return {
        "title": scene["title"],
        "seed": scene["seed"],
        **ran,
        "verdict": verdict.word,
        "verdict_rule": verdict.rule,
        "extremes": measures.extremes._asdict(),
        "window": measures.window.figures,
    }


def write(summary: dict[str, Any], path: Path) -> None:
    """Writes as JSON, in one piece: a reader never sees half a file. Numbers that are not finite become null."""
    temporary = path.with_suffix(".part")
    try:
        temporary.write_text(json.dumps(finite(summary), indent=2) + "\n", encoding="utf-8")
        temporary.replace(path)
    except OSError:
        with contextlib.suppress(OSError):
            temporary.unlink()
        raise


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
