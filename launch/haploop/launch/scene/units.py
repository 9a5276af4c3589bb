"""Text with a unit, as numbers in another: ``"-60 mm"`` is exactly -0.060 m, since the arithmetic is decimal."""

from __future__ import annotations

import math
import re
from decimal import Decimal
from functools import cache, lru_cache
from itertools import product
from typing import Any

from haploop.protocol.names import nearest

_NUMBER = r"[+-]?(?:\d[\d_]*\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?"
# Products, quotients, one-digit powers and roots of names: nothing else is passed to pint, which does arithmetic.
_FACTOR = r"(?:[^\W\d]\w*|%|°)(?:(?:\*\*|\^)-?(?:0\.5|\d)|⁻?[¹²³⁴])?"
_UNIT = rf"{_FACTOR}(?:(?:\s*[*/·]\s*|\s+){_FACTOR})*"
# One division by a number, after the amount or after its unit.
_TEXT = re.compile(rf"\s*({_NUMBER})\s*(?:/\s*({_NUMBER})\s*)?({_UNIT})?\s*(?:/\s*({_NUMBER})\s*)?")


def from_text(text: str, target: str) -> Decimal:
    """Returns the number that ``text``, such as ``"0.15 N/mm"`` or ``"0.2 m / 4096"``, is in the unit ``target``.

    Raises ValueError with a full sentence that says why it is not one.
    """
    match = _TEXT.fullmatch(text)
    if not match and re.match(r"\s*[+-]?\d+,\d", text):
        raise ValueError(f'Write decimals with a point, not a comma: "{text.replace(",", ".", 1)}".')
    if not match:
        quotient = f' or "0.2 {target} / 4096"' if target else ""
        raise ValueError(f'It must be a number and its unit, such as "1 {target or "%"}"{quotient}.')
    amount, before, unit, after = match[1], Decimal(match[2] or 1), match[3] or "", Decimal(match[4] or 1)
    if not before * after:
        raise ValueError("A number cannot be divided by 0.")
    if unit or not target:
        return _convert(Decimal(amount) / before / after, unit, target)
    raise ValueError(f'Text must carry a unit, such as "{amount} {target}"; a number without one is written unquoted.')


_AFTER_SLASH = re.compile(r"(.*?\S)\s+/\s+(\S.*)")
_IN_BRACKETS = re.compile(r"(.*?)\s*[(\[]([^)\]]*)[)\]]\s*")
# Units that stand after an underscore; in v_mm_s the second one stands for the stroke of mm/s.
_LENGTH, _TIME, _FORCE = "[cmunµμ]?m", "[munµμ]?s", "[cmk]?N|k?gf|lbf|ozf"
_AFTER_UNDERSCORE = re.compile(rf"(?:.*_)?(?!{_LENGTH}_)[^_]+_({_LENGTH}|{_TIME}|{_LENGTH}[/_]s(?:\^?2)?|{_FORCE})")


def name_and_unit(head: str) -> tuple[str, str]:
    """Returns the name of a column and its unit, "" for none: ``"t (ms)"``, ``"force [mN]"``, ``"x / mm"``.

    In ``"x_mm"`` the unit is part of the name.
    """
    if part := _AFTER_UNDERSCORE.fullmatch(head.strip()):
        return head.strip(), part[1].replace("_", "/")
    match = _IN_BRACKETS.fullmatch(head)
    if match is None and (after := _AFTER_SLASH.fullmatch(head)) and is_unit(after[2]):
        match = after
    return (match[1].strip(), match[2].strip()) if match else (head.strip(), "")


def scale_of(unit: str, target: str) -> float:
    """Returns what numbers in a unit are multiplied by to be in ``target``; 1 for "".

    A number stands for itself, and may have a unit: ``"11 um"`` per count. Raises ValueError with a full sentence.
    """
    if not unit:
        return 1.0
    try:
        text = unit if unit[0] in "+-.0123456789" else f"1 {unit}"
        number = float(unit if is_number(unit) else from_text(text, target))
    except ValueError as error:
        raise ValueError(f"{unit!r} is not a unit for numbers in {target}: {error}") from error
    if not math.isfinite(number) or not number:
        raise ValueError(f"A unit cannot be {number:g} {target}.")
    return number


def is_number(text: str) -> bool:
    """Tells whether a text is a number, nan and inf among them."""
    try:
        float(text)
    except ValueError:
        return False
    return True


