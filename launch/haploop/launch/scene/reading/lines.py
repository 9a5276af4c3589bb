"""The lines of a TOML file: where each key stands, and the keys that are given twice, which TOML itself refuses."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

from haploop.protocol.files import read_text
from haploop.protocol.scene.table import Tables

KeyPath = tuple[str | int, ...]


@dataclass
class Outline:
    """The keys of a text.

    Attributes:
        data: its tables; for a key that is given again, the first value.
        at: the line of every key and table, from 1; keys inside a value are at the first line of that value.
        doubled: keys that are given again, with the lines of both.
    """

    data: Tables = field(default_factory=dict)
    at: dict[KeyPath, int] = field(default_factory=dict)
    doubled: list[tuple[KeyPath, int, int]] = field(default_factory=list)

    def line_of(self, key: KeyPath) -> int | None:
        """Returns the line of a key or, where it is missing, of the table that it should be in."""
        while key and key not in self.at:
            key = key[:-1]
        return self.at.get(key)

    def put(self, node: Tables, key: KeyPath, given: Tables, line: int) -> None:
        """Puts keys that were read in a line into the table at ``key``; records those already there as doubled."""
        for name, value in given.items():
            inner = (*key, name)
            if name not in node:
                node[name] = {} if isinstance(value, dict) else value
                self.at[inner] = line
            elif not (isinstance(value, dict) and isinstance(node[name], dict)):
                self.doubled.append((inner, self.at[inner], line))
                continue
            if isinstance(value, dict):
                self.put(node[name], inner, value, line)

    def enter(self, parts: list[str], line: int, is_list: bool, headed: set[KeyPath]) -> tuple[Tables, KeyPath]:
        """Goes to the table that a header names, which is made, or added to a list; returns it with its key."""
        node, key = self.data, ()
        for part in parts[:-1]:
            key = (*key, part)
            self.at.setdefault(key, line)
            node = node.setdefault(part, {})
            if isinstance(node, list):
                key, node = (*key, len(node) - 1), node[-1]
        key = (*key, parts[-1])
        if is_list:
            tables = node.setdefault(parts[-1], [])
            tables.append({})
            self.at.setdefault(key, line)
            key, node = (*key, len(tables) - 1), tables[-1]
        else:
            if key in headed:
                self.doubled.append((key, self.at[key], line))
            headed.add(key)
            node = node.setdefault(parts[-1], {})
        self.at.setdefault(key, line)
        return node, key


def outline(text: str) -> Outline | None:
    """Returns the keys of a TOML text with their lines; None if it is not TOML, apart from keys given twice."""
    found = Outline()
    node, key = found.data, ()
    headed: set[KeyPath] = set()
    try:
        for line, statement, given in _statements(text):
            if statement.lstrip().startswith("["):
                node, key = found.enter(_names(given), line, statement.lstrip().startswith("[["), headed)
            else:
                found.put(node, key, given, line)
    except (ValueError, TypeError, AttributeError, RecursionError):  # a key that is not a table is used as one
        return None
    return found


_kept = lru_cache(maxsize=16)(outline)


def line_in(path: str, key: KeyPath) -> int | None:
    """Returns the line of a key of a file, or of the table it should be in; None for a file that cannot be read."""
    try:
        found = _kept(read_text(path))
    except (OSError, UnicodeDecodeError):
        return None
    return found.line_of(key) if found else None


def _statements(text: str) -> Iterator[tuple[int, str, Tables]]:
    """Yields every header and every key with its value: its first line, its text, and the text parsed on its own.

    Raises ValueError where one is not TOML.
    """
    held: list[str] = []
    begun = depth = 0
    for number, line in enumerate(text.replace("\r\n", "\n").split("\n"), start=1):
        if not held:
            if not line.strip() or line.lstrip().startswith("#"):
                continue
            begun, depth = number, 0
        held.append(line)
        depth += sum(map(line.count, "[{")) - sum(map(line.count, "]}"))
        if depth > 0 and not any(mark in line for mark in "\"'#"):  # within a list: long ones are not tried again
            continue
        statement = "\n".join(held)
        try:
            given = tomllib.loads(statement)
        except ValueError:
            continue
        yield begun, statement, given
        held = []
    if held:
        raise ValueError(f"What starts in line {begun} is not valid TOML.")


def _names(header: Any) -> list[str]:
    """Returns the names of a header that was parsed on its own: a table in a table, or in a list of one."""
    names = []
    while header:
        [(name, header)] = header.items()
        names.append(name)
        header = header[0] if isinstance(header, list) else header
    return names
