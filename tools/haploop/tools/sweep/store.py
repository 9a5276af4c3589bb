"""The directory of a sweep: cells that are finished stay finished, however the program ends."""

from __future__ import annotations

import contextlib
import fcntl
import io
import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Self

from haploop.launch.spec import OutputError
from haploop.tools.sweep.table import (
    BOUNDARY,
    CELL,
    PARTS,
    TABLE,
    Row,
    TableError,
    make_table,
    pyarrow,
    read_part,
    write_table,
)

LOCK = ".lock"
# The parts that a sweep writes, named by their first cell; nothing else is ever removed.
_PART = f"{'[0-9]' * 12}.parquet"
# Rows that are merged into a group of the table, which a reader can read alone.
_GROUP_ROWS = 8192


class StoreError(Exception):
    """Something could not be written; the message says what, why, and what is stored safely."""


class Store:
    """An existing directory while a sweep writes a table of a schema to it; a context manager that keeps others out.

    Every part of the sweep that is done becomes a separate file, which is either complete or absent. At the end the
    files are merged into one table.
    """

    def __init__(self, directory: Path, schema: Any) -> None:
        self.directory, self._schema = directory, schema
        self._sweep = schema.metadata[b"sweep"].decode()
        self._parts = directory / PARTS
        self.rows = 0

    def __enter__(self) -> Self:
        self._lock = lock(self.directory)
        try:
            self._parts.mkdir(exist_ok=True)
            ours = (self.directory / f"{name}.part" for name in (TABLE, BOUNDARY))
            for left in (*ours, *self._parts.glob(f"{_PART}.part")):
                left.unlink(missing_ok=True)
        except OSError as error:
            os.close(self._lock)
            raise OutputError(f"The directory {self.directory} cannot be used: {error.strerror}.") from error
        return self

    def __exit__(self, *_: object) -> None:
        with contextlib.suppress(OSError):
            self._parts.rmdir()  # where no part was written
        os.close(self._lock)

    @property
    def finished(self) -> bool:
        """Tells whether the table is there."""
        return (self.directory / TABLE).exists()

    def done(self, columns: Sequence[str] = (CELL,)) -> list[Row]:
        """Returns some columns of all rows that are stored; a part that cannot be read is removed, to be run again."""
        rows = []
        for file in self._files():
            try:
                rows += read_part(file, self._sweep).select(list(columns)).to_pylist()
            except (TableError, KeyError):
                try:
                    file.unlink()
                except OSError as error:
                    raise StoreError(
                        f"{file} is not a part of a sweep and cannot be removed: {error.strerror}."
                    ) from error
        self.rows = len(rows)
        return rows

    def add(self, rows: Sequence[Row]) -> None:
        """Stores the rows of a part that is done; raises StoreError where they cannot be written."""
        path = self._parts / f"{rows[0][CELL]:012d}.parquet"
        self._write(path, lambda file: write_table(make_table(rows, self._schema), file))
        self.rows += len(rows)

    def finish(self, boundaries: Any = None) -> None:
        """Merges all parts into the table, in the order of the cells; writes the table of boundaries, if any."""
        if boundaries is not None:
            self._write(self.directory / BOUNDARY, lambda file: write_table(boundaries, file))
        temporary = self.directory / f"{TABLE}.part"
        with self._safely(temporary):
            with pyarrow().parquet.ParquetWriter(temporary, self._schema, write_page_checksum=True) as writer:
                for table in self._in_order():
                    writer.write_table(table)
            temporary.replace(self.directory / TABLE)
        with contextlib.suppress(OSError):  # the table is there; files that are no parts of this sweep stay
            for part in self._files():
                part.unlink()
            self._parts.rmdir()

    def _in_order(self) -> Iterator[Any]:
        """Yields all rows in groups in the order of their cells; only parts that overlap are in memory at once."""
        arrow = pyarrow()
        held, last = [], -1
        for file in self._files():
            if int(file.stem) > last and sum(map(len, held)) >= _GROUP_ROWS:
                yield arrow.concat_tables(held).sort_by(CELL)
                held = []
            held.append(read_part(file, self._sweep))
            last = max(last, held[-1][CELL][-1].as_py())
        if held:
            yield arrow.concat_tables(held).sort_by(CELL)

    def _files(self) -> list[Path]:
        return sorted(self._parts.glob(_PART))

    def _write(self, path: Path, write: Callable[[io.BytesIO], object]) -> None:
        data = io.BytesIO()
        write(data)
        temporary = path.with_name(f"{path.name}.part")
        with self._safely(temporary):
            temporary.write_bytes(data.getbuffer())
            temporary.replace(path)

    @contextlib.contextmanager
    def _safely(self, temporary: Path) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            with contextlib.suppress(OSError):
                temporary.unlink()
            reason = error.strerror or str(error)
            raise StoreError(
                f"Writing {temporary.with_suffix('')} failed: {reason}. The {self.rows} cells written before are safe; "
                "once there is room, the same command continues."
            ) from error


def lock(directory: Path) -> int:
    """Keeps other sweeps out of a directory, which raise OutputError, as long as the file descriptor is open.

    A killed program leaves no lock behind.
    """
    descriptor = os.open(directory / LOCK, os.O_RDWR | os.O_CREAT, 0o644)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        holder = os.pread(descriptor, 20, 0).decode(errors="replace").strip()
        os.close(descriptor)
        raise OutputError(
            f"Another sweep (process {holder}) is writing to {directory}; name another with --out."
        ) from error
    os.ftruncate(descriptor, 0)
    os.pwrite(descriptor, str(os.getpid()).encode(), 0)
    return descriptor
