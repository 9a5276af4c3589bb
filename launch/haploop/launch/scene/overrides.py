"""``--set KEY=VALUE``: single keys laid over a scene from the command line."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import Any

from haploop.launch.scene.layers import Layers
from haploop.launch.scene.mistakes import COMMAND_LINE, Mistake, counted


def lay_overrides(layers: Layers, overrides: Iterable[str]) -> None:
    """Lays each ``dotted.key=value`` on; what is wrong is added to the mistakes of ``layers``.

    A part of the key that is a number counts the elements of a list from 0, and one past its end adds one. Tables and
    lists that are absent are made.
    """
    for text in overrides:
        name, value = split_assignment(text) or ("", None)
        path = key_path(name)
        if not path:
            expected = "It must read KEY=VALUE with a dotted key, such as dissipation.0.mass=0.02."
            layers.mistakes.append(Mistake(COMMAND_LINE, text, "cannot be read", expected))
        elif complaint := lay_value(layers, path, value):
            layers.mistakes.append(Mistake(COMMAND_LINE, name, "cannot be set", complaint))


def lay_value(layers: Layers, path: Sequence[str], value: Any) -> str | None:
    """Makes the way to the last part and lays the value there; returns a sentence where there is no such way."""
    key: tuple[str | int, ...] = ()
    node: Any = layers.data
    for part, after in zip(path, [*path[1:], None], strict=True):
        if isinstance(node, list):
            if not part.isdecimal() or int(part) > len(node):
                count = counted(len(node), "element")
                return f"{'.'.join(map(str, key))} has {count}, counted from 0, so {part} is none of them."
            step: Any = int(part)
            if step == len(node):
                node.append({})
        elif isinstance(node, dict):
            step = part
        else:
            return f"{'.'.join(map(str, key))} holds a value, not a table."
        if after is None:
            break
        if isinstance(node, dict) and step not in node:
            layers.lay({part: [] if after.isdecimal() else {}}, COMMAND_LINE, key)
        node, key = node[step], (*key, step)
    if isinstance(node, list):
        node[int(path[-1])] = value
        layers.origins[(*key, int(path[-1]))] = COMMAND_LINE
    else:
        layers.lay({path[-1]: value}, COMMAND_LINE, key)
    return None


@lru_cache(maxsize=256)
def key_path(name: str) -> tuple[str, ...]:
    """Returns the parts of a dotted key, read as TOML reads it, so that a part may be quoted; () for no key."""
    try:
        node: Any = tomllib.loads(f"{name} = 0") if "\n" not in name else {}
    except ValueError:
        return ()
    path = []
    while isinstance(node, dict) and node:
        [(part, node)] = node.items()
        path.append(part)
    return tuple(path)


def split_assignment(text: str) -> tuple[str, Any] | None:
    """Splits ``KEY=VALUE``; the value is TOML where the text is, and the text itself otherwise. None without a key."""
    name, equals, value = text.partition("=")
    if not equals or not name.strip():
        return None
    try:
        table = tomllib.loads(f"value = {value}")
    except ValueError:
        return name.strip(), value.strip()
    return name.strip(), table["value"] if len(table) == 1 else value.strip()
