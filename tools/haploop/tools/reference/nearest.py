"""The reference motion of a scene: a stored one, or one made on the spot by the exact method."""

from __future__ import annotations

import copy
import hashlib
import json
import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from haploop.logger.verdict.measures import WINDOW_S
from haploop.logger.verdict.verdict import SMALLEST_SWING_M
from haploop.tools.trajectory import trajectory

REFERENCES = Path(__file__).parent / "stored"
# A reference made on the spot has at least this plant rate, and is checked against half of it.
_LEAST_RATE = 100_000
# Starts moved by so much tell whether positions at a time can be compared at all: the errors of the methods compared.
MOVES_M = (1e-12, -1e-12, 1e-9, -1e-9, 1e-7, -1e-7)
# Beyond this growth of such a move, they cannot.
MOST_GROWTH = 1000.0
# What is of no consequence to the continuous problem that a scene poses.
_OF_THE_METHOD = ("plant_rate", "integrator")
_OF_THE_RUN = ("title", "run")


@dataclass(frozen=True)
class Reference:
    """The motion of a scene.

    Attributes:
        scene: its name.
        x_m, v_m_s: position and velocity of body 0 at every tick and at the end, shape (ticks + 1,).
        error_m: how far off they may be, the largest at any tick.
        statistics: see ``statistics``.
        pointwise: whether positions at a time can be compared; if not, the scene's swings can.
        how: how it was made and checked, a sentence.
        verdict: the word.
    """

    scene: str
    x_m: np.ndarray
    v_m_s: np.ndarray
    error_m: float
    statistics: dict[str, float | None]
    pointwise: bool
    how: str
    verdict: str


def reference_for(scene_path: Path, scene: dict[str, Any]) -> Reference:
    """Returns the stored reference of the problem that a resolved scene poses at any plant rate, or makes one."""
    stored = _stored().get(problem_hash(scene))
    return stored or made_now(scene_path.stem, scene)


def problem_hash(scene: dict[str, Any]) -> str:
    """Returns the SHA-256 of a resolved scene without plant rate, integrator, title and ``[run]``."""
    problem = {key: value for key, value in scene.items() if key not in _OF_THE_RUN}
    problem["clock"] = {key: value for key, value in scene["clock"].items() if key not in _OF_THE_METHOD}
    return hashlib.sha256(json.dumps(problem, sort_keys=True).encode()).hexdigest()


@cache
def _stored() -> dict[str, Reference]:
    return {data.pop("problem"): _read(data) for data in map(_load, sorted(REFERENCES.glob("*.json")))}


def _load(path: Path) -> dict[str, Any]:
    return json.loads(path.read_text(encoding="utf-8"))


def _read(data: dict[str, Any]) -> Reference:
    arrays = {name: np.array(data[name]) for name in ("x_m", "v_m_s")}
    rest = ("scene", "error_m", "statistics", "pointwise", "how", "verdict")
    return Reference(**arrays, **{name: data[name] for name in rest})


def made_now(name: str, scene: dict[str, Any]) -> Reference:
    """Runs the exact method at 100 kHz or above; its distance from half that rate is the error."""
    rate = scene["clock"]["plant_rate"]
    half = rate * max(1, math.ceil(_LEAST_RATE / 2 / rate))
    fine, coarse = (trajectory(exactly(scene, r)) for r in (2 * half, half))
    apart = difference_m(fine.x_m, coarse.x_m)
    pointwise = compares_pointwise(growths(scene, rate))
    how = (
        f"Made on the spot by the exact method at {2 * half / 1000:g} kHz; its error is how far the exact method "
        f"at {half / 1000:g} kHz is from it."
    )
    if "jitter" in scene:
        pointwise = False
        how += " Jitter is drawn in whole plant steps, so every plant rate poses another problem."
    figures = statistics(scene, fine.x_m, fine.v_m_s)
    return Reference(name, fine.x_m, fine.v_m_s, apart, figures, pointwise, how, fine.summary["verdict"])


def exactly(scene: dict[str, Any], plant_rate: int) -> dict[str, Any]:
    """Returns the scene with the exact method at a plant rate."""
    return {**scene, "clock": {**scene["clock"], "plant_rate": plant_rate, "integrator": "exact"}}


def difference_m(x: Any, other: Any) -> float:
    """Returns the largest distance at any tick that both reached; infinite where only one got to the end."""
    if len(x) != len(other):
        return math.inf
    return float(np.abs(np.asarray(x) - np.asarray(other)).max())


def growths(scene: dict[str, Any], plant_rate: int) -> dict[str, float]:
    """Returns by each move of the start (m, as text) how many times as far apart the runs get at most."""
    start = trajectory(exactly(scene, plant_rate))
    found = {}
    for move in MOVES_M:
        moved = copy.deepcopy(scene)
        moved["device"]["position"] += move
        end = trajectory(exactly(moved, plant_rate))
        found[f"{move:g}"] = difference_m(start.x_m, end.x_m) / abs(move)
    return found


def compares_pointwise(growth: dict[str, float]) -> bool:
    """Tells by ``growths`` whether positions at a time can be compared."""
    return max(growth.values()) <= MOST_GROWTH


def statistics(scene: dict[str, Any], x_m: np.ndarray, v_m_s: np.ndarray) -> dict[str, float | None]:
    """Measures the swings over the verdict's window: the last half second, or the second half of a shorter run.

    ``amplitude_m`` is half of peak to peak. ``frequency_Hz`` counts upward crossings of the mean, and
    ``energy_per_cycle_J`` is what the dampers and the dry friction between body 0 and ground turn into heat in the same
    whole cycles, which in a limit cycle of a device held rigidly is what the loop feeds in. Both are None for less than
    a whole swing.

    Args:
        x_m, v_m_s: of body 0 at every tick and at the end, shape (ticks + 1,).
    """
    rate, ticks = scene["clock"]["control_rate"], len(x_m) - 1
    window = round(WINDOW_S * rate)
    first = ticks - (window if ticks >= window else ticks // 2)
    x, v = x_m[first:], v_m_s[first:]
    figures: dict[str, float | None] = {"amplitude_m": float(np.ptp(x)) / 2.0}
    offset = x - x.mean()
    below = np.flatnonzero((offset[:-1] < 0.0) & (offset[1:] >= 0.0))
    smallest = max(scene.get("encoder", {}).get("resolution", 0.0), SMALLEST_SWING_M)
    if len(below) < 2 or not np.ptp(x) > 2.0 * smallest:
        return figures | {"frequency_Hz": None, "energy_per_cycle_J": None}
    crossings = below + offset[below] / (offset[below] - offset[below + 1])
    period_s = float(crossings[-1] - crossings[0]) / (len(crossings) - 1) / rate
    inside = v[below[0] + 1 : below[-1] + 1]
    power = _damping(scene) * inside**2 + scene.get("friction", {}).get("kinetic", 0.0) * np.abs(inside)
    return figures | {"frequency_Hz": 1.0 / period_s, "energy_per_cycle_J": float(power.mean()) * period_s}


def _damping(scene: dict[str, Any]) -> float:
    """Returns the damping between body 0 and ground, N s/m."""
    if "transmission" in scene:
        return scene["transmission"]["motor_damping"]
    hand = scene.get("hand", {})
    return scene["device"]["damping"] + (0.0 if "grip" in hand else hand.get("damping", 0.0))
