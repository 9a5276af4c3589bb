"""Loops drawn by seed whose stability in contact is known: from the spectral radius of the map of one tick."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from haploop.protocol.scene.scene import Scene
from haploop.tools.linear.one_tick import OneTickMap

KINDS = ("plain", "trembling", "noisy", "short", "bouncing", "close")


@dataclass(frozen=True)
class Drawn:
    """A loop in contact; ``rate_1_s`` is ln rho(M) / T, the eventual growth of any disturbance."""

    kind: str
    scene: Scene
    rate_1_s: float


def drawn(seed: int) -> Drawn | None:
    """The loop of a seed; None where its linear map has no stiffness limit between 50 N/m and 200 N/mm."""
    rng = np.random.default_rng(seed)
    kind = KINDS[seed % len(KINDS)]
    scene = Scene.from_dict(_tables(rng, kind, seed))
    loop = OneTickMap.from_scene(scene)
    low, limit = next(iter(loop.stable_ranges()), (1.0, 0.0))
    if low > 0.0 or not 50.0 < limit < 2e5 or scene.wall is None:
        return None
    share = rng.choice([0.9, 0.95, 1.05, 1.1]) if kind == "close" else _between(rng, 0.2, 3.0)
    stiffness = float(limit * share)
    scene = replace(scene, wall=replace(scene.wall, stiffness=stiffness))
    return Drawn(kind, scene, math.log(loop.growth(stiffness)) * scene.clock.control_rate)


def _between(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _tables(rng: np.random.Generator, kind: str, seed: int) -> dict[str, Any]:
    mass, hold = _between(rng, 0.02, 0.5), _between(rng, 0.3, 3.0)
    hand_mass = {"mass": _between(rng, 0.05, 0.3), "damping": _between(rng, 1, 8), "stiffness": _between(rng, 30, 600)}
    grip = {"grip": {"stiffness": _between(rng, 300, 2000), "damping": _between(rng, 0.5, 5)}}
    paper = {"mass": 0.01, "damping": 0.01, "stiffness": 10.0}
    hand: dict[str, Any] = ({}, paper, hand_mass, hand_mass | grip)[rng.integers(4)]
    force: dict[str, Any] = {"kind": "minimum-jerk", "value": -hold, "rise_time": rng.uniform(0.05, 0.3)}
    tables: dict[str, Any] = {
        "title": f"{kind} {seed}",
        "duration": float(rng.choice([0.1, 0.2, 0.4] if kind == "short" else [1.0, 2.0, 3.0])),
        "seed": seed,
        "diverged_beyond": 0.5,
        "clock": {"round_trip_delay": int(rng.choice([0, 0, 5, 10, 15, 20, 50])) / 10_000},
        "device": {"mass": mass, "damping": _between(rng, 0.005, 2.0), "position": rng.uniform(0, 0.002)},
        "wall": {"position": 0.0, "stiffness": 1000.0},
    }
    if rng.random() < 0.5:
        tables["encoder"] = {"resolution": _between(rng, 1e-7, 1e-6)}
    if kind == "trembling":
        swing = hold * rng.uniform(0.05, 0.5)
        force = {"kind": "sine", "amplitude": swing, "frequency": rng.uniform(3, 8), "offset": -hold}
    if kind == "noisy":
        tables["noise"] = {"deviation": _between(rng, 1e-7, 3e-6), "cutoff": rng.uniform(50, 400)}
    if kind in ("short", "bouncing"):
        force = {"kind": "constant", "value": -hold}
    if kind == "bouncing":
        tables["device"]["position"] = rng.uniform(0.002, 0.02)
    element = rng.integers(3)
    if element == 1:
        tables["dissipation"] = [{"kind": "damping", "damping": _between(rng, 0.05, 3.0)}]
    if element == 2:
        tables["dissipation"] = [{"kind": "bidirectional-inertia", "mass": rng.uniform(0.05, 0.5) * mass}]
    if element:
        tables["velocity"] = {"cutoff": rng.uniform(40, 300)}
    return tables | {"hand": hand | {"force": force}}
