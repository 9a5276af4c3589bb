"""A rule on what cannot be meant, and the note that it gives."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from haploop.protocol.scene.scene import Scene

Found = Mapping[str, Any]


class Note(str):
    """A sentence on a valid scene.

    Attributes:
        key: the dotted key of the resolved scene that it is about.
        keeps_off: whether it says why the device does not touch the wall.
    """

    __slots__ = ("keeps_off", "key")

    def __new__(cls, sentence: str, key: str = "", keeps_off: bool = False) -> Note:
        note = super().__new__(cls, sentence)
        note.key, note.keeps_off = key, keeps_off
        return note


class Rule(NamedTuple):
    """A rule: ``broken`` returns the numbers of its sentence if a resolved scene breaks it, None if it holds.

    ``key`` is what it is about; a name in braces in it is replaced by what was found under that name.
    """

    broken: Callable[[Scene], Found | None]
    key: str
    sentence: str
    keeps_off: bool = False
