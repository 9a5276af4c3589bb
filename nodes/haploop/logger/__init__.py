"""The energy books, the log and the process that keeps them.

``haploop.logger.read(directory)`` gives a run's log as NumPy arrays.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from haploop.logger.recording import Recording


def read(path: str | Path) -> Recording:
    """Read the log of a run: see :func:`haploop.logger.log_reader.read`, imported when first used."""
    from haploop.logger import log_reader

    return log_reader.read(path)
