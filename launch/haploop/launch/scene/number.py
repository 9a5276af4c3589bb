"""Numbers in a scene: a declared quantity becomes a key that reads, bounds and documents itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NoReturn

from pydantic import GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from haploop.launch.scene.units import from_text
from haploop.protocol.quantity import Quantity
from haploop.protocol.quantity import si as quantity


@dataclass(frozen=True)
class Number:
    """Metadata that makes ``Annotated[float, Number(Quantity(...))]`` take SI numbers and text with a unit."""

    quantity: Quantity

    def read(self, value: Any) -> Any:
        """Returns the number in SI units, or the choice.

        Raises:
            PydanticCustomError: not a number, not finite, out of bounds, or of another dimension; its message is
                a full sentence.
        """
        if self.quantity.choices:
            if any(choice.__class__ is value.__class__ and choice == value for choice in self.quantity.choices):
                return value
            _refuse(f"It must be {self.form}.")
        if isinstance(value, bool) or not isinstance(value, (int, float, str)):
            _refuse(f"It must be {self.form}.")
        try:
            number = float(from_text(value, self.quantity.unit)) if isinstance(value, str) else value
            complaint = self.quantity.complaint(number)
        except OverflowError:
            _refuse("It must be a number that a float can hold.")
        except ValueError as error:
            _refuse(f"It must be {self.form}." if self.quantity.whole and not self.quantity.unit else str(error))
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
        if q.choices:
            return " or ".join(map(q.text, q.choices))
        bounds = {"at least": q.at_least, "above": q.above, "at most": q.at_most, "below": q.below}
        words = " and ".join(f"{word} {bound:g}" for word, bound in bounds.items() if bound is not None)
        unit = f" in {q.unit}" if q.unit else ""
        text = f', or text with its unit such as "1 {q.unit}"' if q.unit else ""
        return ("a whole number" if self.quantity.whole else "a number") + unit + (words and f", {words}") + text

    def __get_pydantic_core_schema__(self, _source: Any, _handler: Any) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(self, _schema: CoreSchema, _handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        q = self.quantity
        if q.choices:
            return {"enum": [*q.choices], "description": ": ".join(filter(None, [q.about, self.form]))}
        bounds = {"minimum": q.at_least, "exclusiveMinimum": q.above, "maximum": q.at_most, "exclusiveMaximum": q.below}
        return {
            "type": ["integer" if self.quantity.whole else "number", "string"],
            "description": ": ".join(filter(None, [q.about, self.form])),
            **{name: bound for name, bound in bounds.items() if bound is not None},
        }


TIME = Number(Quantity("s", at_least=0, about="time"))


def si(unit: str, about: str = "", *, whole: bool = False, **bounds: float) -> Number:
    """Makes a ``Number`` in one line: ``mass: Annotated[float, si("kg", "mass of the device", above=0)]``."""
    return Number(quantity(unit, about, whole=whole, **bounds))


def _refuse(sentence: str) -> NoReturn:
    raise PydanticCustomError("sentence", "{sentence}", {"sentence": sentence})
