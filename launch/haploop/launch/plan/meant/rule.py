"""A rule of what cannot be meant, and the note that it gives."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from haploop.protocol.scene.scene import Scene

Found = Mapping[str, Any]


class Note(str):
    """A sentence on a scene that is in order.

    Attributes:
        key: what it speaks of, a dotted key of the resolved scene.
        keeps_off: whether it tells why the device does not touch the wall.
    """

    __slots__ = ("keeps_off", "key")

    def __new__(cls, sentence: str, key: str = "", keeps_off: bool = False) -> Note:
        note = super().__new__(cls, sentence)
        note.key, note.keeps_off = key, keeps_off
        return note


class Rule(NamedTuple):
    """A rule: the numbers of its sentence where a resolved scene breaks it, None where it holds.

    ``key`` is what it speaks of; its name in braces is taken from what was found.
    """

    broken: Callable[[Scene], Found | None]
    key: str
    sentence: str
    keeps_off: bool = False
