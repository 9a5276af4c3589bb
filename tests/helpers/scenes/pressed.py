"""A plain loop that a hand presses against its wall, as tables for ``scene``."""

from __future__ import annotations

from typing import Any

PLAIN: dict[str, Any] = {
    "duration": 2.0,
    "device": {"mass": 0.1, "damping": 0.5},
    "wall": {"position": 0.0, "stiffness": 500.0},
    "clock": {"round_trip_delay": 0.0},
}


def pressed(**tables: Any) -> dict[str, Any]:
    """The plain loop pressed against the wall; without other tables its limit is K = 1 000 N/m."""
    return {**PLAIN, "hand": {"force": {"kind": "constant", "value": -1.0}}, **tables}
