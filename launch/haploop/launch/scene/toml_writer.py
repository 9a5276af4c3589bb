"""A resolved scene as TOML that runs by itself and reads back to the same values, bit for bit."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from haploop.protocol.scene.table import Tables

_NOTHING: Mapping[str, list[str]] = {}
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_ESCAPES = {ord('"'): '\\"', ord("\\"): "\\\\", **{c: f"\\u{c:04x}" for c in [*range(0x20), 0x7F]}}


def to_toml(scene: Tables, known: Mapping[str, list[str]] | None = None) -> str:
    """Returns the TOML text of a dict of str, bool, int, finite float, lists and dicts; TypeError for other values.

    ``known`` has the ``lines`` of some of its tables by key, which are then not made again.
    """
    return "\n".join(_table(scene, (), known or {})).lstrip("\n") + "\n"


def lines(scene: Tables) -> dict[str, list[str]]:
    """Returns the lines of each table of a scene, by key."""
    return {key: _tables(value, (key,)) for key, value in scene.items() if _has_header(value)}


def inline(value: Any) -> str:
    """Returns one value on one line, as TOML writes it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, str):
        return f'"{value.translate(_ESCAPES)}"'
    if isinstance(value, list):
        return f"[{', '.join(map(inline, value))}]"
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{_key(k)} = {inline(v)}" for k, v in value.items()) + " }" if value else "{}"
    raise TypeError(f"A scene holds text, numbers, true or false, lists and tables, but not {value!r}.")


def _table(table: Tables, path: tuple[str, ...], known: Mapping[str, list[str]] = _NOTHING) -> list[str]:
    """Returns a table's lines: its plain keys first, as they belong to the header above them, then its sub-tables."""
    made: list[str] = []
    headed: list[str] = []
    for key, value in table.items():
        if key in known:
            headed += known[key]
        elif _has_header(value):
            headed += _tables(value, (*path, key))
        else:
            made.append(f"{_key(key)} = {inline(value)}")
    return made + headed


def _tables(value: Any, path: tuple[str, ...]) -> list[str]:
    name = ".".join(map(_key, path))
    if isinstance(value, dict):
        return ["", f"[{name}]", *_table(value, path)]
    return [line for item in value for line in ("", f"[[{name}]]", *_table(item, path))]


def _has_header(value: Any) -> bool:
    if isinstance(value, list):
        return bool(value) and all(isinstance(item, dict) for item in value)
    return isinstance(value, dict)


def _key(key: str) -> str:
    return key if _BARE_KEY.fullmatch(key) else inline(key)
