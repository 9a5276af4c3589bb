"""Lookup of a dotted key in the scene model: the number it holds, with unit and bounds, or that there is none."""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Mapping, Sequence
from types import UnionType
from typing import TYPE_CHECKING, Annotated, Any, Union, get_args, get_origin

from haploop.launch.scene.mistakes import nearest
from haploop.launch.scene.models import Model, scene_model
from haploop.launch.scene.number import Number

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element


class NoSuchKey(ValueError):
    """A key that no scene of this shape has.

    Attributes:
        given, expected, nearest: as for a ``Mistake``.
    """

    def __init__(self, given: str, expected: str, nearest: str | None = None) -> None:
        super().__init__(expected)
        self.given, self.expected, self.nearest = given, expected, nearest


def number_at(path: Sequence[str], scene: dict[str, Any], kinds: Mapping[str, type[Element]]) -> Number | None:
    """Returns the reader of the number at a key; None where the key holds something else than a number.

    Args:
        path: parts of the dotted key.
        scene: says which kind each table is that has kinds.
        kinds: element kinds at hand.

    Raises:
        NoSuchKey: no scene like this one has the key.
    """
    choices: list[Any] = [scene_model(kinds)]
    value: Any = scene
    for depth, part in enumerate(path):
        place = ".".join(path[:depth])
        if tables := [choice for choice in choices if inspect.isclass(choice) and issubclass(choice, Model)]:
            choices = _field(_chosen(tables, value, place), part, place)
            value = value.get(part) if isinstance(value, dict) else None
        elif lists := [choice for choice in choices if get_origin(choice) is list]:
            if not part.isdecimal():
                raise NoSuchKey("cannot be set", f"{place} is a list, counted from 0, so {part} is none of its places.")
            choices = [*_alternatives(get_args(lists[0])[0])]
            items = value if isinstance(value, list) else []
            value = items[int(part)] if int(part) < len(items) else None
        elif any(get_origin(choice) is dict for choice in choices):
            return None
        else:
            raise NoSuchKey("cannot be set", f"{place} holds a value, not a table.")
    return next((choice for choice in choices if isinstance(choice, Number)), None)


def _field(table: type[Model], name: str, place: str) -> list[Any]:
    """Returns the annotations of a key of a table."""
    if name not in table.model_fields:
        names = list(table.model_fields)
        where = f"[{place}]" if place else "a scene"
        raise NoSuchKey(f"is not a key of {where}", f"Allowed: {', '.join(names)}.", nearest(name, names))
    field = table.model_fields[name]
    return [*field.metadata, *_alternatives(field.annotation)]


def _chosen(tables: Sequence[type[Model]], value: Any, place: str) -> type[Model]:
    """Returns of tables of several kinds the one that the scene names."""
    kinds = {get_args(table.model_fields["kind"].annotation)[0]: table for table in tables if len(tables) > 1}
    if not kinds:
        return tables[0]
    kind = value.get("kind") if isinstance(value, dict) else None
    if kind not in kinds:
        raise NoSuchKey(
            "cannot be set", f"[{place}] of the base scene names no kind; set {place}.kind first: {', '.join(kinds)}."
        )
    return kinds[kind]


def _alternatives(annotation: Any) -> Iterator[Any]:
    """Yields the numbers, tables, lists and names among the alternatives of a type."""
    origin = get_origin(annotation)
    if origin is Annotated:
        inner, *marks = get_args(annotation)
        yield from (mark for mark in marks if isinstance(mark, Number))
        yield from _alternatives(inner)
    elif origin in (Union, UnionType):
        for choice in get_args(annotation):
            yield from _alternatives(choice)
    else:
        yield annotation
