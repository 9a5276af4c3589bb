"""Behaviour of loops in the long run: each is run, held still, pushed, and left alone for 40 s and more.

Written by hand, without any of the code that it judges: all loops side by side in arrays, bodies by the matrix
exponential in absolute coordinates, dry friction as an impulse that stops a body, independent noise. Scenes are
dictionaries, as ``as_dict`` returns them.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.linalg import expm

TICK_S, STEPS, STEP_S = 1e-3, 10, 1e-4
PUSH, SMALLER, PUSH_TICKS = 0.3, 0.1, 50
SOON_S, LATE_S, LONG_S, LOOK_S = 20.0, 40.0, 160.0, 5.0
# A swing that dies, or grows, changes the logarithm of its width by more than this in 20 s; how alike the later change
# must be for it to continue, as a share.
_DIES, _GROWS, _ALIKE = 0.01, 0.005, 0.3
# Smaller widths are rounding, m.
_LEAST_M = 1e-7


def swings(scenes: list[dict[str, Any]]) -> list[float]:
    """Returns each loop's swing long after a push over the least that a hand feels; inf for a loop beyond its limit."""
    found = np.zeros(len(scenes))
    rubbed = np.array([_friction(scene) > 0.0 for scene in scenes])
    for group in (rubbed, ~rubbed):
        places = np.flatnonzero(group)
        if len(places):
            found[places] = _swings([scenes[place] for place in places])
    return found.tolist()


def _swings(scenes: list[dict[str, Any]]) -> np.ndarray:
    loops = Loops(scenes)
    loops.run()
    loops.push()
    soon, late = (loops.go_to(seconds) for seconds in (SOON_S, LATE_S))
    most, grew = felt(late), _grew(soon, late)
    # A swing that is felt and dies, or is not felt and grows, is left alone for longer: if it still does so, it is
    # taken to continue.
    changes = np.where(most >= 1.0, -grew > _DIES, grew > _GROWS)
    some = np.flatnonzero(~loops.gone & changes)
    if len(some):
        loops.take(some)
        long = loops.go_to(LONG_S)
        times, still = (LONG_S - LATE_S) / (LATE_S - SOON_S), _grew(late[:, some], long)
        most[some] = felt(long)
        goes_on = np.abs(still - times * grew[some]) < _ALIKE * np.abs(still)
        most[some[goes_on]] = np.where(still[goes_on] > 0.0, np.inf, 0.0)
    most[loops.left] = np.inf
    return most.reshape(2, -1).max(axis=0)


