"""The plant's telemetry as people read it: where each body is, and what acts on it."""

from __future__ import annotations

import numpy as np

UNITS = {
    "x": "m",
    "v": "m/s",
    "force": "N",
    "tip_x": "m",
    "tip_v": "m/s",
    "hand_x": "m",
    "hand_v": "m/s",
    "actuator": "N",
    "friction": "N",
}
# Each link of telemetry leads on to the body that the log names.
_FAR_END = {"cable": "tip", "grip": "hand"}


def motion_columns(plant: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Columns of ``UNITS`` from telemetry: positions and velocities of all bodies against ground, forces in N."""
    x, v = plant["x"], plant["v"]
    columns = {"x": x, "v": v, "force": plant["force"]}
    for link, body in _FAR_END.items():
        if f"{link}.stretch" in plant:
            x, v = x + plant[f"{link}.stretch"], v + plant[f"{link}.rate"]
            columns |= {f"{body}_x": x, f"{body}_v": v}
    return columns | {name: plant[name] for name in ("actuator", "friction") if name in plant}
