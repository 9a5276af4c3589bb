"""NumPy's ``.npz``: one archive with an array for every column, ``numpy.load(file)["plant/x"]``.

Beside them it holds ``units.json`` (unit by array), ``events.json`` (a list of every event) and what was attached to
the log, such as ``scene.toml``; ``numpy.load`` gives those as bytes.
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

from numpy.lib import format as npy

from haploop.logger.log.stream import Batch
from haploop.tools.export.writer import ExportWriter, Units, column, to_json


class NpzWriter(ExportWriter):
    """One archive. It takes its members one after the other, so every column waits in a file of its own."""

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
            self._waiting[batch.topic, name].write(column(batch, name).astype("<f8").tobytes())
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
            units = {_array(topic, name): unit for topic in self._units for name, unit in self._units[topic].items()}
            archive.writestr("units.json", json.dumps(units, indent=1, ensure_ascii=False) + "\n")
            for name, content in self._attachments.items():
                archive.writestr(name, content)

    def __exit__(self, *_: object) -> None:
        self._held.close()


def _array(topic: str, name: str) -> str:
    return f"{topic.strip('/')}/{name}"


def _move(file: IO[bytes], archive: zipfile.ZipFile, member: str) -> None:
    """Move what waits in a file into the archive; the file is empty afterwards, so that the disk holds it once."""
    with archive.open(member, "w", force_zip64=True) as target:
        if member.endswith(".npy"):
            npy.write_array_header_1_0(target, {"descr": "<f8", "fortran_order": False, "shape": (file.tell() // 8,)})
        file.seek(0)
        shutil.copyfileobj(file, target, 1 << 20)
    file.truncate(0)