# The units that most texts use: exponents of kg, m, s and rad, and the factor to them. Pint knows every unit, but takes
# half a second or more to load; a running loop cannot wait for it.
_PREFIXES = {"": 0, "n": -9, "u": -6, "\u00b5": -6, "\u03bc": -6, "m": -3, "c": -2, "k": 3, "M": 6}
_PREFIXED = {
    "g": ((1, 0, 0, 0), -3),
    "m": ((0, 1, 0, 0), 0),
    "s": ((0, 0, 1, 0), 0),
    "rad": ((0, 0, 0, 1), 0),
    "Hz": ((0, 0, -1, 0), 0),
    "N": ((1, 1, -2, 0), 0),
    "Nm": ((1, 2, -2, 0), 0),  # to pint a count of yarn, a length over a mass
    "J": ((1, 2, -2, 0), 0),
    "W": ((1, 2, -3, 0), 0),
    "Pa": ((1, -1, -2, 0), 0),
}
_UNITS = {
    prefix + name: (exponents, Decimal(1).scaleb(power + own))
    for name, (exponents, own) in _PREFIXED.items()
    for prefix, power in _PREFIXES.items()
} | {
    "%": ((0, 0, 0, 0), Decimal("0.01")),
    "min": ((0, 0, 1, 0), Decimal(60)),
    **dict.fromkeys(("deg", "°"), ((0, 0, 0, 1), Decimal("0.01745329251994329576923690768"))),
    "g_0": ((0, 1, -2, 0), Decimal("9.80665")),
}
_DIMENSIONS = {"[length]": 1, "[mass]": 0, "[time]": 2}
_RAISED = str.maketrans({"\u207b": "^-", "\u00b9": "^1", "\u00b2": "^2", "\u00b3": "^3", "\u2074": "^4"})
_PARTS = re.compile(r"([\s*/·]*)([^\W\d]\w*|%|°)(?:(?:\*\*|\^)(-?[\d.]+))?")

Exponents = tuple[Decimal, ...]


@lru_cache(maxsize=256)
def _exact(unit: str) -> tuple[Exponents, Decimal] | None:
    """Returns a unit's exponents of kg, m, s and rad, and its factor to them; None unless the table has all of it."""
    total, scale = (Decimal(0),) * 4, Decimal(1)
    for between, name, power in _PARTS.findall(unit.translate(_RAISED).replace("^-^", "^-")):
        exponents, factor = _UNITS.get(name, ((), Decimal(0)))
        raised = Decimal(power or 1) * (-1 if "/" in between else 1)
        if not exponents or (factor != 1 and raised % 1):
            return None
        total = tuple(sum_ + raised * exponent for sum_, exponent in zip(total, exponents, strict=True))
        scale *= factor ** int(raised) if factor != 1 else 1
    return total, scale


def is_unit(text: str) -> bool:
    """Tells whether a text is one of the units that most texts use, such as ``mm`` or ``N s/m``."""
    return bool(text.strip()) and _exact(text.strip()) is not None


def has_dimension(text: str, target: str) -> bool:
    """Tells whether a text is a unit that most texts use, of the dimension of the unit ``target``."""
    given, wanted = _exact(text.strip()), _exact(target)
    return bool(text.strip()) and given is not None and wanted is not None and given[0] == wanted[0]


def is_exotic(text: str) -> bool:
    """Tells whether a text is a number with a unit that only pint may know."""
    match = _TEXT.fullmatch(text)
    return bool(match) and _exact(match[3] or "") is None


def _dimension(exponents: Exponents) -> str:
    """Returns a dimension in the words of pint, such as ``[mass] / [time] ** 2``."""
    over: list[str] = []
    under: list[str] = []
    for name, place in _DIMENSIONS.items():
        if power := exponents[place]:
            (over if power > 0 else under).append(name if abs(power) == 1 else f"{name} ** {abs(power)}")
    return " / ".join([" * ".join(over) or ("1" if under else "dimensionless"), *under])


def _convert(amount: Decimal, unit: str, target: str) -> Decimal:
    for _, name, _ in _PARTS.findall(unit):
        if name in _TRAPS:
            raise ValueError(_TRAPS[name])
    given, wanted = _exact(unit), _exact(target)
    if given is None or wanted is None:
        return _convert_any(amount, unit, target)
    if given[0][:-1] != wanted[0][:-1]:
        raise ValueError(_another_dimension(unit, _dimension(given[0]), target, _dimension(wanted[0])))
    if given[0] != wanted[0]:
        raise ValueError(_angle(unit, target))
    return amount * (given[1] / wanted[1])


