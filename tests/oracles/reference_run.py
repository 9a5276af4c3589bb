"""Runs of the reference of the loop, and its books."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from haploop.protocol.scene.scene import Scene
from oracles.reference import Controller, Mechanics, hand_force_N


@dataclass
class Truth:
    """A run of the reference: states at every step and the end, held commands, the controller, the books in J."""

    x: np.ndarray
    v: np.ndarray
    force: np.ndarray
    command: np.ndarray
    controller: Controller
    books: dict[str, Any]


def simulate(scene: Scene, start_beside: float = 0.0) -> Truth:
    """Runs a resolved scene, started ``start_beside`` (in m and in m/s) beside its own start."""
    mechanics, controller = Mechanics(scene), Controller(scene)
    clock = scene.clock
    n = clock.plant_rate // clock.control_rate
    delay = round(clock.round_trip_delay * clock.plant_rate)
    steps = round(scene.duration * clock.control_rate) * n
    force_table = scene.hand.force if scene.hand else None
    tau = [hand_force_N(force_table, s / clock.plant_rate) for s in range(steps + 1)]
    x, v = scene.device.position + start_beside, scene.device.velocity + start_beside
    commands: list[float] = []
    states, held = [(x, v)], []
    force = 0.0
    for s in range(steps):
        if s % n == 0:
            if abs(x) > scene.diverged_beyond:
                break
            acceleration = (force + tau[s] - mechanics.b * v - mechanics.k * (x - mechanics.rest)) / mechanics.m
            commands.append(controller.command(s // n, x, acceleration))
        command = max((s - delay) // n, -1)
        force = commands[command] if command >= 0 else 0.0
        z = np.array([x - mechanics.rest, v, force + tau[s], (tau[s + 1] - tau[s]) / mechanics.h])
        dx, v = mechanics.step[:2] @ z
        x, v = float(dx) + mechanics.rest, float(v)
        states.append((x, v))
        held.append((force, float(command)))
    xs, vs = np.array(states).T
    forces, indices = np.array(held).T
    tau_held = np.array(tau[: len(xs)])
    books = _books(mechanics, controller, xs, vs, forces, indices.astype(int), tau_held, n)
    return Truth(xs, vs, forces, indices, controller, books)


def _books(
    mechanics: Mechanics,
    controller: Controller,
    x: np.ndarray,
    v: np.ndarray,
    force: np.ndarray,
    command: np.ndarray,
    tau: np.ndarray,
    n: int,
) -> dict[str, Any]:
    dx = np.diff(x)
    z = np.stack([x[:-1] - mechanics.rest, v[:-1], force + tau[:-1], np.diff(tau) / mechanics.h])
    v_at = mechanics.v_at_nodes @ z
    tau_at = tau[:-1] + np.outer(mechanics.nodes, np.diff(tau))
    square = mechanics.weights @ (v_at * v_at)
    work = mechanics.weights @ (tau_at * v_at)
    kinetic, spring = mechanics.m / 2 * np.diff(v**2), mechanics.k / 2 * np.diff((x - mechanics.rest) ** 2)
    x_m = [row[0] for row in controller.rows]

    def applied(of_ticks: dict[int, float]) -> np.ndarray:
        return np.array([of_ticks.get(k, 0.0) for k in command])

    def account(of_ticks: dict[int, float]) -> dict[str, float]:
        sampled = (-f * float(x_m[k + 1] - x_m[k]) for k, f in of_ticks.items() if k + 1 < len(x_m))
        return {"sampled_J": math.fsum(sampled), "true_J": math.fsum(-applied(of_ticks) * dx)}

    wall_forces = {k: row[3] for k, row in enumerate(controller.rows)}
    parts = [work, mechanics.b_device * square, mechanics.b_hand * square, kinetic, spring, applied(wall_forces) * dx]
    parts += [applied(element.forces) * dx for element in controller.all_elements]
    start = mechanics.stored_J(float(x[0]), float(v[0]))
    return {
        "hand_work_J": math.fsum(work),
        "device_heat_J": mechanics.b_device * math.fsum(square),
        "hand_heat_J": mechanics.b_hand * math.fsum(square),
        "stored_J": mechanics.stored_J(float(x[-1]), float(v[-1])),
        "moved_J": start + math.fsum(np.abs(np.reshape(parts, (len(parts), -1, n)).sum(axis=2)).sum(axis=0)) / 2.0,
        "wall": account(wall_forces) | _leak(controller, x, dx, n, wall_forces, applied(wall_forces)),
        "elements": [
            {"kind": e.table.name, "from_tick": e.from_tick, "to_tick": e.to_tick} | account(e.forces)
            for e in controller.all_elements
        ],
    }


def _leak(
    controller: Controller, x: np.ndarray, dx: np.ndarray, n: int, forces: dict[int, float], applied: np.ndarray
) -> dict[str, float]:
    """The leak of a wall that does not change, by cause; empty without a wall or where an event sets anything."""
    wall = controller.scene.wall
    if wall is None or any(event.set for _, event in controller.events):
        return {}
    inwards = -1 if wall.occupies == "below" else 1
    depth = [max(0.0, inwards * (x_s - wall.position)) for x_s in x.tolist()]
    ideal = wall.stiffness / 2 * (depth[-1] ** 2 - depth[0] ** 2)
    held = math.fsum(inwards * wall.stiffness * depth[s // n * n] * dx[s] for s in range(len(dx)))
    prompt = math.fsum(-forces[s // n] * dx[s] for s in range(len(dx)))
    late = math.fsum(-applied * dx)
    return {
        "ideal_J": ideal,
        "total_J": late - ideal,
        "sampling_and_hold_J": held - ideal,
        "quantisation_J": prompt - held,
        "delay_J": late - prompt,
    }
