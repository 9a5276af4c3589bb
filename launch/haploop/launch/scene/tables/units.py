"""Text with a unit, converted in decimal arithmetic: ``"-60 mm"`` is exactly -0.060 m."""

from __future__ import annotations

import re
from decimal import Decimal
from functools import cache
from typing import Any

_NUMBER = r"[+-]?(?:\d[\d_]*\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?"
# Products, quotients, one-digit powers and roots of names: no more of arithmetic is let through to pint, which would
# do it.
_FACTOR = r"(?:[^\W\d]\w*|%|°)(?:(?:\*\*|\^)-?(?:0\.5|\d)|⁻?[¹²³⁴])?"
_TEXT = re.compile(rf"\s*({_NUMBER})\s*({_FACTOR}(?:(?:\s*[*/·]\s*|\s+){_FACTOR})*)?\s*")


def from_text(text: str, target: str) -> Decimal:
    """The number that ``text``, such as ``"0.15 N/mm"``, is in the unit ``target``.

    Raises:
        ValueError: a full sentence that says why it is none.
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
    """pint takes half a second to load, so it comes in with the first text that carries a unit."""
    import pint

    return pint.UnitRegistry(non_int_type=Decimal)  # pyright: ignore[reportArgumentType]
