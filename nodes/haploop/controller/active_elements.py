"""Active elements: those at work in a controller, and the book that each one's forces are written to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NotRequired, TypedDict

from haploop.controller.dissipation import Element, ElementError
from haploop.controller.dissipation.element import raised
from haploop.protocol.scene.scene import ElementTable


class Description(TypedDict):
    """An element and its book, as written to telemetry and summary; ``parameters`` has ``acts`` besides its own.

    ``columns`` has the units of what it shows in the log besides its force, and is left out if that is nothing.
    """

    book: int
    kind: str
    parameters: dict[str, Any]
    from_tick: int
    columns: NotRequired[dict[str, str]]


@dataclass(frozen=True, slots=True)
class ActiveElement:
    """One element at work.

    A book covers one element with one set of parameters: a swap and a changed parameter both open a new one.

    Attributes:
        acts: "always", or "in-contact": the force is 0 out of contact.
        book: number of the book, in order of opening within the run.
        swapped: (tick of the swap that brought it, element that was in its place or None, plugin file that came with
            the swap or None); None for an element of the scene itself.
    """

    element: Element
    acts: str
    book: int
    from_tick: int
    swapped: tuple[int, ActiveElement | None, str | None] | None = None

    def describe(self) -> Description:
        parameters = {**self.element.values(), "acts": self.acts}
        told: Description = {
            "book": self.book, "kind": self.element.kind, "parameters": parameters, "from_tick": self.from_tick,
        }  # fmt: skip
        if self.element.columns:
            told["columns"] = dict(self.element.columns)
        return told


def make_element(table: ElementTable, kinds: Mapping[str, type[Element]]) -> tuple[Element, str]:
    """Makes the element that a validated ``[[dissipation]]`` table names; returns it, and when it acts.

    Raises ElementError if its own code does not accept these parameters.
    """
    try:
        return kinds[table.name](**table.parameters), table.acts
    except (Exception, SystemExit) as error:
        given = ", ".join(f"{name} = {value}" for name, value in table.parameters.items()) or "no parameters"
        what = raised(error, kinds.get(table.name))
        raise ElementError(f"The element {table.name} cannot be made with {given}: {what}") from error


def keeps_attributes(element: Element) -> bool:
    """Tells whether an element has attributes besides its parameters, or a container that its class shares."""
    kinds = type(element).__mro__[: type(element).__mro__.index(Element)]
    entries = [(name, value) for kind in kinds for name, value in vars(kind).items()]
    slots = any(name == "__slots__" for name, _ in entries)
    shared = any(_can_change(value) for name, value in entries if not name.startswith("__"))
    return vars(element).keys() != element.values().keys() or slots or shared


def _can_change(value: Any) -> bool:
    return not isinstance(value, type) and any(hasattr(value, name) for name in ("append", "__setitem__", "add"))


class Unchanged:
    """Guard of the elements of a batch, whose ``force`` may change nothing except the memory that it returns.

    Members share their elements, so an element with attributes of its own would give other numbers than in a run alone.

    Raises:
        ElementError: an element keeps such attributes; from ``check``: it has got some, or has changed a parameter.
    """

    def __init__(self, active: tuple[ActiveElement, ...]) -> None:
        self._elements = [each.element for each in active]
        self._known = [[*vars(element).values()] for element in self._elements]
        for element in filter(keeps_attributes, self._elements):
            raise ElementError(f"The element {element.kind} keeps attributes of its own.")

    def check(self) -> None:
        """Checks the elements again, after a tick."""
        for element, known in zip(self._elements, self._known, strict=True):
            now = vars(element).values()
            if len(now) != len(known) or any(new is not old for new, old in zip(now, known, strict=True)):
                raise ElementError(f"The element {element.kind} has changed attributes of its own.")
