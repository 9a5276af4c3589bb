"""What every format of export has in common: a writer that is handed the log batch by batch."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import IO, Any, ClassVar, Self

import numpy as np

from haploop.logger.log.recording import TIMESTAMP, Table
from haploop.logger.log.stream import Batch
from haploop.logger.log.table import Floats
from haploop.logger.summary import finite

Units = Mapping[str, Mapping[str, str]]
# A topic of free maps becomes a table of these two: when, and the map as JSON.
MESSAGE = "message"
MAP_UNITS = {TIMESTAMP: "s", MESSAGE: ""}


class ExportWriter(ABC):
    """Writes what a log holds into files, in the memory of a few batches; a context manager.

    Attributes:
        suffix: of its files.
        file_per_topic: whether every topic has a file of its own, or all have one.
    """

    suffix: ClassVar[str]
    file_per_topic: ClassVar[bool] = False

    @abstractmethod
    def __init__(self, files: Sequence[IO[bytes]], units: Units, attachments: Mapping[str, bytes]) -> None:
        """Begin the files.

        Args:
            files: one a topic in the order of ``units``, or one for all; whoever opened them closes them.
            units: by topic, unit by column of all that will come; empty for a topic of free maps.
            attachments: content of each file attached to the log, by name.
        """

    @abstractmethod
    def add(self, batch: Batch) -> None:
        """Take the next rows of a topic; a column that they do not have is NaN in them."""

    @abstractmethod
    def finish(self) -> None:
        """Write all that was held back; call once, when nothing has failed."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:  # noqa: B027 (most hold nothing beside their files)
        """Let go of whatever is held beside the files."""


def column(batch: Batch, name: str) -> Floats:
    """A column of a batch, NaN throughout where it has none of the name."""
    assert isinstance(batch.rows, Table)
    return batch.rows[name] if name in batch.rows else np.full(len(batch.log_times_ns), np.nan)


def map_rows(batch: Batch) -> tuple[list[float], list[str]]:
    """Time in s and JSON text of each of a batch's free maps."""
    maps: list[dict[str, Any]] = list(batch.rows)  # type: ignore[arg-type]
    nanoseconds = batch.log_times_ns.tolist()
    times = [float(one.get(TIMESTAMP, ns / 1e9)) for one, ns in zip(maps, nanoseconds, strict=True)]
    return times, [to_json(one) for one in maps]


def to_json(value: Any) -> str:
    """Compact JSON; null for numbers that are not finite, text for what JSON does not know."""
    return json.dumps(finite(value), ensure_ascii=False, separators=(",", ":"), default=str)
