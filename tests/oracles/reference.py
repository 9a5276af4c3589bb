"""The loop a second time, written another way: it must give the same results as haploop.

Step: scipy's matrix exponential of the state with its inputs appended. Heat and work of the hand: Gauss-Legendre
quadrature along the exact motion. Controller: one function with the formulas of the definitions, in floats and in the
order they are written, since the last bits of a quantised position decide the sign of v[k] a[k-1] where the counts of
two ticks change by the same amount. Books: exact sums (``math.fsum``) over the whole run.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.linalg import expm

from haploop.protocol.scene.hand_force import Constant, HandForce, MinimumJerk, Ramp, Sine, Step, Trace
from haploop.protocol.scene.paths import with_value
from haploop.protocol.scene.scene import ElementTable, EventTable, Hand, Scene


def hand_force_N(table: HandForce | None, t: float) -> float:
    """tau(t) of a ``[hand.force]`` table."""
    match table:
        case Constant():
            return table.value
        case Ramp():
            return table.value * (t / table.rise_time if t < table.rise_time else 1.0)
        case Step():
            return table.value if t >= table.at else 0.0
        case Sine():
            return table.offset + table.amplitude * math.sin(math.tau * table.frequency * t + table.phase)
        case MinimumJerk():
            s = min(1.0, t / table.rise_time)
            return table.value * (10 * s**3 - 15 * s**4 + 6 * s**5)
        case Trace():
            points = list(zip(table.time, table.force, strict=True))
            if t <= points[0][0]:
                return points[0][1]
            for (t0, f0), (t1, f1) in pairwise(points):
                if t <= t1:
                    return f0 + (f1 - f0) * (t - t0) / (t1 - t0)
            return points[-1][1]
        case _:
            return 0.0


class Mechanics:
    """(x, v, F, dF/dt) over a step, with F all forces except damper and spring; x from the hand's rest position."""

    def __init__(self, scene: Scene) -> None:
        device, hand = scene.device, scene.hand or Hand()
        self.m, self.k, self.rest = device.mass + hand.mass, hand.stiffness, hand.rest
        self.b_device, self.b_hand = device.damping, hand.damping
        self.b = self.b_device + self.b_hand
        self.h = 1.0 / scene.clock.plant_rate
        rates = np.zeros((4, 4))
        rates[0, 1] = 1.0
        rates[1, :3] = -self.k / self.m, -self.b / self.m, 1.0 / self.m
        rates[2, 3] = 1.0
        self.step = expm(rates * self.h)
        nodes, weights = np.polynomial.legendre.leggauss(16)
        self.nodes, self.weights = (nodes + 1.0) / 2.0, weights / 2.0 * self.h
        self.v_at_nodes = np.array([expm(rates * self.h * c)[1] for c in self.nodes])

    def stored_J(self, x: float, v: float) -> float:
        return self.m * v * v / 2.0 + self.k * (x - self.rest) ** 2 / 2.0


@dataclass
class Element:
    """One element of the scene's list, with its force at every tick."""

    table: ElementTable
    from_tick: int
    forces: dict[int, float] = field(default_factory=dict)
    to_tick: int = 0


class Controller:
    """Estimates, wall and elements, tick by tick."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.rate = scene.clock.control_rate
        self.wall = scene.wall
        self.slots = [Element(table, 0) for table in scene.dissipation]
        self.all_elements = list(self.slots)
        # Ticks are counted from the decimal number in the scene.
        events = [(math.ceil(Fraction(repr(e.at)) * self.rate), e) for e in scene.event]
        self.events = sorted(events, key=lambda event: event[0])
        self.filters = {name: scene.estimate(name).cutoff for name in ("velocity", "acceleration")}
        self.accelerometer = scene.acceleration is not None and scene.acceleration.source == "accelerometer"
        self.rows: list[tuple[Any, Any, Any, float, float, bool]] = []

    def measure(self, x: float) -> Any:
        encoder = self.scene.encoder
        if not encoder:
            return x
        q = encoder.resolution
        count = round(x / q) if encoder.rounding == "nearest" else math.floor(x / q)
        return q * count

    def command(self, tick: int, x_true: float, acceleration: float) -> float:
        for _, event in [e for e in self.events if e[0] == tick]:
            self._change(tick, event)
        T = 1.0 / self.rate
        x = self.measure(x_true)
        before = self.rows[-1] if self.rows else None
        v = self._low_passed("velocity", (x - before[0]) / T if before else x - x, before and before[1])
        slope = (v - before[1]) / T if before else v - v
        a = self._low_passed("acceleration", acceleration if self.accelerometer else slope, before and before[2])
        a_before = before[2] if before else 0
        contact, f_wall, inwards = False, 0.0, 0
        if self.wall:
            surface = self.wall.position
            inwards = -1 if self.wall.occupies == "below" else 1
            contact = inwards * (x - surface) > 0
            f_wall = float(self.wall.stiffness * (surface - x)) if contact else 0.0
        total = f_wall
        for slot in self.slots:
            acting = contact or slot.table.acts == "always"
            force = float(_element_force(slot.table, v, a, a_before, inwards)) if acting else 0.0
            slot.forces[tick], slot.to_tick = force, tick + 1
            total += force
        self.rows.append((x, v, a, f_wall, total, contact))
        return total

    def _low_passed(self, name: str, u: Any, y: Any) -> Any:
        cutoff = self.filters[name]
        if cutoff is None or y is None:
            return u
        keep = math.exp(-math.tau * cutoff / self.rate)
        return keep * y + (1.0 - keep) * u

    def _change(self, tick: int, event: EventTable) -> None:
        if event.swap:
            new, place = [] if event.swap.name == "none" else [Element(event.swap, tick)], event.element or 0
            self.slots[place : place + 1] = new
            self.all_elements += new
        for key, value in (event.set or {}).items():
            table, *rest = key.split(".")
            if table == "wall":
                assert self.wall is not None
                self.wall = replace(self.wall, **{rest[0]: value})
            else:
                slot = self.slots[int(rest[0])]
                self.slots[int(rest[0])] = changed = Element(with_value(slot.table, rest[1], value), tick)
                self.all_elements.append(changed)


def _element_force(table: ElementTable, v: Any, a: Any, a_before: Any, inwards: int) -> Any:
    match table.name:
        case "damping":
            return -table.parameters["damping"] * v
        case "unidirectional-damping":
            return -table.parameters["damping"] * v if v * inwards > 0 else 0.0
        case "bidirectional-inertia":
            return -table.parameters["mass"] * a
        case "unidirectional-inertia":
            return -table.parameters["mass"] * a if v * a_before >= 0 else 0.0
    raise ValueError(table)
