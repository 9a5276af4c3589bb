"""Numbers in a scene: a declared quantity becomes a key that reads, bounds and documents itself.

Text with a unit is converted in decimal arithmetic: ``"-60 mm"`` is exactly -0.060 m.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from decimal import Decimal
from functools import cache
from typing import Any, NoReturn

from pydantic import GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from haploop.protocol.quantity import Quantity
from haploop.protocol.quantity import si as quantity


@dataclass(frozen=True)
class Number:
    """Metadata that makes ``Annotated[float, Number(Quantity(...))]`` take SI numbers and text with a unit."""

    quantity: Quantity

    def read(self, value: Any) -> float:
        """Returns the number in SI units.

        Raises:
            PydanticCustomError: not a number, not finite, out of bounds, or of another dimension; its message is
                a full sentence.
        """
        if isinstance(value, bool) or not isinstance(value, (int, float, str)):
            _refuse(f"It must be {self.form}.")
        try:
            number = float(from_text(value, self.quantity.unit)) if isinstance(value, str) else value
            complaint = self.quantity.complaint(number)
        except OverflowError:
            _refuse("It must be a number that a float can hold.")
        except ValueError as error:
            _refuse(str(error))
        if complaint:
            _refuse(f"It {complaint}.")
        if not self.quantity.whole:
            return float(number)
        if number != int(number):
            _refuse(f"It must be {self.form}.")
        return int(number)

    @property
    def form(self) -> str:
        """The form to write: 'a number in kg, above 0, or text with its unit'."""
        q = self.quantity
        bounds = {"at least": q.at_least, "above": q.above, "at most": q.at_most, "below": q.below}
        words = " and ".join(f"{word} {bound:g}" for word, bound in bounds.items() if bound is not None)
        unit = f" in {q.unit}" if q.unit else ""
        text = f', or text with its unit such as "1 {q.unit}"' if q.unit else ""
        return ("a whole number" if self.quantity.whole else "a number") + unit + (words and f", {words}") + text

    def __get_pydantic_core_schema__(self, _source: Any, _handler: Any) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(self, _schema: CoreSchema, _handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        q = self.quantity
        bounds = {"minimum": q.at_least, "exclusiveMinimum": q.above, "maximum": q.at_most, "exclusiveMaximum": q.below}
        return {
            "type": ["integer" if self.quantity.whole else "number", "string"],
            "description": ": ".join(filter(None, [q.about, self.form])),
            **{name: bound for name, bound in bounds.items() if bound is not None},
        }


def si(unit: str, about: str = "", *, whole: bool = False, **bounds: float) -> Number:
    """Makes a ``Number`` in one line: ``mass: Annotated[float, si("kg", "mass of the device", above=0)]``."""
    return Number(quantity(unit, about, whole=whole, **bounds))


def _refuse(sentence: str) -> NoReturn:
    raise PydanticCustomError("sentence", "{sentence}", {"sentence": sentence})


_NUMBER = r"[+-]?(?:\d[\d_]*\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?"
# Products, quotients, one-digit powers and roots of names: no more of arithmetic is let through to pint, which would
# do it.
_FACTOR = r"(?:[^\W\d]\w*|%|°)(?:(?:\*\*|\^)-?(?:0\.5|\d)|⁻?[¹²³⁴])?"
_TEXT = re.compile(rf"\s*({_NUMBER})\s*({_FACTOR}(?:(?:\s*[*/·]\s*|\s+){_FACTOR})*)?\s*")


def from_text(text: str, target: str) -> Decimal:
    """Returns the number that ``text``, such as ``"0.15 N/mm"``, is in the unit ``target``.

    Raises ValueError with a full sentence that says why it is none.
    """
    match = _TEXT.fullmatch(text)
    if not match:
        raise ValueError(f'It must be a number and its unit, such as "1 {target or "%"}".')
    amount, unit = match[1], match[2] or ""
    if unit or not target:
        return _convert(Decimal(amount), unit, target)
    raise ValueError(f'Text must carry a unit, such as "{amount} {target}"; a number without one is written unquoted.')


def _convert(amount: Decimal, unit: str, target: str) -> Decimal:
    units = _registry()
    try:
        given, wanted = units.parse_units(unit), units.parse_units(target)
        angles = [_angle_power(units.Quantity(Decimal(1), u)) for u in (given, wanted)]
    except Exception as error:  # what a parser of arbitrary text raises is not documented
        example = f', such as "{target}"' if " " in target else ""
        raise ValueError(f'"{unit}" is not a unit; leave a space between multiplied units{example}.') from error
    if given.dimensionality != wanted.dimensionality:
        raise ValueError(
            f"{unit} has the dimension {given.dimensionality}, "
            f"but {target or 'a bare number'} has {wanted.dimensionality}."
        )
    # To pint an angle is a bare number, so that 1 rad/s would pass for 1 Hz.
    if angles[0] != angles[1]:
        raise ValueError(f"{unit} counts angle and cannot stand for {target or 'a bare number'}.")
    return units.Quantity(amount, given).to(wanted).magnitude


def _angle_power(quantity: Any) -> Any:
    return dict(quantity.to_base_units().unit_items()).get("radian", 0)


@cache
def _registry() -> Any:
    """Loads pint, which takes half a second, with the first text that carries a unit."""
    import pint

    return pint.UnitRegistry(non_int_type=Decimal)  # pyright: ignore[reportArgumentType]
