"""Stiffnesses and parameters of elements in words."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from haploop.protocol.amounts import fixed

NO_UNITS: Mapping[str, str] = MappingProxyType({})


def format_stiffness(stiffness_N_m: float, digits: int = 3) -> str:
    """Formats a stiffness in N/m: ``1.42 N/mm``; softer than 0.01 N/mm in N/m; ``any`` for an infinite one."""
    if not math.isfinite(stiffness_N_m):
        return "any"
    if 0.0 < stiffness_N_m < 10.0:
        return f"{fixed(stiffness_N_m, 2)} N/m"
    return f"{fixed(stiffness_N_m / 1e3, digits if stiffness_N_m >= 1e3 else 2)} N/mm"


def spring(stiffness_N_m: float | None) -> str:
    """Returns a stiffness in N/m without a prefix, as scene files have it."""
    if stiffness_N_m is None:
        return "–"
    if abs(stiffness_N_m) >= 1e7:
        return f"{stiffness_N_m:.2e} N/m"
    return f"{fixed(stiffness_N_m)} N/m"


def parameters(table: dict[str, Any], units: Mapping[str, str] = NO_UNITS) -> str:
    """Returns an element's parameters in short, ``"mass 0.01 kg, always"``; that it acts in contact is not mentioned.

    ``units`` are by kind and parameter (``damping.damping``); a parameter without an entry is shown without a unit.
    """
    own = {name: value for name, value in table.items() if name not in ("kind", "acts")}
    kind = table.get("kind")
    words = [
        f"{name} {str(value).lower() if isinstance(value, str | bool) else f'{value:g}'} "
        f"{units.get(f'{kind}.{name}', '')}".rstrip()
        for name, value in own.items()
    ]
    return ", ".join(words + (["always"] if table.get("acts") == "always" else []))
