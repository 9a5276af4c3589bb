"""The places of the dissipation list: which element works in each, and which book its forces are written to."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from haploop.controller.dissipation import Element, ElementError, Motion
from haploop.protocol.arrays import where


class Slot:
    """One element at work.

    A book covers one element with one set of parameters: a swap and a changed parameter both open a new one.

    Attributes:
        book: number of the book, in order of opening within the run.
        from_tick: the tick at which it was opened.
        force: from motion to force in N; 0 out of contact unless the element acts always.
    """

    def __init__(self, element: Element, acts: str, book: int, from_tick: int) -> None:
        self.element, self.acts = element, acts
        self.book, self.from_tick = book, from_tick
        self.force: Callable[[Motion], Any] = element.force if acts == "always" else self._in_contact

    def _in_contact(self, motion: Motion) -> Any:
        return where(motion.contact, self.element.force(motion), 0.0)

    def describe(self) -> dict[str, Any]:
        """Book, kind, parameters and first tick, as they stand in telemetry and summary."""
        return {
            "book": self.book,
            "kind": self.element.kind,
            "parameters": {**self.element.values(), "acts": self.acts},
            "from_tick": self.from_tick,
        }


def make_element(table: dict[str, Any], kinds: Mapping[str, type[Element]]) -> tuple[Element, str]:
    """The element a validated ``[[dissipation]]`` table names, and when it acts.

    Raises:
        ElementError: the element's own code does not take these parameters.
    """
    parameters = {key: value for key, value in table.items() if key not in ("kind", "acts")}
    try:
        return kinds[table["kind"]](**parameters), table.get("acts", "in-contact")
    except Exception as error:
        given = ", ".join(f"{name} = {value}" for name, value in parameters.items()) or "no parameters"
        raise ElementError(
            f"The element {table['kind']} cannot be made with {given}: {type(error).__name__}: {error}"
        ) from error


class Slots:
    """All slots of a controller, in the order in which their forces are added."""

    def __init__(self, tables: list[dict[str, Any]], kinds: dict[str, type[Element]]) -> None:
        self._kinds = kinds
        self._books = 0
        self.slots: list[Slot] = []
        for table in tables:
            self.slots.append(self._slot(*make_element(table, kinds), 0))

    def swap(self, index: int, table: dict[str, Any], tick: int) -> None:
        """Put a new element into slot ``index``, add one past the end, or remove it (kind "none")."""
        if table["kind"] == "none":
            del self.slots[index]
            return
        self.slots[index : index + 1] = [self._slot(*make_element(table, self._kinds), tick)]

    def set_parameter(self, index: int, name: str, value: float, tick: int) -> None:
        """Change one parameter of the element in slot ``index``; its state stays, its book is a new one."""
        slot = self.slots[index]
        setattr(slot.element, name, value)
        self.slots[index] = self._slot(slot.element, slot.acts, tick)

    def _slot(self, element: Element, acts: str, tick: int) -> Slot:
        self._books += 1
        return Slot(element, acts, self._books - 1, tick)