# Quantities by their dimension, for readers to whom N s/m says more than [mass] / [time].
_QUANTITIES = {
    "[length]": "a length", "[mass]": "a mass", "[time]": "a time", "1 / [time]": "a rate",
    "[length] / [time]": "a speed", "[length] / [time] ** 2": "an acceleration",
    "[mass] / [time]": "a damping", "[mass] / [time] ** 2": "a stiffness",
    "[length] ** 2": "an area", "[mass] / [length] / [time] ** 2": "a pressure",
    "[length] ** 2 * [mass] / [time] ** 3": "a power", "dimensionless": "a bare number",
    "[length] * [mass] / [time] ** 2": "a force", "[length] ** 2 * [mass] / [time] ** 2": "a torque or an energy",
}  # fmt: skip
# Names that pint takes for a unit of the same dimension other than the one that is mostly meant.
_TRAPS = {
    "gr": "gr is the grain, 65 mg; write g.", "mgr": "mgr is a thousandth of the grain, 65 ng; write mg.",
    "ton": "ton is the short ton, 907 kg; write t, which is 1000 kg.",
}  # fmt: skip


def _another_dimension(unit: str, dimension: object, target: str, wanted: object) -> str:
    given, named = _QUANTITIES.get(str(dimension)), _QUANTITIES.get(str(wanted))
    if given and named:
        example = f", such as {target}" if target else ""
        return f"{unit} is {given}; {named} was expected{example}."
    return f"{unit or 'A bare number'} has the dimension {dimension}, but {target or 'a bare number'} has {wanted}."


def _angle(unit: str, target: str) -> str:
    # To pint an angle is a bare number, so that 1 rad/s would pass for 1 Hz.
    return f"{unit} contains an angle and cannot be used for {target or 'a bare number'}."


def _convert_any(amount: Decimal, unit: str, target: str) -> Decimal:
    units = _registry()
    try:
        given, wanted = units.parse_units(unit), units.parse_units(target)
        angles = [_angle_power(units.Quantity(Decimal(1), u)) for u in (given, wanted)]
    except Exception as error:  # what a parser of arbitrary text raises is not documented
        example = f', such as "{target}"' if " " in target else ""
        hint = f"did you mean {meant}?" if (meant := _meant(unit, target)) else ""
        hint = hint or f"leave a space between multiplied units{example}."
        raise ValueError(f'"{unit}" is not a unit; {hint}') from error
    if given.dimensionality != wanted.dimensionality:
        raise ValueError(_another_dimension(unit, given.dimensionality, target, wanted.dimensionality))
    if angles[0] != angles[1]:
        raise ValueError(_angle(unit, target))
    return units.Quantity(amount, given).to(wanted).magnitude


# Names of units in words, with their symbols.
_IN_WORDS = {
    "seconds": "s", "milliseconds": "ms", "microseconds": "us", "minutes": "min", "metres": "m", "centimetres": "cm",
    "millimetres": "mm", "micrometres": "um", "grams": "g", "kilograms": "kg", "newtons": "N", "hertz": "Hz",
    "kilohertz": "kHz",
}  # fmt: skip


def _alike(name: str) -> list[str]:
    """Returns the units that differ from a name only in upper and lower case; the name itself if there is none."""
    return [name] if name in _UNITS else [sign for sign in _UNITS if sign.lower() == name.lower()] or [name]


def _meant(unit: str, target: str) -> str | None:
    """Returns the unit of the dimension of ``target`` that comes nearest to a text that is not a unit."""
    if (wanted := _exact(target)) is None:
        return None
    for names in product(*(_alike(name) for _, name, _ in _PARTS.findall(unit))):
        written = iter(names)
        text = re.sub(r"[^\W\d]\w*|%", lambda _: next(written), unit)  # noqa: B023  called at once
        if (_exact(text) or ((),))[0] == wanted[0]:
            return text
    signs = {**dict.fromkeys(_UNITS), **_IN_WORDS}
    alike = [name for name, sign in signs.items() if (_exact(sign or name) or ((),))[0] == wanted[0]]
    return nearest(unit, alike)


def _angle_power(quantity: Any) -> Any:
    return dict(quantity.to_base_units().unit_items()).get("radian", 0)


@cache
def _registry() -> Any:
    """Loads pint, which takes half a second, with the first text that carries a unit the table does not have."""
    import pint

    return pint.UnitRegistry(non_int_type=Decimal)  # pyright: ignore[reportArgumentType]
