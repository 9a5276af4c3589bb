"""Scene files laid over one another: what ``extends`` names, the file itself, then ``--set``."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

from haploop.launch.scene.bundled import bundled, found
from haploop.launch.scene.mistakes import COMMAND_LINE, Mistake, SceneError, counted, shown
from haploop.launch.scene.reading.lines import KeyPath, line_in
from haploop.launch.scene.reading.tables import DEEPEST, excess, parse
from haploop.launch.scene.toml_writer import inline
from haploop.protocol.names import nearest
from haploop.protocol.scene.table import Tables

# No scene needs more files that extend one another.
_MOST_FILES = 100
# Keys that say what else is in their table, each with the keys that are there whatever its value.
_SORTS = {"kind": (), "estimator": ("source", "cutoff")}
_OF_EVERY_KIND: dict[KeyPath, tuple[str, ...]] = {("wall",): ("position", "stiffness", "occupies")}
# Keys of a table that stand in place of others: a file that gives the one removes the others.
_INSTEAD: dict[KeyPath, dict[str, set[str]]] = {
    ("encoder",): {"resolution": {"bits", "range"}, "bits": {"resolution"}, "range": {"resolution"}}
}
# Tables for which naming no kind is a kind too.
_KINDLESS = [("hand",)]


@dataclass
class Layers:
    """The merged tables of several layers, each value with the file that gave it.

    Attributes:
        origins: the file, or ``"--set"``, that gave each value, and the last file that wrote into each table.
        gone_over: mistakes after which reading continues: keys that are given twice in one file, absent files.
        files: how many files have been read.
        lacks_a_file: whether an extended file is absent, which may hold any key that is missing.
    """

    path: Path
    data: Tables = field(default_factory=dict)
    origins: dict[KeyPath, str] = field(default_factory=dict)
    mistakes: list[Mistake] = field(default_factory=list)
    gone_over: list[Mistake] = field(default_factory=list)
    files: int = 0
    lacks_a_file: bool = False

    def origin(self, key: KeyPath) -> str:
        """Returns the file that gave the value at ``key``, or the table nearest to it."""
        while key and key not in self.origins:
            key = key[:-1]
        return self.origins.get(key, str(self.path))

    def complain(
        self, key: KeyPath, expected: str, given: str | None = None, nearest: str | None = None,
        place: KeyPath | None = None,
    ) -> None:  # fmt: skip
        """Adds a mistake about ``key``, whose value is quoted unless ``given`` says what was found.

        ``place`` is the key at which the mistake was made, if it is another one.
        """
        if given is None:
            given = f"is {_quoted(self.value(key))}"
        place = place or key
        origin = self.origin(place)
        file, line = (origin, None) if origin == COMMAND_LINE else (shown(origin), line_in(origin, place))
        self.mistakes.append(Mistake(file, ".".join(map(str, key)), given, expected, nearest, line))

    def value(self, key: KeyPath) -> Any:
        value: Any = self.data
        for part in key:
            value = value[part]
        return value

    def lay(self, over: Tables, origin: str, key: KeyPath = ()) -> None:
        """Lays a table over the one at ``key``: tables merge key by key, all else is replaced.

        The keys of a ramp mean nothing to a sine: a table that names another kind drops what lay below it.
        """
        under = self.value(key)
        for sort, common in _SORTS.items():
            common = _OF_EVERY_KIND.get(key, common)
            if sort in over and under.get(sort, "" if key in _KINDLESS else over[sort]) != over[sort]:
                for name in [n for n in under if n not in common and self.origins.get((*key, n)) != origin]:
                    self._forget((*key, name))
                    del under[name]
        instead = set[str]().union(*(others for name, others in _INSTEAD.get(key, {}).items() if name in over))
        for name in instead & under.keys() - over.keys():
            self._forget((*key, name))
            del under[name]
        if origin != COMMAND_LINE or key not in self.origins:
            self.origins[key] = origin
        for name, value in over.items():
            inner = (*key, name)
            if isinstance(value, dict) and isinstance(under.get(name), dict):
                self.lay(value, origin, inner)
            else:
                self._forget(inner)
                under[name] = value
                self._remember(inner, value, origin)

    def _forget(self, key: KeyPath) -> None:
        for old in [old for old in self.origins if old[: len(key)] == key]:
            del self.origins[old]

    def _remember(self, key: KeyPath, value: Any, origin: str) -> None:
        self.origins[key] = origin
        if isinstance(value, dict):
            for name, inner in value.items():
                self._remember((*key, name), inner, origin)


def read_layers(path: Path) -> Layers:
    """Returns the scene file at ``path`` laid over all that it extends; of several the later wins.

    Where there is no such file, a path is the name of one that comes with haploop: a scene or, for ``extends``, one
    with its folder, ``devices/premium15.toml``.

    Raises SceneError for a file that cannot be read, or that extends itself. An extended file that is absent is a
    mistake of the layers.
    """
    path = found(path, "scenes")
    layers = Layers(path)
    _read(layers, path, ())
    if layers.mistakes:
        raise SceneError([*layers.gone_over, *layers.mistakes])
    layers.mistakes += layers.gone_over
    return layers


def _read(layers: Layers, path: Path, chain: tuple[Path, ...]) -> None:
    """Lays on the file at ``path``, after the files that it extends."""
    here = Path(os.path.realpath(path))  # where links lead in a circle, reading the file says so
    layers.files += 1
    if len(chain) > DEEPEST or layers.files > _MOST_FILES:
        many = f"At most {DEEPEST} files may extend one another, and at most {_MOST_FILES} in all."
        if layers.files <= _MOST_FILES + 1:
            layers.mistakes.append(Mistake(shown(path), "", "", many))
        return
    if here in chain:
        circle = " extends ".join(shown(p) for p in (*chain[chain.index(here) :], here))
        layers.mistakes.append(Mistake(shown(chain[-1]), "", "", f"A scene cannot extend itself: {circle}."))
        return
    try:
        table = parse(path, doubled=layers.gone_over)
    except SceneError as error:
        layers.mistakes += error.mistakes
        return
    below = table.pop("extends", [])
    names = [below] if isinstance(below, str) else below
    if not isinstance(names, list) or not all(isinstance(name, str) and name and "\0" not in name for name in names):
        expected = "It must be the path of a scene file, or a list of them."
        line = line_in(str(path), ("extends",))
        layers.mistakes.append(Mistake(shown(path), "extends", f"is {_quoted(below)}", expected, line=line))
        return
    for name in names:
        file = found(Path(name), "scenes", path.parent)
        if os.path.lexists(file):
            _read(layers, file, (*chain, here))
        else:
            line = line_in(str(path), ("extends",))
            layers.gone_over.append(Mistake(shown(path), "extends", *_absent(name, path), line=line))
            layers.lacks_a_file = True
    layers.lay(table, str(path))


def _absent(name: str, of: Path) -> tuple[str, str, str | None]:
    """Returns what was found and expected for a name in ``of`` that is not a file, and the nearest one that is."""
    own = {file.name for file in of.parent.glob("*.toml")} - {of.name}
    theirs = {f"{kind}/{one}.toml" for kind in ("devices", "hands", "scenes") for one in bundled(kind)}
    meant = nearest(name if name.endswith(".toml") else f"{name}.toml", sorted(own | theirs))
    if meant is None and (stem := nearest(Path(name).stem, [Path(one).stem for one in sorted(theirs)])):
        meant = next(one for one in sorted(theirs) if Path(one).stem == stem)
    expected = "It must be a file, looked for beside this one, or the name of one that comes with haploop."
    return f"names {_quoted(name)}, but there is no such file", expected, meant


def lay_overrides(layers: Layers, overrides: Iterable[str]) -> None:
    """Lays on each ``dotted.key=value``; what is wrong is added to the mistakes of ``layers``.

    A part of the key that is a number is a place in a list, counted from 0; one past the end adds an element. Tables
    and lists that are absent are made.
    """
    for text in overrides:
        name, value = split_assignment(text) or ("", None)
        path = key_path(name)
        if not path:
            expected = "It must have the form KEY=VALUE with a dotted key, such as dissipation.0.mass=0.02."
            layers.mistakes.append(Mistake(COMMAND_LINE, _shortened(text), "cannot be read", expected))
        elif complaint := lay_value(layers, path, value):
            layers.mistakes.append(Mistake(COMMAND_LINE, name, "cannot be set", complaint))


def lay_value(layers: Layers, path: Sequence[str], value: Any) -> str | None:
    """Makes the path to its last part and lays the value there; returns a sentence if there is no such path."""
    key: tuple[str | int, ...] = ()
    node: Any = layers.data
    for part, after in zip(path, [*path[1:], None], strict=True):
        if isinstance(node, list):
            if not part.isdecimal() or int(part) > len(node):
                count = counted(len(node), "element")
                return f"{'.'.join(map(str, key))} has {count}, counted from 0, so {part} is not one of them."
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
    except (ValueError, RecursionError):
        return ()
    path = []
    while isinstance(node, dict) and node:
        [(part, node)] = node.items()
        path.append(part)
    return tuple(path) if len(path) <= DEEPEST else ()


def split_assignment(text: str) -> tuple[str, Any] | None:
    """Splits ``KEY=VALUE``; the value is TOML where the text is, and the text itself otherwise. None without a key."""
    name, equals, value = text.partition("=")
    if not equals or not name.strip():
        return None
    try:
        table = tomllib.loads(f"value = {value}")
    except (ValueError, RecursionError):
        return name.strip(), value.strip()
    return name.strip(), table["value"] if len(table) == 1 and not excess(table) else value.strip()


def _quoted(value: Any) -> str:
    try:
        text = inline(value)
    except TypeError:
        text = str(value)
    except ValueError:  # Python writes no number of more than some thousand digits
        text = "a number of thousands of digits"
    return _shortened(text)


def _shortened(text: str) -> str:
    return text if len(text) <= 60 else f"{text[:57]}..."
