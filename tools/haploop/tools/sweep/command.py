"""``haploop sweep``: from a sweep file to its table; a sweep that was stopped continues where it was."""

from __future__ import annotations

import contextlib
import math
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from haploop.launch.processes.children import interrupts
from haploop.launch.spec import PLUGINS, OutputError, keep_plugin, kept_name, make_output
from haploop.logger.log import LogError
from haploop.logger.summary import Summary, read, write
from haploop.protocol.amounts import fixed
from haploop.tools.command.options import FAILED, WRONG_USE, leave, note_without_numba, plain_errors, print_json
from haploop.tools.executor.executors import ExecutorError
from haploop.tools.executor.pool import Pool, read_sources
from haploop.tools.machine import machine, versions
from haploop.tools.sweep.engine import Engine, Stopped, SweepProgress, describe_counts
from haploop.tools.sweep.record import wants_trajectories
from haploop.tools.sweep.store import Store, StoreError
from haploop.tools.sweep.sweep_file import load
from haploop.tools.sweep.table import SWEEP, NeedsPyarrow, make_schema, pyarrow

if TYPE_CHECKING:
    from haploop.tools.sweep.cells import Sweep

SUMMARY = "summary.json"
# Keys of the summary that are reported for a sweep whose cells are all there.
_NEEDED = {"title", "cells", "counts", "ended", "first_reason", "rate_1_s"}


@dataclass(frozen=True)
class Request:
    """The arguments of the command.

    Attributes:
        out: directory; one below ``runs/`` when None.
        workers: processes; as many as there are cores when None.
        dask: address of a scheduler, or None.
    """

    path: Path
    overrides: Sequence[str] = ()
    out: Path | None = None
    workers: int | None = None
    dask: str | None = None
    compiled: bool = False
    plugins: Sequence[Path] = ()


def sweep(request: Request, as_json: bool) -> None:
    """Runs the missing cells of a sweep and prints its summary."""
    if request.workers is not None and request.workers < 1:
        leave(f"--workers must be at least 1, but {request.workers} was given.", WRONG_USE)
    with plain_errors():
        note_without_numba()
        try:
            directory, summary = carry_out(request)
        except (NeedsPyarrow, ExecutorError) as error:
            leave(str(error), WRONG_USE)
        except StoreError as error:
            leave(str(error), FAILED)
        except KeyboardInterrupt:
            leave(
                "Interrupted at once; what was stored is kept, and the same command with the same --out continues.",
                FAILED,
            )
    if as_json:
        print_json({**summary, "directory": str(directory)})
    else:
        print(_summary_sentences(summary))
    print(directory, file=sys.stderr)
    if summary["ended"] != "done":
        leave(f"Stopped; to continue: haploop sweep {directory / SWEEP} --out {directory}", FAILED)


def carry_out(request: Request) -> tuple[Path, Summary]:
    """Runs the missing cells of a sweep; returns its directory and summary.

    Raises:
        SceneError, PluginError: the sweep cannot be run.
        NeedsPyarrow, ExecutorError: something it needs is not installed or cannot be reached.
        OutputError, StoreError, LogError: the directory, or a file in it, cannot be used.
    """
    pyarrow()
    made = load(request.path, request.overrides, read_sources(request.plugins))
    if request.compiled:
        _demand_compiler(made)
    directory = _directory(request, made)
    return directory, _run(request, made, directory)


