"""NumPy's ``.npz`` and MCAP with JSON messages: one file for all topics.

NPZ: an array for every column, ``numpy.load(file)["plant/x"]``; beside them ``units.json`` (unit by array),
``events.json`` (a list of every event) and what was attached to the log, such as ``scene.toml``, which ``numpy.load``
gives as bytes.

MCAP, which Foxglove opens and plots: one message for every row, schemas with units and titles. Topics and names are
kept: a plot's path is ``/plant.x``, or ``/energy."wall.true"`` if the name has a point in it. A number that is not
finite, or that a row does not have, is left out of its message: JSON cannot express it, and the schemas that Foxglove
reads allow no null.
"""

from __future__ import annotations

import json
import shutil
import tempfile
import zipfile
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import IO

import numpy as np
from mcap.writer import CompressionType, Writer
from numpy.lib import format as npy

from haploop.logger.log.recording import TIMESTAMP, Table
from haploop.logger.log.stream import Batch
from haploop.tools.export.tables import ExportWriter, Units, read_column, to_json

# Properties that the schema of events has: without any it could not be read.
_EVENT_UNITS = {TIMESTAMP: "s", "tick": ""}


class NpzWriter(ExportWriter):
    """Writes one archive; its members are written one after the other, so every column waits in a file of its own."""

    suffix = ".npz"

    def __init__(self, files: Sequence[IO[bytes]], units: Units, attachments: Mapping[str, bytes]) -> None:
        [self._target] = files
        self._units, self._attachments = units, attachments
        # By topic and column; the maps of a topic without columns wait under the name "".
        self._waiting: dict[tuple[str, str], IO[bytes]] = {}
        with ExitStack() as held:
            beside = Path(self._target.name).parent
            folder = Path(held.enter_context(tempfile.TemporaryDirectory(prefix=".npz-", dir=beside)))
            for topic, columns in units.items():
                for name in columns or [""]:
                    file = (folder / str(len(self._waiting))).open("w+b")
                    self._waiting[topic, name] = held.enter_context(file)
            self._held = held.pop_all()

    def add(self, batch: Batch) -> None:
        for name in self._units[batch.topic]:
            self._waiting[batch.topic, name].write(read_column(batch, name).astype("<f8").tobytes())
        if not self._units[batch.topic]:
            file = self._waiting[batch.topic, ""]
            for one in batch.rows:
                file.write((",\n" if file.tell() else "[").encode() + to_json(one).encode())

    def finish(self) -> None:
        with zipfile.ZipFile(self._target, "w") as archive:
            for (topic, name), file in self._waiting.items():
                if name:
                    _move(file, archive, f"{_array(topic, name)}.npy")
                else:
                    file.write(b"]\n" if file.tell() else b"[]\n")
                    _move(file, archive, f"{topic.strip('/')}.json")
            units = {_array(topic, name): unit for topic, names in self._units.items() for name, unit in names.items()}
            archive.writestr("units.json", json.dumps(units, indent=1, ensure_ascii=False) + "\n")
            for name, content in self._attachments.items():
                archive.writestr(name, content)

    def __exit__(self, *_: object) -> None:
        self._held.close()


def _array(topic: str, name: str) -> str:
    return f"{topic.strip('/')}/{name}"


def _move(file: IO[bytes], archive: zipfile.ZipFile, member: str) -> None:
    """Moves the content of a file into the archive; the file is empty afterwards, so that the disk holds it once."""
    with archive.open(member, "w", force_zip64=True) as target:
        if member.endswith(".npy"):
            npy.write_array_header_1_0(target, {"descr": "<f8", "fortran_order": False, "shape": (file.tell() // 8,)})
        file.seek(0)
        shutil.copyfileobj(file, target, 1 << 20)
    file.truncate(0)


class JsonMcapWriter(ExportWriter):
    suffix = ".json.mcap"

    def __init__(self, files: Sequence[IO[bytes]], units: Units, attachments: Mapping[str, bytes]) -> None:
        [file] = files
        self._writer = Writer(file, compression=CompressionType.LZ4)
        self._writer.start(library="haploop")
        for name, content in attachments.items():
            self._writer.add_attachment(0, 0, name, "text/plain", content)
        self._counts = dict.fromkeys(units, 0)
        self._channels: dict[str, int] = {}
        for topic, columns in units.items():
            name = f"haploop.{topic.strip('/')}"
            schema = self._writer.register_schema(name, "jsonschema", _schema(name, columns or _EVENT_UNITS))
            self._channels[topic] = self._writer.register_channel(topic, "json", schema)

    def add(self, batch: Batch) -> None:
        if isinstance(batch.rows, Table):
            times_ns, messages = _row_times_ns(batch, batch.rows), _rows(batch.rows)
        else:
            times_ns, messages = batch.log_times_ns.tolist(), map(to_json, batch.rows)
        channel, first = self._channels[batch.topic], self._counts[batch.topic]
        for number, (time_ns, message) in enumerate(zip(times_ns, messages, strict=True), start=first):
            self._writer.add_message(channel, time_ns, message.encode(), time_ns, number & 0xFFFFFFFF)
        self._counts[batch.topic] += len(batch.log_times_ns)

    def finish(self) -> None:
        self._writer.finish()


def _schema(title: str, units: Mapping[str, str]) -> bytes:
    columns = {
        name: {"type": "number", "title": f"{name} ({unit})" if unit else name, "unit": unit}
        for name, unit in units.items()
    }
    return json.dumps({"title": title, "type": "object", "properties": columns}).encode()


def _row_times_ns(batch: Batch, rows: Table) -> list[int]:
    """Returns the time of each row, from its own stamp, since the steps of a tick share the time of their message."""
    stamps = rows.get(TIMESTAMP)
    if stamps is None or not (np.isfinite(stamps) & (stamps >= 0)).all():
        return batch.log_times_ns.tolist()
    return np.rint(stamps * 1e9).astype(np.uint64).tolist()


def _rows(rows: Table) -> list[str]:
    cells = []
    for name, column in rows.items():
        key = f"{json.dumps(name)}:"
        texts = [key + text for text in map(repr, column.tolist())]
        for row in np.flatnonzero(~np.isfinite(column)).tolist():
            texts[row] = ""
        cells.append(texts)
    absent = any("" in texts for texts in cells)
    return [f"{{{','.join(filter(None, row) if absent else row)}}}" for row in zip(*cells, strict=True)]
