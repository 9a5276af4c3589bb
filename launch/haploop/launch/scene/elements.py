"""Making the elements a scene names once before it runs: their own code may refuse what their declarations allow."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from haploop.controller.active_elements import make_element
from haploop.protocol.changes import NO_ELEMENT

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element


def elements_of(scene: dict[str, Any]) -> list[dict[str, Any]]:
    """The table of every element a resolved scene begins with or swaps in."""
    return [*scene.get("dissipation", []), *swapped_in(scene.get("event", []))]


def swapped_in(events: Iterable[dict[str, Any]]) -> list[dict[str, Any]]:
    """The table of every element these resolved events bring."""
    return [event["swap"] for event in events if "swap" in event and event["swap"]["kind"] != NO_ELEMENT]


def try_out(tables: Iterable[dict[str, Any]], kinds: Mapping[str, type[Element]]) -> None:
    """Make each element and throw it away.

    Raises:
        ElementError: one cannot be made.
    """
    for table in tables:
        make_element(table, kinds)
