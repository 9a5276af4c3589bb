"""The reference motion of a scene: a stored one, or one made on the spot by the exact method."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cache
from pathlib import Path

import numpy as np

from haploop.logger.verdict.measures import SMALLEST_SWING_M, WINDOW_S
from haploop.protocol.scene.scene import Hand, Scene
from haploop.tools.trajectory import trajectory

REFERENCES = Path(__file__).parent / "references"
# A reference made on the spot has at least this plant rate, and is checked against half of it.
_LEAST_RATE = 100_000
# Moves of the start that show whether positions at a time can be compared at all: as large as the errors of the methods
# compared.
MOVES_M = (1e-12, -1e-12, 1e-9, -1e-9, 1e-7, -1e-7)
# Beyond this growth of such a move, they cannot.
MOST_GROWTH = 1000.0
# What makes no difference to the continuous problem that a scene poses.
_OF_THE_METHOD = ("plant_rate", "integrator")
_OF_THE_RUN = ("title", "run")


@dataclass(frozen=True)
class Reference:
    """The motion of a scene.

    Attributes:
        how: how it was made and checked, a sentence.
        pointwise: whether positions at a time can be compared; if not, the scene's swings can.
        error_m: how far off they may be, the largest at any tick.
        statistics: see ``statistics``.
        x_m, v_m_s: position and velocity of body 0 at every tick and at the end, shape (ticks + 1,).
    """

    scene: str
    how: str
    verdict: str
    pointwise: bool
    error_m: float
    statistics: dict[str, float | None]
    x_m: np.ndarray
    v_m_s: np.ndarray


def reference_for(scene_path: Path, scene: Scene) -> Reference:
    """Returns the stored reference of the problem that a resolved scene poses at any plant rate, or makes one."""
    return _stored().get(problem_hash(scene)) or made_now(scene_path.stem, scene)


def problem_hash(scene: Scene) -> str:
    """Returns the SHA-256 of a resolved scene without plant rate, integrator, title and ``[run]``."""
    problem = {key: value for key, value in scene.as_dict().items() if key not in _OF_THE_RUN}
    problem["clock"] = {key: value for key, value in problem["clock"].items() if key not in _OF_THE_METHOD}
    return hashlib.sha256(json.dumps(problem, sort_keys=True).encode()).hexdigest()


@cache
def _stored() -> dict[str, Reference]:
    found = {}
    for path in sorted(REFERENCES.glob("*.json")):
        kept = json.loads(path.read_text(encoding="utf-8"))
        kept |= {name: np.array(kept[name]) for name in ("x_m", "v_m_s")}
        found[kept["problem"]] = Reference(**{key.name: kept[key.name] for key in fields(Reference)})
    return found


def made_now(name: str, scene: Scene) -> Reference:
    """Runs the exact method at 100 kHz or above; its distance from half that rate is the error."""
    rate = scene.clock.plant_rate
    half = rate * max(1, math.ceil(_LEAST_RATE / 2 / rate))
    fine, coarse = (trajectory(exactly(scene, r)) for r in (2 * half, half))
    how = (
        f"Made on the spot by the exact method at {2 * half / 1000:g} kHz; its error is how far the exact method "
        f"at {half / 1000:g} kHz is from it."
    )
    if scene.jitter:
        how += " Jitter is drawn in whole plant steps, so every plant rate poses a different problem."
    return Reference(
        scene=name,
        how=how,
        verdict=fine.summary["verdict"],
        pointwise=compares_pointwise(growths(scene, rate)) and not scene.jitter,
        error_m=difference_m(fine.x_m, coarse.x_m),
        statistics=statistics(scene, fine.x_m, fine.v_m_s),
        x_m=fine.x_m,
        v_m_s=fine.v_m_s,
    )


def exactly(scene: Scene, plant_rate: int) -> Scene:
    return replace(scene, clock=replace(scene.clock, plant_rate=plant_rate, integrator="exact"))


def difference_m(x: Sequence[float] | np.ndarray, other: Sequence[float] | np.ndarray) -> float:
    """Returns the largest distance at any tick that both reached; infinite where only one got to the end."""
    if len(x) != len(other):
        return math.inf
    return float(np.abs(np.asarray(x) - np.asarray(other)).max())


def growths(scene: Scene, plant_rate: int) -> dict[str, float]:
    """Returns, for each move of the start (m, as text), how many times as far apart the runs get at most."""
    exact = exactly(scene, plant_rate)
    start = trajectory(exact)
    found = {}
    for move in MOVES_M:
        moved = replace(exact, device=replace(exact.device, position=exact.device.position + move))
        found[f"{move:g}"] = difference_m(start.x_m, trajectory(moved).x_m) / abs(move)
    return found


def compares_pointwise(growth: dict[str, float]) -> bool:
    """Tells by ``growths`` whether positions at a time can be compared."""
    return max(growth.values()) <= MOST_GROWTH


def statistics(scene: Scene, x_m: np.ndarray, v_m_s: np.ndarray) -> dict[str, float | None]:
    """Measures the swings over the verdict's window: the last half second, or the second half of a shorter run.

    ``amplitude_m`` is half of peak to peak. ``frequency_Hz`` counts upward crossings of the mean, and
    ``energy_per_cycle_J`` is what the dampers and the dry friction between body 0 and ground turn into heat in the same
    whole cycles, which in a limit cycle of a device held rigidly is what the loop feeds in. Both are None for less than
    a whole swing.

    Args:
        x_m, v_m_s: of body 0 at every tick and at the end, shape (ticks + 1,).
    """
    rate, ticks = scene.clock.control_rate, len(x_m) - 1
    window = round(WINDOW_S * rate)
    first = ticks - (window if ticks >= window else ticks // 2)
    x, v = x_m[first:], v_m_s[first:]
    figures: dict[str, float | None] = {"amplitude_m": float(np.ptp(x)) / 2.0}
    offset = x - x.mean()
    below = np.flatnonzero((offset[:-1] < 0.0) & (offset[1:] >= 0.0))
    smallest = max(scene.count_m, SMALLEST_SWING_M)
    if len(below) < 2 or not np.ptp(x) > 2.0 * smallest:
        return figures | {"frequency_Hz": None, "energy_per_cycle_J": None}
    crossings = below + offset[below] / (offset[below] - offset[below + 1])
    period_s = float(crossings[-1] - crossings[0]) / (len(crossings) - 1) / rate
    inside = v[below[0] + 1 : below[-1] + 1]
    kinetic_N = scene.friction.kinetic if scene.friction else 0.0
    power = _damping(scene) * inside**2 + kinetic_N * np.abs(inside)
    return figures | {"frequency_Hz": 1.0 / period_s, "energy_per_cycle_J": float(power.mean()) * period_s}


def _damping(scene: Scene) -> float:
    """Between body 0 and ground, N s/m."""
    if scene.transmission:
        return scene.transmission.motor_damping
    hand = scene.hand or Hand()
    return scene.device.damping + (0.0 if hand.grip else hand.damping)
