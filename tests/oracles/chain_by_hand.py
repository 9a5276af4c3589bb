"""Plant telemetry of a chain of bodies made by hand: absolute coordinates, scipy's expm, arbitrarily switched friction.

The masses, springs and dampers are those of the reference (``effects_reference.Bodies``); every energy is integrated by
Gauss-Legendre quadrature along the motion. Only the scene is shared with haploop.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.linalg import expm

from haploop.protocol.scene.scene import Scene
from helpers.scenes.least import scene
from oracles.effects_reference import Bodies

RATE, STEPS = 2_000, 100
NODES, WEIGHTS = np.polynomial.legendre.leggauss(10)
MOST_N = 1.5
TAU = {"kind": "sine", "amplitude": 1.5, "frequency": 43.0}
# Factor that makes lengths comparable to velocities, 1/s.
_LENGTHS = 500.0


def chain_scene(rng: np.random.Generator, effects: str) -> Scene:
    """A scene with some of cable, grip, friction, bandwidth, saturation; its fastest mode is slow beside the steps."""
    tables: dict[str, Any] = {
        "duration": STEPS / RATE,
        "clock": {"plant_rate": RATE, "control_rate": RATE // 5},
        "device": {"mass": rng.uniform(0.05, 0.3), "damping": rng.uniform(0.1, 1.0), "velocity": rng.uniform(0.2, 1)},
        "hand": {
            "mass": rng.uniform(0.05, 0.3),
            "damping": rng.uniform(0.1, 1.0),
            "stiffness": rng.uniform(10, 100),
            "rest": rng.uniform(-0.02, 0.02),
            "force": TAU,
        },
    }
    if "cable" in effects:
        spring = {"stiffness": rng.uniform(1e3, 1e4), "damping": rng.uniform(0.1, 1.0)}
        tables["transmission"] = spring | {"motor_mass": rng.uniform(0.02, 0.1), "motor_damping": rng.uniform(0.1, 1.0)}
    if "grip" in effects:
        tables["hand"]["grip"] = {"stiffness": rng.uniform(100, 1e3), "damping": rng.uniform(0.1, 3.0)}
    limits = {"bandwidth": rng.uniform(30, 300), "saturation": MOST_N}
    if actuator := {name: value for name, value in limits.items() if name in effects}:
        tables["actuator"] = actuator
    if "friction" in effects:
        tables["friction"] = {"kinetic": 0.1}
    return scene(**tables)


@dataclass
class Made:
    """A chain, and its energies, which are known from its making.

    Attributes:
        columns: telemetry of all steps and the end, ``pieces.*`` of the steps that were cut.
        commanded: the two forces that make up the command, shape (STEPS,) each, N.
        energies: work of tau, heats, friction_heat and actuator in every step, J, shape (STEPS,).
    """

    columns: dict[str, np.ndarray]
    commanded: list[np.ndarray]
    energies: dict[str, np.ndarray]


@dataclass
class _Maker:
    scene: Scene
    rng: np.random.Generator
    rows: list[dict[str, float]] = field(default_factory=list)
    pieces: list[dict[str, float]] = field(default_factory=list)
    flows: dict[tuple[bool, float], np.ndarray] = field(default_factory=dict)
    is_stuck: bool = False

    def __post_init__(self) -> None:
        assert self.scene.hand
        self.bodies, self.hand = Bodies(self.scene), self.scene.hand
        self.count = self.bodies.count
        self.rubs, self.lags = self.scene.friction is not None, bool(self.bodies.actuator_rate)
        self.links = ["cable"] * bool(self.scene.transmission) + ["grip"] * bool(self.hand.grip)
        self.z = self.bodies.z[: 2 * self.count + 1].copy()
        self.rest, self.bodies.rest = self.bodies.rest, 0.0
        self.inputs = 4  # command, friction, load, its slope

    def rates(self) -> np.ndarray:
        """Rates of (positions, velocities, actuator, command, friction, load, slope) in the present mode."""
        bodies, size = self.bodies, len(self.z)
        bodies.friction = None
        units = np.eye(len(bodies.z))[:size]
        of_states = [bodies.rates(0.0, unit, 0.0, 0.0, 0.0)[:size] for unit in units]
        still = np.zeros(len(bodies.z))
        of_inputs = [bodies.rates(0.0, still, *acting, 0.0)[:size] for acting in ((1.0, 0.0), (0.0, 1.0))]
        of_friction = np.eye(size)[self.count] / bodies.m[0]
        columns = [*of_states, of_inputs[0], of_friction, of_inputs[1], np.zeros(size)]
        rates = np.vstack([np.column_stack(columns), np.zeros((self.inputs, size + self.inputs))])
        if self.is_stuck:
            rates[[0, self.count]] = 0.0
        rates[-2, -1] = 1.0
        return rates

    def after(self, duration: float, acting: np.ndarray) -> np.ndarray:
        """States and inputs after some time."""
        if (self.is_stuck, duration) not in self.flows:
            scales = np.ones(len(self.z) + self.inputs)
            scales[: self.count] = _LENGTHS
            flow = expm(scales[:, None] * self.rates() / scales * duration)
            self.flows[self.is_stuck, duration] = flow * scales / scales[:, None]
        return self.flows[self.is_stuck, duration] @ acting

    def recorded(self) -> dict[str, float]:
        """The present state under the names of telemetry."""
        n, z = self.count, self.z
        state = {"x": z[0], "v": z[n], "x_low": 0.0}
        for i, link in enumerate(self.links):
            state |= {f"{link}.stretch": z[i + 1] - z[i], f"{link}.rate": z[n + i + 1] - z[n + i]}
            state[f"{link}.stretch_low"] = 0.0
        return state | ({"actuator": z[2 * n]} if self.lags else {})

    def move(self, duration: float, acting: np.ndarray, commanded: float) -> dict[str, float]:
        """Moves on; returns the energies that were moved meanwhile."""
        energies: dict[str, float] = {}
        for node, weight in zip((NODES + 1) / 2 * duration, WEIGHTS / 2 * duration, strict=True):
            for name, power in self.powers(self.after(float(node), acting), commanded).items():
                energies[name] = energies.get(name, 0.0) + weight * power
        self.z = self.after(duration, acting)[: len(self.z)]
        return energies

    def powers(self, at: np.ndarray, commanded: float) -> dict[str, float]:
        n, bodies = self.count, self.bodies
        v, (command, friction, load, _) = at[n : 2 * n], at[len(self.z) :]
        force = at[2 * n] if self.lags else command
        names = ["motor", "device"] if "cable" in self.links else ["device"]
        by_body = dict(zip(names, bodies.ground[: len(names)] * v[: len(names)] ** 2, strict=True))
        hand = self.hand.damping * v[-1] ** 2
        if "grip" in self.links:
            by_body["hand"] = bodies.ground[-1] * v[-1] ** 2
        else:
            by_body["device"] -= hand
            by_body["hand"] = hand
        powers = {f"{name}_heat": power for name, power in by_body.items()}
        stretching = bodies.link_b * np.diff(v) ** 2
        powers |= {f"{link}_heat": power for link, power in zip(self.links, stretching, strict=True)}
        powers["hand_work"] = (load - self.bodies.hand_k * self.rest) * v[-1]
        if self.scene.actuator:
            powers["actuator"] = (commanded - force) * v[0]
        if self.rubs:
            powers["friction_heat"] = -friction * v[0]
        return powers

    def cut(self) -> list[int]:
        """Levels of the pieces of a step: [0] for a whole one."""
        levels = [0]
        if self.rubs and self.rng.random() < 0.3:
            while len(levels) < self.rng.integers(2, 9):
                at = int(self.rng.integers(len(levels)))
                levels[at : at + 1] = [levels[at] + 1] * 2
        return levels

    def stop(self) -> float:
        """Brings body 0 to rest; returns the energy that this takes, J."""
        taken = self.bodies.m[0] * self.z[self.count] ** 2 / 2
        self.z[self.count] = 0.0
        self.is_stuck = bool(self.rng.random() < 0.7)
        return taken


def make(scene: Scene, rng: np.random.Generator) -> Made:
    """Moves the chain of a scene under random forces and random friction."""
    maker = _Maker(scene, rng)
    tau = TAU["amplitude"] * np.sin(2 * np.pi * TAU["frequency"] * (np.arange(STEPS + 1) / RATE))
    loads = tau + maker.bodies.hand_k * maker.rest
    commanded = [np.repeat(rng.normal(0, 2.0, STEPS // 5), 5) for _ in range(2)]
    asked = commanded[0] + commanded[1]
    force = np.clip(asked, -MOST_N, MOST_N) if scene.actuator and scene.actuator.saturation else asked
    energies: list[dict[str, float]] = []
    for step in range(STEPS):
        levels, moved = maker.cut(), {}
        elapsed, start = 0.0, maker.recorded()
        for place, level in enumerate(levels):
            friction = float(rng.normal(0, 1.0)) if maker.rubs and not maker.is_stuck else 0.0
            held = {"friction": friction, "stuck": float(maker.is_stuck)}
            slope = (loads[step + 1] - loads[step]) * RATE
            acting = np.concatenate([maker.z, [force[step], friction, loads[step] + slope * elapsed, slope]])
            piece = {"step": float(step), "level": float(level), "load": acting[-2], **held, **maker.recorded()}
            duration = 0.5**level / RATE
            for name, energy in maker.move(duration, acting, float(asked[step])).items():
                moved[name] = moved.get(name, 0.0) + energy
            elapsed += duration
            snap = maker.stop() if len(levels) > 1 and rng.random() < 0.3 else 0.0
            if maker.rubs:
                moved["friction_heat"] += snap
            if maker.is_stuck and rng.random() < 0.2:
                maker.is_stuck = False
            if len(levels) > 1:
                maker.pieces.append({**piece, "snap_J": snap})
            if not place:
                start |= held if maker.rubs else {}
        maker.rows.append({**start, "force": float(force[step])})
        energies.append(moved)
    maker.rows.append({**maker.rows[-1], **maker.recorded()})
    columns = _stacked(maker.rows, "") | _stacked(maker.pieces, "pieces.")
    return Made(columns, commanded, _stacked(energies, ""))


def _stacked(rows: list[dict[str, float]], prefix: str) -> dict[str, np.ndarray]:
    return {f"{prefix}{name}": np.array([row[name] for row in rows]) for name in (rows[0] if rows else ())}