def _run(request: Request, made: Sweep, directory: Path) -> Summary:
    began, path = time.monotonic(), directory / SUMMARY
    try:
        before_s = float(read(path)["wall_s"])
    except (LogError, TypeError, ValueError, LookupError):  # no earlier call ended in order
        before_s = 0.0
    schema = make_schema(made.columns(), made.toml())
    with interrupts(usual_from=2) as received, Store(directory, schema) as store:
        if store.finished:
            print("Every cell of this sweep is already there; nothing was run.", file=sys.stderr)
            summary = read(path)
            if missing := _NEEDED - summary.keys():
                raise LogError(f"The summary {path} is not that of a sweep: it lacks {', '.join(sorted(missing))}.")
            return summary
        with SweepProgress(made.title) as progress:
            ended, found = "done", []
            with Pool(request.workers, request.dask) as pool:
                stop = partial(progress.stopping, received)
                try:
                    found = Engine(made, store, pool, progress, stop, request.compiled).run()
                except Stopped:
                    ended = "stopped"
            missing = sum(math.isnan(boundary.near) for boundary in found)
            undecided = sum(bool(boundary.why) for boundary in found) - missing
            bounds = {"found": len(found) - missing, "undecided": undecided, "missing": missing}
            ran_s = time.monotonic() - began
            summary = {
                "title": made.title,
                "base": made.base.title,
                "axes": {
                    axis.key: [axis.entry(axis.values[0]), axis.entry(axis.values[-1]), len(axis.values)]
                    for axis in made.axes
                },
                "repeat": made.repeat,
                "ended": ended,
                "cells": sum(progress.counts.values()),
                "counts": dict(progress.counts),
                "first_reason": progress.reason,
                "provisos": dict(progress.provisos),
                **({"boundaries": bounds} if found else {}),
                "wall_s": before_s + ran_s,
                "rate_1_s": progress.ran / ran_s,
                "workers": pool.count,
                "machine": machine(),
                "versions": versions(),
            }
        try:
            write(summary, path)
        except OSError as error:
            raise StoreError(f"{path} could not be written: {error.strerror}.") from error
    return summary


def _directory(request: Request, made: Sweep) -> Path:
    """Returns a new directory, or that of the same sweep, which then continues; OutputError for any other."""
    out, text = request.out, made.toml()
    there = (out / SWEEP).read_text(encoding="utf-8") if out is not None and (out / SWEEP).is_file() else ""
    if out is not None and there:  # empty while another sweep is just about to begin there
        if there != text:
            changed = _first_difference(there, text)
            raise OutputError(f"{out} holds another sweep ({changed}); name another directory with --out.")
        kept = {path.name for path in (out / PLUGINS).glob("*.py")}
        if kept != {kept_name(plugin) for plugin in request.plugins}:
            raise OutputError(f"{out} holds a sweep with other --plugin files, kept in {out / PLUGINS}; use those.")
        return out
    directory = make_output(out, request.path, first=SWEEP)
    for plugin in request.plugins:
        keep_plugin(plugin, directory)
    part = directory / f"{SWEEP}.part"
    try:
        part.write_text(text, encoding="utf-8")
        part.replace(directory / SWEEP)
    except OSError as error:
        with contextlib.suppress(OSError):
            for begun in (part, directory / SWEEP):
                begun.unlink(missing_ok=True)
        raise OutputError(f"{directory / SWEEP} cannot be written: {error.strerror}.") from error
    return directory


def _first_difference(there: str, here: str) -> str:
    for old, new in zip(there.splitlines(), here.splitlines(), strict=False):
        if old != new:
            return f"there {old[:60]!r}, here {new[:60]!r}"
    return "one of the two is longer"


def _summary_sentences(summary: Summary) -> str:
    rate = summary["rate_1_s"]
    lines = [
        f"{summary['title']}: {summary['cells']} cells, {describe_counts(summary['counts'])}, {fixed(rate)} cells/s"
    ]
    if provisos := summary.get("provisos"):
        told = ", ".join(f"{proviso} ({count})" for proviso, count in provisos.items())
        lines.append(f"conditions of the steady cells: {told}")
    if bounds := summary.get("boundaries"):
        undecided = f", {count} of them across undecided cells" if (count := bounds.get("undecided")) else ""
        lines.append(f"boundaries: {bounds['found']} found{undecided}; {bounds['missing']} missing")
    if summary["first_reason"]:
        lines.append(f"first cell without a verdict: {summary['first_reason']}")
    return "\n".join(lines)


def _demand_compiler(made: Sweep) -> None:
    """Raises an ExecutorError before anything is started if JAX is not installed, or exact bits are asked for."""
    if wants_trajectories(made.record):
        raise ExecutorError(
            "--jax keeps to a tolerance, so that trajectory_sha256 means nothing; leave it out of record."
        )
    try:
        import jax  # noqa: F401
    except ImportError as error:
        raise ExecutorError("--jax needs JAX; install it with: pip install 'haploop[jax]'") from error
