"""Which numbers of a device file are assumed: those whose comment says ASSUMPTION."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import NamedTuple

_MARK = "ASSUMPTION"
_TABLE = re.compile(r"\[+\s*([\w.]+)\s*\]+")
_VALUE = re.compile(r"([\w]+)\s*=\s*[^#]*#\s*(.*)")
# What decides how stiff a wall may be; the hand is tried in its own corners.
_TABLES = ("device", "friction", "encoder", "transmission", "clock")


class Assumed(NamedTuple):
    """A number that nobody published: its dotted key, and the file's words on it."""

    key: str
    words: str


def assumptions(path: Path) -> tuple[Assumed, ...]:
    """Returns the assumed numbers of a device file and of those it extends, of which its own lines take the place."""
    return tuple(found for found in _by_key(path).values() if found.words)


def _by_key(path: Path) -> dict[str, Assumed]:
    text = path.read_text(encoding="utf-8")
    extends = tomllib.loads(text).get("extends")
    found = _by_key(path.parent / extends) if isinstance(extends, str) else {}
    table = ""
    for line in text.splitlines():
        if match := _TABLE.match(line):
            table = match[1]
        elif (match := _VALUE.match(line)) and table.split(".")[0] in _TABLES:
            key, comment = f"{table}.{match[1]}", match[2]
            words = comment.partition(f"{_MARK}: ")[2] if _MARK in comment else ""
            found[key] = Assumed(key, words)
    return found
