"""Numbers with their units, and with the prefix that suits their size."""

from __future__ import annotations

import math
from collections.abc import Iterable

PREFIXES = {1e3: "k", 1.0: "", 1e-3: "m", 1e-6: "µ", 1e-9: "n"}


def prefix_for(values: Iterable[float]) -> tuple[float, str]:
    """Returns the factor and letter with which the largest of some values lies between 1 and 1000 where possible."""
    largest = max((abs(value) for value in values if math.isfinite(value)), default=0.0)
    if largest == 0.0:
        return 1.0, ""
    # 999.6 m would be rounded up to 1000 m.
    factor = next((factor for factor in PREFIXES if largest >= factor * 0.9995), 1e-9)
    return factor, PREFIXES[factor]


def amount(value: float | None, unit: str, digits: int = 3) -> str:
    """Returns a number with its unit, ``"5.14 mm"``; a dash for no number, powers of ten where no prefix helps."""
    if value is None or math.isnan(value):
        return "–"
    if not math.isfinite(value):
        return f"{value} {unit}"
    factor, letter = prefix_for([value])
    if value and not 1e-3 <= abs(value) / factor < 1e5:
        return f"{value:.{digits - 1}e} {unit}".replace("-", "−")
    return f"{fixed(value / factor, digits)} {letter}{unit}"


def fixed(value: float, digits: int = 3) -> str:
    """Returns ``digits`` significant digits without powers of ten; digits before the point are never rounded away."""
    if value == 0.0 or not math.isfinite(value):
        return f"{value:g}".replace("-0", "0")
    # Of the number as rounded: 99.97 has three digits before its point.
    before_point = math.floor(math.log10(abs(float(f"{value:.{max(0, digits - 1)}e}")))) + 1
    text = f"{value:.{max(0, digits - before_point)}f}"
    return text.replace("-", "−")
