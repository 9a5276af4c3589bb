"""A file of measurements, a line each: a command that was stopped goes on where it was."""

from __future__ import annotations

import json
from pathlib import Path
from types import TracebackType
from typing import Any, Self

POINTS_FILE = "points.jsonl"


class Store:
    """DIR/points.jsonl: records by (what, key, repeat), appended one by one and never rewritten.

    A line that was cut off when the program was killed is passed over: its record is measured again.
    """

    def __init__(self, directory: Path) -> None:
        self._path = directory / POINTS_FILE
        self._records: dict[tuple[str, str, int], Any] = {}

    def __enter__(self) -> Self:
        text = self._path.read_text(encoding="utf-8") if self._path.exists() else ""
        for line in text.splitlines():
            try:
                record = json.loads(line)
                self._records[record["what"], record["key"], record["repeat"]] = record["value"]
            except (ValueError, LookupError, TypeError):
                continue
        self._file = self._path.open("a", encoding="utf-8")
        if text and not text.endswith("\n"):
            self._file.write("\n")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._file.close()

    def add(self, what: str, key: str, value: Any, repeat: int = 0) -> None:
        """Keeps a record, on disk at once."""
        self._records[what, key, repeat] = value
        record = {"what": what, "key": key, "repeat": repeat, "value": value}
        self._file.write(json.dumps(record) + "\n")
        self._file.flush()

    def get(self, what: str, key: str, repeat: int = 0) -> Any:
        """Returns a record, or None where there is none."""
        return self._records.get((what, key, repeat))

    def has(self, what: str, key: str, repeat: int = 0) -> bool:
        """Tells whether there is a record."""
        return (what, key, repeat) in self._records

    def all(self, what: str, key: str, repeats: int) -> list[Any]:
        """Returns the records of the first ``repeats`` repeats, as far as there are any."""
        return [self._records[what, key, i] for i in range(repeats) if (what, key, i) in self._records]