def _grew(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Returns the growth of the logarithm of the width between two traces."""
    widths_m = (np.maximum(np.ptp(x, axis=0), _LEAST_M) for x in (before, after))
    return np.subtract(*reversed([*np.log([*widths_m])]))


def felt(x: np.ndarray) -> np.ndarray:
    """Returns the strength of each trace, shape (ticks, members), over the least that a hand feels.

    By Israr et al. 2006 at every frequency, with energies added (Bensmaia et al. 2005).
    """
    t = np.linspace(-1.0, 1.0, len(x))[:, None]
    x = x - x.mean(axis=0) - t * ((t * x).sum(axis=0) / (t * t).sum())
    window = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(len(x)) / len(x))
    lines = np.abs(np.fft.rfft(x * window[:, None], axis=0))[1:] * 4.0 / len(x)
    f = np.fft.rfftfreq(len(x), TICK_S)[1:]
    slow = 26e-6 * (f / 10.0) ** (math.log(8.5 / 26.0) / math.log(2.0))
    fast = 8.5e-6 * (f / 20.0) ** (math.log(0.06 / 8.5) / math.log(16.0))
    return np.sqrt(((lines / np.where(f < 20.0, slow, fast)[:, None]) ** 2).sum(axis=0) / 1.5)


def _friction(scene: dict[str, Any]) -> float:
    return (scene.get("friction") or {}).get("kinetic", 0.0)


class Loops:
    """Some loops, all with dry friction or none; arrays have the members last, except the matrices.

    Attributes:
        gone: which of the members still there have left their limit.
        left: which of all members have left it.
    """

    def __init__(self, scenes: list[dict[str, Any]]) -> None:
        self.scenes, n = scenes, len(scenes)
        self.of = np.arange(n)
        self._rubs = _friction(scenes[0]) > 0.0
        self._first_mass = np.array([(scene.get("transmission") or {}).get("motor_mass", 0.0) or
                                     _tip_mass(scene) for scene in scenes])  # fmt: skip
        self._friction = np.array([_friction(scene) for scene in scenes])
        self._wall = np.array([scene["wall"]["stiffness"] for scene in scenes])
        self._limit = np.array([scene["diverged_beyond"] for scene in scenes])
        self._most = np.array([(scene.get("actuator") or {}).get("saturation") or np.inf for scene in scenes])
        self._count = np.array([(scene.get("encoder") or {}).get("resolution") or 0.0 for scene in scenes])
        cutoff = np.array([(scene.get("velocity") or {}).get("cutoff") or np.inf for scene in scenes])
        self._keep = np.exp(-2.0 * np.pi * cutoff * TICK_S)
        kinds = "damping", "bidirectional-inertia", "unidirectional-inertia"
        self._elements = np.array([[_element(scene, kind) for scene in scenes] for kind in kinds])
        late = np.array([round(scene["clock"]["round_trip_delay"] / STEP_S) for scene in scenes])
        self._late, part = np.divmod(late, STEPS)
        if self._rubs:
            step = np.array([_flow(scene, 1) for scene in scenes])
            self._pieces = [(step, (i < part)) for i in range(STEPS)]
        else:
            self._pieces = [(np.array([_flow(scene, k) for scene, k in zip(scenes, steps, strict=True)]),
                             np.full(n, old)) for steps, old in ((part, True), (STEPS - part, False))]  # fmt: skip
        start = np.zeros((n, 8))
        for member, scene in enumerate(scenes):
            start[member, :3] = scene["device"].get("position", 0.0)
            start[member, 3:6] = scene["device"].get("velocity", 0.0)
        self._z, self._start = start.copy(), start
        self._commands = np.zeros((int(self._late.max()) + 2, n))
        self._tick = 0
        self._x, self._v, self._a = start[:, 0].copy(), np.zeros(n), np.zeros(n)
        self.gone, self.left = np.zeros(n, bool), np.zeros(n, bool)

    def run(self) -> None:
        """Runs each to the end of its scene, with moving hands and noise, so that all end at the same time."""
        n = len(self.scenes)
        ticks = np.array([round(scene["duration"] / TICK_S) for scene in self.scenes])
        rng = np.random.default_rng(1)
        noises = [scene.get("noise") or {"deviation": 0.0, "cutoff": 1.0} for scene in self.scenes]
        deviation, cutoff = (np.array([noise[name] for noise in noises]) for name in ("deviation", "cutoff"))
        keeps = np.exp(-2.0 * np.pi * cutoff * TICK_S)
        noise = deviation * rng.standard_normal(n)
        window = np.minimum(ticks // 2, 500)
        total, count = np.zeros(n), np.zeros(n)
        for tick in range(int(ticks.max())):
            since = tick - int(ticks.max()) + ticks
            hand = np.array([_hand_N(scene, max(0, k) * TICK_S) for scene, k in zip(self.scenes, since, strict=True)])
            inside = self._go(hand, noise, since < 0)
            counted = inside & (since >= ticks - window)
            total, count = total + np.where(counted, hand, 0.0), count + counted
            noise = keeps * noise + deviation * np.sqrt(1.0 - keeps**2) * rng.standard_normal(n)
        self._hold = total / np.maximum(count, 1)

    def push(self) -> None:
        """Makes two of each, pushes the first a tenth as hard as the second, and lets them go."""
        twice = np.tile(np.arange(len(self.scenes)), 2)
        self.take(twice)
        self.of, self.left = np.arange(len(twice)), np.zeros(len(twice), bool)
        share = np.repeat([PUSH * SMALLER, PUSH], len(self.scenes))
        for _ in range(PUSH_TICKS):
            self._go(self._hold * (1.0 + share))
        self._pushed = self._tick

    def go_to(self, seconds: float) -> np.ndarray:
        """Continues until ``seconds`` after the push; returns the position of the last 5 s, shape (ticks, members)."""
        end, size = self._pushed + round(seconds / TICK_S), round(LOOK_S / TICK_S)
        trace = np.zeros((size, len(self._z)))
        while self._tick < end:
            if self._tick >= end - size:
                trace[self._tick - end + size] = self._z[:, 0]
            self._go(self._hold)
        return trace

    def take(self, places: np.ndarray) -> None:
        """Continues with only the members at these places; one may be named twice."""
        for name in ("_first_mass", "_friction", "_wall", "_limit", "_most", "_count", "_keep", "_late", "_z", "_start",
                     "_x", "_v", "_a", "gone", "of", "_hold"):  # fmt: skip
            setattr(self, name, getattr(self, name)[places])
        self._elements, self._commands = self._elements[:, places], self._commands[:, places]
        self._pieces = [(flow[places], old[places]) for flow, old in self._pieces]

    def _go(self, hand: np.ndarray, noise: Any = 0.0, waits: Any = False) -> np.ndarray:
        """Continues by a tick under a force of the hand in N; returns which members were in contact."""
        x = self._z[:, 0] + noise
        counted = self._count > 0.0
        x = np.where(counted, np.rint(x / np.where(counted, self._count, 1.0)) * self._count, x)
        v = self._keep * self._v + (1.0 - self._keep) * (x - self._x) / TICK_S
        a = (v - self._v) / TICK_S
        damping, both, one = self._elements
        inside = (x < 0.0) & ~np.asarray(waits)
        force = -self._wall * x - damping * v - both * a - np.where(v * self._a >= 0.0, one * a, 0.0)
        size = len(self._commands)
        self._commands[self._tick % size] = np.where(inside, force, 0.0)
        members = np.arange(len(x))
        new, old = (self._commands[(self._tick - self._late - i) % size, members] for i in (0, 1))
        z = self._z
        z[:, 7] = hand
        for flow, is_old in self._pieces:
            z[:, 6] = np.clip(np.where(is_old, old, new), -self._most, self._most)
            stood, at = z[:, 3] == 0.0, z[:, 0]
            z = np.matmul(flow, z[:, :, None])[:, :, 0]
            if self._rubs:
                before = z[:, 3].copy()
                most = self._friction * STEP_S / self._first_mass
                z[:, 3] = np.sign(before) * np.maximum(np.abs(before) - most, 0.0)
                z[:, 0] += (z[:, 3] - before) * STEP_S / 2.0
                z[:, 0] = np.where(stood & (z[:, 3] == 0.0), at, z[:, 0])  # or it would creep
        self._x, self._v, self._a = x, v, a
        if np.any(waits):
            z[waits] = self._start[waits]
            self._v[waits] = self._a[waits] = 0.0
            self._x[waits] = z[waits, 0]
        out = np.abs(z[:, 0]) > self._limit
        if out.any():
            self.gone |= out
            self.left[self.of[self.gone]] = True
        z[self.gone] = 0.0
        self._z, self._tick = z, self._tick + 1
        return inside


def _tip_mass(scene: dict[str, Any]) -> float:
    hand = scene.get("hand") or {}
    return scene["device"]["mass"] + (0.0 if hand.get("grip") else hand.get("mass", 0.0))


def _element(scene: dict[str, Any], kind: str) -> float:
    return sum(
        table.get("damping", table.get("mass", 0.0)) for table in scene.get("dissipation", ()) if table["kind"] == kind
    )


def _hand_N(scene: dict[str, Any], t: float) -> float:
    force = scene["hand"]["force"]
    if force["kind"] == "sine":
        return force["offset"] + force["amplitude"] * math.sin(2.0 * math.pi * force["frequency"] * t)
    s = min(1.0, t / force["rise_time"]) if "rise_time" in force else 1.0
    return force["value"] * (10.0 - 15.0 * s + 6.0 * s * s) * s**3


def _flow(scene: dict[str, Any], steps: int) -> np.ndarray:
    """The map of ``steps`` steps of (3 positions, 3 velocities, force on the first body, on the last), shape (8, 8)."""
    device, hand, cable = scene["device"], scene.get("hand") or {}, scene.get("transmission")
    grip = hand.get("grip")
    # (mass, damping to the ground) of each body, and the links between them.
    bodies, links = [[device["mass"], device.get("damping", 0.0)]], []
    if cable:
        bodies.insert(0, [cable["motor_mass"], cable.get("motor_damping", 0.0)])
        links.append((cable["stiffness"], cable.get("damping", 0.0)))
    own = [hand.get("mass", 0.0), hand.get("damping", 0.0)]
    if grip:
        bodies.append(own)
        links.append((grip["stiffness"], grip.get("damping", 0.0)))
    else:
        bodies[-1] = [one + other for one, other in zip(bodies[-1], own, strict=True)]
    last = len(bodies) - 1
    rates = np.zeros((8, 8))
    for i, (mass, damping) in enumerate(bodies):
        rates[i, 3 + i] = 1.0
        rates[3 + i, 3 + i] -= damping / mass
        for link, to in ((i - 1, i - 1), (i, i + 1)):
            if 0 <= link < len(links):
                k, b = links[link]
                rates[3 + i, [i, to]] += np.array([-k, k]) / mass
                rates[3 + i, [3 + i, 3 + to]] += np.array([-b, b]) / mass
    rates[3 + last, last] -= hand.get("stiffness", 0.0) / bodies[last][0]
    rates[3, 6] = 1.0 / bodies[0][0]
    rates[3 + last, 7] = 1.0 / bodies[last][0]
    return expm(rates * steps * STEP_S)
