"""The values of an axis: a list of them, or from one to another in steps, even or in ratio."""

from __future__ import annotations

from collections.abc import Iterator
from decimal import Decimal
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

from haploop.launch.scene.models import Model
from haploop.launch.scene.number import Number, si
from haploop.protocol.quantity import Quantity

# Of one axis; more is a slip of a key.
MOST_POINTS = 1_000_000
# A last step may miss the end by this part of a step, from rounding.
_ROUNDING = Decimal("1e-9")


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
        if (self.step is None) == (self.count is None):
            _refuse("It must have exactly one of step and count.")
        if self.scale == "log" and self.step is not None:
            _refuse('With scale = "log" it must have a count in place of a step.')
        return self


def _refuse(sentence: str) -> None:
    raise PydanticCustomError("sentence", "{sentence}", {"sentence": sentence})


class PointsError(ValueError):
    """Values that are none; the message is a full sentence.

    Attributes:
        key: of the span that is wrong, or the place in the list; empty for the whole.
    """

    def __init__(self, key: str | int, sentence: str) -> None:
        super().__init__(sentence)
        self.key = key


def make_points(span: Span, number: Number) -> list[float]:
    """Returns the values of a span in SI units.

    Raises:
        PointsError: an end or the step is no such number, or they do not go together.
    """
    first, last = (_read(number, key, value) for key, value in (("from", span.start), ("to", span.to)))
    if first == last:
        raise PointsError("to", "It must differ from the value that the axis starts from.")
    if span.scale == "log":
        assert span.count
        values = _in_ratio(first, last, span.count)
        return list(dict.fromkeys(map(round, values))) if number.whole else values
    if span.count:
        values = _even(Decimal(repr(first)), Decimal(repr(last)), span.count - 1)
    else:
        step = _read(Number(Quantity(number.quantity.unit, above=0.0)), "step", span.step)
        values = _even(Decimal(repr(first)), Decimal(repr(last)), _steps(first, last, step))
    return [_read(number, "count" if span.count else "step", value) for value in values]


def listed(values: list[Any], number: Number | None) -> list[Any]:
    """Returns the values of a list, numbers in SI units.

    Raises:
        PointsError: there are none, one is no such number, or stands there twice.
    """
    if not values:
        raise PointsError("", "It must have at least one value.")
    read = [value if number is None else _read(number, place, value) for place, value in enumerate(values)]
    seen: set[str] = set()
    for place, value in enumerate(read):
        if repr(value) in seen:
            raise PointsError(place, "Every value may stand there once.")
        seen.add(repr(value))
    return read


def _read(number: Number, key: str | int, value: Any) -> float:
    try:
        return number.read(value)
    except PydanticCustomError as error:
        raise PointsError(key, error.message()) from error


def _steps(first: float, last: float, step: float) -> int:
    """Counts the steps between the ends."""
    ratio = abs(Decimal(repr(last)) - Decimal(repr(first))) / Decimal(repr(step))
    count = round(ratio)
    if count > MOST_POINTS:
        raise PointsError("step", f"It makes {count + 1} values; an axis has at most {MOST_POINTS}.")
    if abs(ratio - count) > _ROUNDING * max(1, count):
        way = 1 if last > first else -1
        ends = [float(Decimal(repr(first)) + way * n * Decimal(repr(step))) for n in (int(ratio), int(ratio) + 1)]
        raise PointsError(
            "to", f"It must be a whole number of steps from the start, such as {ends[0]:g} or {ends[1]:g}."
        )
    return count


def _even(first: Decimal, last: Decimal, steps: int) -> Iterator[float]:
    """Yields even steps, computed in decimal, so that 0.1, 0.2, 0.3 are the numbers that a person would write."""
    return (float(first + (last - first) * k / steps) for k in range(steps + 1))


def _in_ratio(first: float, last: float, count: int) -> list[float]:
    """Returns values even in ratio, the ends as they are given."""
    if not first * last > 0.0:
        raise PointsError("scale", "A log scale needs two ends of one sign, neither of them 0.")
    inner = (first * (last / first) ** (k / (count - 1)) for k in range(1, count - 1))
    return [first, *inner, last]
