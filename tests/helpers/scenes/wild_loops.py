"""Loops drawn by seed to be judged: shipped devices and hands and others, of every kind that is hard to judge."""

from __future__ import annotations

import math
import tomllib
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from haploop.protocol.scene.scene import Scene
from haploop.tools.linear.one_tick import OneTickMap

KINDS = (
    "plain", "trembling", "noisy", "coarse", "short", "bouncing", "close", "late", "switching", "slow",
)  # fmt: skip
LAUNCH = Path(__file__).parents[3] / "launch"
DEVICES = ("falcon", "omega3", "premium15", "premium15_cable", "touch", "own", "own", "own")
HANDS = ("choi2022", "fu_cavusoglu_x", "fu_cavusoglu_y", "fu_cavusoglu_z", "none")
_DELAYS = (0, 0, 5, 10, 15, 20, 50)  # in tenths of a millisecond


def drawn(seed: int) -> Scene | None:
    """The scene of a seed, of the kind ``KINDS[seed % 10]``; None where its limit is not within 50 N/m to 200 N/mm."""
    rng = np.random.default_rng(seed)
    kind = KINDS[seed % len(KINDS)]
    if kind == "slow":
        return Scene.from_dict(_slow(rng, seed))
    scene = Scene.from_dict(_tables(rng, kind, seed))
    assert scene.wall
    # The limit of the loop without everything that makes it nonlinear.
    elements = tuple(one for one in scene.dissipation if one.kind in ("damping", "bidirectional-inertia"))
    linear = replace(scene, friction=None, actuator=None, encoder=None, dissipation=elements)
    low, limit = next(iter(OneTickMap.from_scene(linear).stable_ranges()), (1.0, 0.0))
    if low > 0.0 or not 50.0 < limit < 2e5:
        return None
    share = rng.uniform(0.9, 1.1) if kind == "close" else between(rng, 0.2, 2.5)
    return replace(scene, wall=replace(scene.wall, stiffness=float(limit * share)))


def between(rng: np.random.Generator, low: float, high: float) -> float:
    """A number drawn evenly in its logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


@cache
def _shipped(folder: str, name: str) -> dict[str, Any]:
    tables = tomllib.loads((LAUNCH / folder / f"{name}.toml").read_text(encoding="utf-8"))
    below = tables.pop("extends", None)
    tables.pop("accelerometer", None)
    return (_shipped(folder, Path(below).stem) if below else {}) | tables


def _device(rng: np.random.Generator) -> dict[str, Any]:
    name = str(rng.choice(DEVICES))
    if name != "own":
        return _shipped("devices", name)
    tables: dict[str, Any] = {"device": {"mass": between(rng, 0.02, 0.5), "damping": between(rng, 0.005, 2.0)}}
    if rng.random() < 0.5:
        tables["encoder"] = {"resolution": between(rng, 1e-7, 3e-5)}
    if rng.random() < 0.3:
        tables["friction"] = {"kinetic": between(rng, 0.005, 0.3)}
    return tables


def _hand(rng: np.random.Generator, force: dict[str, Any]) -> dict[str, Any]:
    name = str(rng.choice(HANDS))
    return (_shipped("hands", name)["hand"] if name != "none" else {}) | {"force": force}


def _tables(rng: np.random.Generator, kind: str, seed: int) -> dict[str, Any]:
    tables, hold = dict(_device(rng)), between(rng, 0.3, 3.0)
    friction = tables.get("friction", {"kinetic": 0.0})["kinetic"]
    hold += 2.0 * friction
    device = tables["device"] | {"position": rng.uniform(0.0, 0.002)}
    force: dict[str, Any] = {"kind": "minimum-jerk", "value": -hold, "rise_time": rng.uniform(0.05, 0.3)}
    if kind == "trembling":
        swing = hold * rng.uniform(0.05, 0.5)
        force = {"kind": "sine", "amplitude": swing, "frequency": rng.uniform(3, 8), "offset": -hold}
    if kind == "noisy":
        tables["noise"] = {"deviation": between(rng, 1e-7, 3e-5), "cutoff": rng.uniform(50, 400)}
    if kind == "coarse":
        tables["encoder"] = {"resolution": between(rng, 3e-5, 1e-3)}
    if kind in ("short", "bouncing"):
        force = {"kind": "constant", "value": -hold}
    if kind == "bouncing":
        device["position"] = rng.uniform(0.002, 0.02)
    element = 2 + rng.integers(2) if kind == "switching" else rng.integers(3)
    if element == 1:
        tables["dissipation"] = [{"kind": "damping", "damping": between(rng, 0.05, 3.0)}]
    if element >= 2:
        name = "unidirectional-inertia" if kind == "switching" else "bidirectional-inertia"
        tables["dissipation"] = [{"kind": name, "mass": rng.uniform(0.05, 0.5) * device["mass"]}]
    if element:
        tables["velocity"] = {"cutoff": rng.uniform(40, 300)}
    delay_s = rng.integers(50, 600) / 10_000 if kind == "late" else int(rng.choice(_DELAYS)) / 10_000
    return tables | {
        "title": f"{kind} {seed}",
        "duration": float(rng.choice([0.1, 0.2, 0.4] if kind == "short" else [1.0, 2.0, 3.0])),
        "seed": seed,
        "diverged_beyond": 0.5,
        "clock": {"round_trip_delay": float(delay_s)},
        "device": device,
        "hand": _hand(rng, force),
        "wall": {"position": 0.0, "stiffness": 1000.0},
    }


def _slow(rng: np.random.Generator, seed: int) -> dict[str, Any]:
    """A heavy device at a soft wall, at 0.25 to 1 Hz; the wall is 0.3 to 2 times its limit b / (T / 2 + d)."""
    frequency, mass, late = rng.uniform(0.25, 1.0), between(rng, 0.1, 2.0), rng.integers(0, 300) / 10_000
    stiffness = mass * (math.tau * frequency) ** 2
    damping = stiffness * (0.0005 + late) / (rng.uniform(0.9, 1.1) if rng.random() < 0.3 else between(rng, 0.3, 2.0))
    hold = stiffness * between(rng, 0.01, 0.1)  # N, under which the wall yields by that many metres
    tables: dict[str, Any] = {"encoder": {"resolution": between(rng, 1e-6, 1e-4)}} if rng.random() < 0.5 else {}
    return tables | {
        "title": f"slow {seed}",
        "duration": float(rng.choice([1.0, 3.0, 5.0])),
        "diverged_beyond": 0.5,
        "clock": {"round_trip_delay": float(late)},
        "device": {"mass": mass, "damping": damping, "position": -hold / stiffness},
        "hand": {"force": {"kind": "constant", "value": -hold * rng.uniform(0.8, 1.2)}},
        "wall": {"position": 0.0, "stiffness": stiffness},
    }
