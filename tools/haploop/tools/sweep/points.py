"""The values of an axis: the number that its key holds, and a list of values or a range of them.

The steps of a range are even or in a constant ratio.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from decimal import Decimal
from types import UnionType
from typing import TYPE_CHECKING, Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

from haploop.launch.scene.models import Model, scene_model
from haploop.launch.scene.number import Number, si
from haploop.launch.scene.reading.layers import Layers
from haploop.protocol.names import nearest
from haploop.protocol.quantity import Quantity

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element

# Most values of one axis; more are a typing error.
MOST_POINTS = 1_000_000
# A last step may miss the end by this part of a step, from rounding.
_ROUNDING = Decimal("1e-9")
_NOT_SET = "cannot be set"


class AxisError(ValueError):
    """An axis that cannot be swept; its fields are those of a ``Mistake``.

    Attributes:
        place: place of the mistake below the axis: a key of the span, or an index of the list; empty for the whole.
    """

    def __init__(
        self, expected: str, given: str | None = None, nearest: str | None = None, place: str | int = ""
    ) -> None:
        super().__init__(expected, given, nearest, place)
        self.expected, self.given, self.nearest, self.place = expected, given, nearest, place

    def __str__(self) -> str:
        return self.expected


def number_at(path: Sequence[str], scene: Layers, kinds: Mapping[str, type[Element]]) -> Number | None:
    """Returns the reader of the number at a key; None where the key holds something other than a number.

    Args:
        path: parts of the dotted key.
        scene: gives the kind of each table that has kinds.

    Raises:
        AxisError: no scene like this one has the key.
    """
    choices: list[Any] = [scene_model(kinds)]
    value: Any = scene.data
    for depth, part in enumerate(path):
        place = ".".join(path[:depth])
        if tables := [choice for choice in choices if isinstance(choice, type) and issubclass(choice, Model)]:
            choices = _at_key(_chosen(tables, value, place), part, place)
            value = value.get(part) if isinstance(value, dict) else None
        elif lists := [choice for choice in choices if get_origin(choice) is list]:
            if not part.isdecimal():
                raise AxisError(f"{place} is a list, counted from 0, so {part} is not a place in it.", _NOT_SET)
            choices = [*_alternatives(get_args(lists[0])[0])]
            value = value[int(part)] if isinstance(value, list) and int(part) < len(value) else None
        elif any(get_origin(choice) is dict for choice in choices):
            return None
        else:
            raise AxisError(f"{place} holds a value, not a table.", _NOT_SET)
    return next((choice for choice in choices if isinstance(choice, Number)), None)


def _at_key(table: type[Model], name: str, place: str) -> list[Any]:
    if name not in table.model_fields:
        names = list(table.model_fields)
        where = f"[{place}]" if place else "a scene"
        raise AxisError(f"Allowed: {', '.join(names)}.", f"is not a key of {where}", nearest(name, names))
    field = table.model_fields[name]
    return [*field.metadata, *_alternatives(field.annotation)]


def _chosen(tables: Sequence[type[Model]], value: Any, place: str) -> type[Model]:
    if len(tables) == 1:
        return tables[0]
    kinds = {get_args(table.model_fields["kind"].annotation)[0]: table for table in tables}
    kind = value.get("kind") if isinstance(value, dict) else None
    if kind not in kinds:
        raise AxisError(
            f"[{place}] of the base scene names no kind; set {place}.kind first: {', '.join(kinds)}.", _NOT_SET
        )
    return kinds[kind]


def _alternatives(annotation: Any) -> Iterator[Any]:
    """Yields the numbers, tables, lists and names among the alternatives of a type."""
    if get_origin(annotation) is Annotated:
        inner, *marks = get_args(annotation)
        yield from (mark for mark in marks if isinstance(mark, Number))
        yield from _alternatives(inner)
    elif get_origin(annotation) in (Union, UnionType):
        for choice in get_args(annotation):
            yield from _alternatives(choice)
    else:
        yield annotation


class Span(Model):
    """A range from one value to another, both ends included."""

    model_config = ConfigDict(title="span")

    start: Any = Field(alias="from", description="the first value")
    to: Any = Field(description="the last value")
    step: Any = Field(None, description="from one value to the next")
    count: Annotated[int | None, si("", "how many values", whole=True, at_least=2, at_most=MOST_POINTS)] = None
    scale: Literal["linear", "log"] = "linear"

    @model_validator(mode="after")
    def _is_one_way(self) -> Span:
        sentence = ""
        if (self.step is None) == (self.count is None):
            sentence = "It must have exactly one of step and count."
        elif self.scale == "log" and self.step is not None:
            sentence = 'With scale = "log" it must have a count in place of a step.'
        if sentence:
            raise PydanticCustomError("sentence", "{sentence}", {"sentence": sentence})
        return self


def make_points(span: Span, number: Number) -> list[float]:
    """Returns the values of a span in SI units.

    Raises AxisError where an end or the step is no such number, or they do not fit together.
    """
    first, last = _read(number, "from", span.start), _read(number, "to", span.to)
    if first == last:
        raise AxisError("It must differ from the value that the axis starts from.", place="to")
    if span.scale == "log":
        assert span.count
        if not first * last > 0.0:
            raise AxisError("A log scale needs two ends of the same sign, neither of them 0.", place="scale")
        inner = (first * (last / first) ** (k / (span.count - 1)) for k in range(1, span.count - 1))
        values = [first, *inner, last]
        return list(dict.fromkeys(map(round, values))) if number.quantity.whole else values
    steps = span.count - 1 if span.count else _steps(number, first, last, span.step)
    # In decimal, so that the values are the numbers that a person would write: 0.1, 0.2, 0.3.
    begin, way = Decimal(repr(first)), Decimal(repr(last)) - Decimal(repr(first))
    values = (float(begin + way * k / steps) for k in range(steps + 1))
    return [_read(number, "count" if span.count else "step", value) for value in values]


def listed(values: list[Any], number: Number | None) -> list[Any]:
    """Returns the values of a list, numbers in SI units.

    Raises AxisError where there are none, or one is no such number or occurs twice.
    """
    if not values:
        raise AxisError("It must have at least one value.")
    read = [value if number is None else _read(number, place, value) for place, value in enumerate(values)]
    seen: set[str] = set()
    for place, value in enumerate(read):
        if repr(value) in seen:
            raise AxisError("Every value may be given only once.", place=place)
        seen.add(repr(value))
    return read


def _read(number: Number, key: str | int, value: Any) -> float:
    try:
        return number.read(value)
    except PydanticCustomError as error:
        raise AxisError(error.message(), place=key) from error


def _steps(number: Number, first: float, last: float, given: Any) -> int:
    step = Decimal(repr(_read(Number(Quantity(number.quantity.unit, above=0.0)), "step", given)))
    ratio = abs(Decimal(repr(last)) - Decimal(repr(first))) / step
    count = round(ratio)
    if count > MOST_POINTS:
        raise AxisError(f"It makes {count + 1} values; an axis has at most {MOST_POINTS}.", place="step")
    if abs(ratio - count) > _ROUNDING * max(1, count):
        way = 1 if last > first else -1
        low, high = (float(Decimal(repr(first)) + way * whole * step) for whole in (int(ratio), int(ratio) + 1))
        raise AxisError(f"It must be a whole number of steps from the start, such as {low:g} or {high:g}.", place="to")
    return count
