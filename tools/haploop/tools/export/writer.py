"""The base of every export format: a writer that takes the log batch by batch."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import IO, Any, ClassVar, Self

import numpy as np

from haploop.logger.log.recording import Table
from haploop.logger.log.stream import Batch
from haploop.logger.log.table import Floats
from haploop.logger.summary import finite

Units = Mapping[str, Mapping[str, str]]


class ExportWriter(ABC):
    """Writes the content of a log into files, in the memory of a few batches; a context manager.

    Attributes:
        suffix: of its files.
        file_per_topic: whether every topic has a file of its own, or all have one.
    """

    suffix: ClassVar[str]
    file_per_topic: ClassVar[bool] = False

    @abstractmethod
    def __init__(self, files: Sequence[IO[bytes]], units: Units, attachments: Mapping[str, bytes]) -> None:
        """Begins the files.

        Args:
            files: one a topic in the order of ``units``, or one for all; closed by the caller.
            units: by topic, unit by column of all that will come; empty for a topic of free maps.
            attachments: content of each file attached to the log, by name.
        """

    @abstractmethod
    def add(self, batch: Batch) -> None:
        """Takes the next rows of a topic; a column that they do not have is NaN in them."""

    @abstractmethod
    def finish(self) -> None:
        """Writes all that was held back; to be called once, when nothing has failed."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:  # noqa: B027 (most hold nothing beside their files)
        """Releases whatever is held beside the files."""


def read_column(batch: Batch, name: str) -> Floats:
    """Returns a column of a batch, NaN throughout where it has none of the name."""
    assert isinstance(batch.rows, Table)
    return batch.rows[name] if name in batch.rows else np.full(len(batch.log_times_ns), np.nan)


def to_json(value: Any) -> str:
    """Returns compact JSON; null for numbers that are not finite, text for what JSON does not know."""
    return json.dumps(finite(value), ensure_ascii=False, separators=(",", ":"), default=str)
