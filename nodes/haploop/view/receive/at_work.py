"""The elements and the wall of a scene, as the controller tells of them in telemetry."""

from __future__ import annotations

from typing import Any


def elements_of(scene: dict[str, Any]) -> list[dict[str, Any]]:
    """Returns kind and parameters of each element of a resolved scene."""
    return [
        {"kind": table["kind"], "parameters": {name: value for name, value in table.items() if name != "kind"}}
        for table in scene.get("dissipation", [])
    ]


def wall_of(scene: dict[str, Any]) -> dict[str, float]:
    """Returns position in m, stiffness in N/m and direction into the wall, all 0 without a wall."""
    if "wall" not in scene:
        return {"position": 0.0, "stiffness": 0.0, "into_wall": 0.0}
    wall = scene["wall"]
    into_wall = 1.0 if wall.get("occupies") == "above" else -1.0
    return {"position": wall["position"], "stiffness": wall["stiffness"], "into_wall": into_wall}
