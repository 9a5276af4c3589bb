"""Mistakes of a scene, reported in full sentences and all at once."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

COMMAND_LINE = "--set"
# At most this many mistakes are reported; if there are more, one of them causes the others.
_MOST_TOLD = 50
# Of entries of a list with the same mistake, as many beside the first are told one by one.
_FEW = 3
_ALIKE = " The same is wrong with {0} more entries of {1}."


@dataclass(frozen=True)
class Mistake:
    """One mistake.

    Attributes:
        file: the scene file that made it, or ``"--set"``; "" if it need not be named.
        key: dotted key, such as ``dissipation.0.mass``; empty when the file as a whole is wrong.
        given: what was found there ("is -3.0", "is missing", "is not a key of [wall]").
        expected: what is allowed, a full sentence.
        nearest: the allowed name that comes nearest to the one given.
        line: line of the file, from 1; None if there is none, as for what --set gives.
    """

    file: str
    key: str
    given: str
    expected: str
    nearest: str | None = None
    line: int | None = None

    def __str__(self) -> str:
        place = f"{self.file}:{self.line}" if self.line else self.file
        where = f"{place}: " if place else ""
        if not self.key:
            return f"{where}{self.expected}"
        hint = f"; did you mean {self.nearest}?" if self.nearest else "."
        return f"{where}{self.key} {self.given}{hint} {self.expected}"


class SceneError(ValueError):
    """A scene that cannot be run; it holds every mistake, by file and line."""

    def __init__(self, mistakes: Iterable[Mistake]) -> None:
        found = _without_repeats(_without_twins(list(dict.fromkeys(mistakes))))
        files = list(dict.fromkeys(one.file for one in found))
        self.mistakes = sorted(found, key=lambda one: (files.index(one.file), one.line or math.inf))
        told = [str(mistake) for mistake in self.mistakes[:_MOST_TOLD]]
        more = len(self.mistakes) - len(told)
        super().__init__("\n".join([*told, f"... and {counted(more, 'more mistake')}."] if more else told))

    def __reduce__(self) -> tuple[Any, ...]:
        """Makes it again from its mistakes where it comes to another process."""
        return SceneError, (self.mistakes,)


def _without_twins(mistakes: list[Mistake]) -> list[Mistake]:
    """Returns mistakes without the keys that are missing only because they are misspelt in the same table."""
    meant = {(_split(one.key)[0], one.nearest) for one in mistakes if one.nearest and "is not a key" in one.given}
    return [one for one in mistakes if one.given != "is missing" or _split(one.key) not in meant]


def _without_repeats(mistakes: list[Mistake]) -> list[Mistake]:
    """Returns mistakes with those that many entries of a list have in common, ``list.3``, told once."""
    alike: dict[tuple[str, str, str], list[Mistake]] = {}
    for one in mistakes:
        table, name = _split(one.key)
        alike.setdefault((one.file, table if name.isdecimal() else one.key, one.expected), []).append(one)
    told = list[Mistake]()
    for same in alike.values():
        first, more = same[0], len(same) - 1
        table, name = _split(first.key)
        is_one = name.isdecimal() and more > _FEW
        told += [replace(first, expected=first.expected + _ALIKE.format(more, table))] if is_one else same
    return told


def _split(key: str) -> tuple[str, str]:
    table, _, name = key.rpartition(".")
    return table, name


def counted(count: int, name: str) -> str:
    """Returns a count with its noun: ``1 element``, ``2 elements``."""
    return f"{count} {name}" + "s" * (count != 1)


def shown(path: Path | str) -> str:
    """Returns a file's path as readers want it: relative when it lies below the working directory."""
    here = Path.cwd()
    path = Path(os.path.normpath(here / path))
    return str(path.relative_to(here)) if path.is_relative_to(here) else str(path)
