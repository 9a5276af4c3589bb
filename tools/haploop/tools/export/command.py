"""``haploop export``: the log of a run in the formats of other programs, however long it is."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote

from haploop.tools.cli.exit_codes import FAILED, WRONG_USE, leave, plain_errors

if TYPE_CHECKING:
    from haploop.logger.log.stream import LogStream
    from haploop.tools.export.writer import ExportWriter

FORMATS = ("csv", "npz", "parquet", "json-mcap")


def export_run(path: Path, to: str, out: Path | None, topics: str | None, force: bool) -> None:
    """Write a run's log in another format and name the files."""
    from haploop.logger.log.stream import survey
    from haploop.tools.export.files import ExportFailed

    with plain_errors():
        try:
            writer = _writer(to)
            contents = survey(path)
            units = _chosen(contents, topics)
            targets = _targets(contents.path, out, writer, list(units))
            _export(contents, units, writer, targets, force)
        except (FileNotFoundError, ImportError) as error:
            leave(str(error), WRONG_USE)
        except ExportFailed as error:
            leave(str(error), FAILED)
    if contents.cut:
        print(f"Note: {contents.cut} What it holds up to there was exported.", file=sys.stderr)
    print("\n".join(map(str, targets)))


def _writer(to: str) -> type[ExportWriter]:
    """The writer of a format; only the libraries of this one are imported."""
    match to:
        case "csv":
            from haploop.tools.export.csv import CsvWriter as Writer
        case "npz":
            from haploop.tools.export.npz import NpzWriter as Writer
        case "parquet":
            from haploop.tools.export.parquet import ParquetWriter as Writer
        case "json-mcap":
            from haploop.tools.export.json_mcap import JsonMcapWriter as Writer
        case _:
            leave(f"--to must be one of {', '.join(FORMATS)}, but {to!r} was given.", WRONG_USE)
    return Writer


def _chosen(contents: LogStream, topics: str | None) -> dict[str, dict[str, str]]:
    """Unit by column of the topics asked for, by topic."""
    if not contents.units:
        leave(f"The log {contents.path} holds no channel yet, so there is nothing to export.", FAILED)
    if topics is None:
        return contents.units
    known = {topic.strip("/"): topic for topic in contents.units}
    wanted = [topic.strip(" /") for topic in topics.split(",")]
    for topic in wanted:
        if topic not in known:
            leave(f"There is no channel /{topic} in this log; its channels are {', '.join(contents.units)}.", WRONG_USE)
    return {known[topic]: contents.units[known[topic]] for topic in wanted}


def _targets(log: Path, out: Path | None, writer: type[ExportWriter], topics: list[str]) -> list[Path]:
    """The files to write: beside the log, or where ``out`` says."""
    if writer.file_per_topic:
        names = [quote(topic.strip("/"), safe="") for topic in topics]
        return [(out or log.parent) / f"{name}{writer.suffix}" for name in names]
    if out and not out.is_dir():
        return [out]
    return [(out or log.parent) / f"{log.stem}{writer.suffix}"]


def _export(
    contents: LogStream,
    units: dict[str, dict[str, str]],
    make_writer: type[ExportWriter],
    targets: list[Path],
    force: bool,
) -> None:
    """Go through the log a second time, now that all its columns are known, and write it."""
    from haploop.logger.log.stream import LogStream
    from haploop.tools.export.files import new_files

    log = LogStream(contents.path, units.keys(), until=contents.read_bytes)
    with (
        new_files(targets, force) as files,
        make_writer(files, units, contents.attachments) as writer,
        _progress(contents.read_bytes) as show,
    ):
        for batch in log:
            writer.add(batch)
            show(log.read_bytes)
        writer.finish()


@contextlib.contextmanager
def _progress(total_bytes: int) -> Iterator[Callable[[int], None]]:
    """A bar on a terminal, fed with how much of the log is done; nothing elsewhere."""
    from rich.progress import Progress

    from haploop.tools.render.terminal import console

    shown = console(stderr=True)
    with Progress(console=shown, transient=True, disable=not shown.is_terminal) as bar:
        task = bar.add_task("exporting", total=total_bytes)
        yield lambda done_bytes: bar.update(task, completed=done_bytes)
