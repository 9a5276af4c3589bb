"""A plain loop that a hand presses against its wall, as tables for ``scene``."""

from __future__ import annotations

from typing import Any

PLAIN: dict[str, Any] = {
    "duration": 2.0,
    "device": {"mass": 0.1, "damping": 0.5},
    "wall": {"position": 0.0, "stiffness": 500.0},
    "clock": {"round_trip_delay": 0.0},
}
# A device thrown at a wall behind coarse counts, with friction: it swings on for as long as nobody touches it.
THROWN = {
    "duration": 3.0,
    "device": {"mass": 0.00901908, "damping": 0.1, "position": 0.0005, "velocity": -0.3},
    "friction": {"kinetic": 0.05},
    "encoder": {"resolution": 1e-4},
    "hand": {
        "mass": 0.0985861, "damping": 7.45478, "stiffness": 89.8339,
        "force": {"kind": "ramp", "value": -1.89124, "rise_time": 0.1},
    },
    "wall": {"position": 0.0, "stiffness": 18347.4},
    "dissipation": [{"kind": "damping", "damping": 4.0}],
}  # fmt: skip


def pressed(**tables: Any) -> dict[str, Any]:
    """The plain loop pressed against the wall; without other tables its limit is K = 1 000 N/m."""
    return {**PLAIN, "hand": {"force": {"kind": "constant", "value": -1.0}}, **tables}
