"""Scenes drawn by seed, with everything a scene can hold, for which two ways of computing them can be compared."""

from __future__ import annotations

from typing import Any

import numpy as np

from haploop.protocol.scene.scene import Scene
from helpers.scenes.least import scene
from oracles.reference_run import Truth, simulate

DELAYS = (0, 3, 10, 20, 25, 50)
RATES = ((10_000, 1_000), (10_000, 2_000), (8_000, 500), (5_000, 5_000), (12_000, 1_500))


def hand_forces(rng: np.random.Generator) -> list[dict[str, Any]]:
    """One of every kind, all pressing down."""
    value = -rng.uniform(0.3, 1.5)
    times = np.cumsum(rng.uniform(0.01, 0.06, 4)).tolist()
    return [
        {"kind": "constant", "value": value},
        {"kind": "ramp", "value": value, "rise_time": rng.uniform(0.02, 0.2)},
        {"kind": "step", "value": value, "at": rng.uniform(0.0, 0.05)},
        {"kind": "sine", "amplitude": value, "frequency": rng.uniform(2, 20), "offset": value, "phase": 0.3},
        {"kind": "minimum-jerk", "value": value, "rise_time": rng.uniform(0.02, 0.2)},
        {"kind": "trace", "time": times, "force": rng.uniform(-1.5, 0.0, 4).tolist()},
    ]


def elements(rng: np.random.Generator) -> list[dict[str, Any]]:
    """One of every kind."""
    tables: list[dict[str, Any]] = [
        {"kind": "damping", "damping": rng.uniform(0.05, 0.5)},
        {"kind": "unidirectional-damping", "damping": rng.uniform(0.05, 0.5)},
        {"kind": "bidirectional-inertia", "mass": rng.uniform(5e-4, 4e-3)},
        {"kind": "unidirectional-inertia", "mass": rng.uniform(5e-4, 4e-3)},
    ]
    return [{**table, "acts": str(rng.choice(["always", "in-contact"]))} for table in tables]


def drawn(seed: int) -> tuple[Scene, Truth]:
    """The first comparable scene of this seed, and the motion that the reference computes for it.

    Roundings, contacts and gates are decisions: where one depends on the last bit, or where the motion is chaotic, two
    correct programs diverge. A scene is comparable when the reference, started 1e-16 m beside its start, deviates from
    itself by no more than 1e-12 of its largest excursion.
    """
    rng = np.random.default_rng(seed)
    for _ in range(20):
        candidate = scene(**tables_of(seed, rng))
        truth = simulate(candidate)
        if is_comparable(candidate, truth):
            return candidate, truth
    raise AssertionError(f"Seed {seed} gives no comparable scene; draw gentler ones.")


def is_comparable(candidate: Scene, truth: Truth) -> bool:
    """Tells whether a scene's outcome does not depend on a last bit."""
    beside = simulate(candidate, start_beside=1e-16)
    if len(truth.x) != len(beside.x):
        return False
    return bool(np.abs(truth.x - beside.x).max() <= 1e-12 * np.abs(truth.x).max())


def tables_of(seed: int, rng: np.random.Generator) -> dict[str, Any]:
    plant_rate, control_rate = RATES[seed % len(RATES)]
    delay = DELAYS[seed % len(DELAYS)]
    side = 1.0 if rng.random() < 0.3 else -1.0
    tables: dict[str, Any] = {
        "duration": 0.2,
        "diverged_beyond": 0.5,
        "clock": {"plant_rate": plant_rate, "control_rate": control_rate, "round_trip_delay": delay / plant_rate},
        "device": {
            "mass": rng.uniform(0.01, 0.1),
            "damping": rng.uniform(0.05, 0.6),
            "position": rng.uniform(-1e-3, 1e-3),
            "velocity": side * rng.uniform(0.0, 0.2),
        },
        "wall": {
            "position": side * rng.uniform(5e-4, 3e-3),
            "stiffness": rng.uniform(50, 400),
            "occupies": "above" if side > 0 else "below",
        },
    }
    if rng.random() < 0.85:
        force = hand_forces(rng)[rng.integers(6)]
        for key in ("value", "amplitude", "offset"):
            if key in force:
                force[key] *= -side
        hand = {"mass": 0.01, "damping": rng.uniform(0.01, 2.0), "stiffness": rng.uniform(0.0, 300.0), "rest": 1e-3}
        tables["hand"] = {**hand, "force": force}
    kinds = elements(rng)
    tables["dissipation"] = [kinds[i] for i in rng.choice(4, rng.integers(0, 4), replace=False)]
    if rng.random() < 0.6:
        tables["encoder"] = {"resolution": 1e-5, "rounding": str(rng.choice(["nearest", "floor"]))}
    if rng.random() < 0.3:
        tables["velocity"] = {"cutoff": rng.uniform(30, 300)}
    if rng.random() < 0.4:
        cutoff = {"cutoff": rng.uniform(30, 300)} if rng.random() < 0.5 else {}
        tables["acceleration"] = {"source": str(rng.choice(["encoder", "accelerometer"])), **cutoff}
    if rng.random() < 0.5:
        tables["event"] = _events(rng, kinds, len(tables["dissipation"]))
    return tables


def _events(rng: np.random.Generator, kinds: list[dict[str, Any]], count: int) -> list[dict[str, Any]]:
    new = kinds[rng.integers(4)]
    parameter = "damping" if "damping" in new else "mass"
    slot = int(rng.integers(count + 1))
    return [
        {"at": 0.05, "element": slot, "swap": new},
        {"at": 0.0817, "set": {"wall.stiffness": 120.0, f"dissipation.{slot}.{parameter}": new[parameter] / 2}},
        {"at": 0.12, "element": slot, "swap": {"kind": "none"}},
    ]


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))
