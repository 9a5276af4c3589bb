"""``haploop export``: the log of a run in the formats of other programs, however long it is."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import IO
from urllib.parse import quote

from haploop.launch.spec import OutputError
from haploop.logger.log.stream import LogStream, survey
from haploop.tools.command.options import FAILED, WRONG_USE, leave, plain_errors
from haploop.tools.export.archives import JsonMcapWriter, NpzWriter
from haploop.tools.export.tables import CsvWriter, ExportWriter, ParquetWriter
from haploop.tools.render.terminal import console

WRITERS: dict[str, type[ExportWriter]] = {
    "csv": CsvWriter,
    "npz": NpzWriter,
    "parquet": ParquetWriter,
    "json-mcap": JsonMcapWriter,
}
FORMATS = tuple(WRITERS)


class ExportFailed(Exception):
    """Raised if the files could not be written to their end; the message says why, and none of them is left."""


def export_run(path: Path, to: str, out: Path | None, topics: str | None, force: bool) -> None:
    """Writes a run's log in another format and names the files."""
    from rich.progress import Progress

    shown = console(stderr=True)
    with plain_errors():
        if to not in WRITERS:
            leave(f"--to must be one of {', '.join(FORMATS)}, but {to!r} was given.", WRONG_USE)
        writer = WRITERS[to]
        try:
            contents = survey(path)
            units = _chosen(contents, topics)
            targets = _targets(contents.path, out, writer, list(units))
            # The log is read a second time, now that all its columns are known.
            log = LogStream(contents.path, units.keys(), until=contents.read_bytes)
            with (
                new_files(targets, force) as files,
                writer(files, units, contents.attachments) as exported,
                Progress(console=shown, transient=True, disable=not shown.is_terminal) as bar,
            ):
                task = bar.add_task("exporting", total=contents.read_bytes)
                for batch in log:
                    exported.add(batch)
                    bar.update(task, completed=log.read_bytes)
                exported.finish()
        except (FileNotFoundError, ImportError) as error:
            leave(str(error), WRONG_USE)
        except ExportFailed as error:
            leave(str(error), FAILED)
    if contents.cut:
        print(f"Note: {contents.cut} What it holds up to there was exported.", file=sys.stderr)
    print("\n".join(map(str, targets)))


def _chosen(contents: LogStream, topics: str | None) -> dict[str, dict[str, str]]:
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
    if writer.file_per_topic:
        names = [quote(topic.strip("/"), safe="") for topic in topics]
        return [(out or log.parent) / f"{name}{writer.suffix}" for name in names]
    if out and not out.is_dir():
        return [out]
    return [(out or log.parent) / f"{log.stem}{writer.suffix}"]


@contextlib.contextmanager
def new_files(targets: Sequence[Path], replace: bool) -> Iterator[list[IO[bytes]]]:
    """Opens a file for each target, under the target's name with ``.part`` after it, and renames them all at the end.

    If something raises on the way, no part is left, and files that had these names before are kept.

    Raises:
        OutputError: a target exists already and ``replace`` is not set, or a file cannot be made.
        ExportFailed: the operating system refuses to write further.
    """
    for target in targets:
        if target.is_dir() or (target.exists() and not replace):
            hint = "" if target.is_dir() else ", or overwrite it with --force"
            raise OutputError(f"{target} exists already; name another place with --out{hint}.")
    parts = [target.with_name(f"{target.name}.part") for target in targets]
    opened: list[IO[bytes]] = []
    try:
        for part in parts:
            try:
                part.parent.mkdir(parents=True, exist_ok=True)
                opened.append(part.open("wb"))
            except OSError as error:
                why = f"{part} cannot be made ({error.strerror}); name a place that is writable with --out."
                raise OutputError(why) from error
        try:
            yield opened
            for file in opened:
                file.close()
            for part, target in zip(parts, targets, strict=True):
                part.replace(target)
        except OSError as error:
            raise ExportFailed(
                f"Writing to {targets[0].parent} failed ({error.strerror or error}); nothing was exported. "
                "Make room there or name another place with --out."
            ) from error
    finally:
        for file, part in zip(opened, parts, strict=False):
            with contextlib.suppress(OSError):
                file.close()
            part.unlink(missing_ok=True)
