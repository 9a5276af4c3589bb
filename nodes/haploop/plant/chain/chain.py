"""Bodies in a row, from the motor to the hand, as one linear system."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from haploop.plant.motion.transition import real_for
from haploop.protocol.scene.scene import Scene, accelerometer_is_used

Matrix = np.ndarray
_wide = np.longdouble


@dataclass(frozen=True)
class Link:
    """A spring (N/m) and a damper (N s/m) side by side, between two neighbouring bodies: "cable" or "grip"."""

    name: str
    stiffness: float
    damping: float


@dataclass(frozen=True)
class Chain:
    """Bodies 0 ... N-1 in a row: (motor, cable,) tip with the device's mass (, grip, hand); the hand's spring ends it.

    Coordinates: x of body 0, the stretch s_i = x_i - x_{i-1} of every link, their rates v and u_i, then, where the
    scene asks for them, the actuator's force p and the accelerometer's output y. Stretches are states, so that a
    stiff cable's force is not a difference of two large positions. Each body: m a = forces of its links + damping to
    ground; body 0 also takes the actuator's force and friction, body N-1 the hand's force tau and k_h (rest - x).
        p' = 2 pi bandwidth (command - p)        y' = 2 pi bandwidth (a of the sensor's body - y)

    Attributes:
        bodies: names of the bodies.
        masses_kg: of each body.
        grounded: damper from each body to ground, by the name of its heat -> (body, N s/m).
        links: between body i and i + 1.
        spring: (stiffness N/m, rest m) from the last body to ground.
        actuator_rate: 2 pi bandwidth, 1/s, or None where the command acts at once.
        sensor: (body, 2 pi bandwidth) of a band-limited accelerometer, or None.
        start: position in m and velocity in m/s of all bodies at t = 0, the links slack.
    """

    bodies: tuple[str, ...]
    masses_kg: tuple[float, ...]
    grounded: dict[str, tuple[int, float]]
    links: tuple[Link, ...]
    spring: tuple[float, float]
    actuator_rate: float | None
    sensor: tuple[int, float] | None
    start: tuple[float, float]

    @classmethod
    def from_scene(cls, scene: Scene) -> Chain:
        """Reads ``[device]``, ``[transmission]``, ``[hand]`` and the bandwidths of a resolved scene."""
        device, hand, cable = scene.device, scene.hand, scene.transmission
        bodies, masses, links = ["device"], [device.mass], []
        grounded = {"device": (0, device.damping)}
        if cable:
            bodies, masses = ["motor", "tip"], [cable.motor_mass, device.mass]
            links.append(Link("cable", cable.stiffness, cable.damping))
            grounded = {"motor": (0, cable.motor_damping), "device": (1, device.damping)}
        spring = 0.0, 0.0
        if hand:
            if grip := hand.grip:
                bodies.append("hand")
                masses.append(hand.mass)
                links.append(Link("grip", grip.stiffness, grip.damping))
            else:
                masses[-1] = masses[-1] + hand.mass
            grounded["hand"] = (len(bodies) - 1, hand.damping)
            spring = hand.stiffness, hand.rest
        bandwidth = scene.actuator.bandwidth if scene.actuator else None
        actuator_rate = None if bandwidth is None else 2.0 * np.pi * bandwidth
        table, sensor = scene.accelerometer, None
        if table and table.bandwidth is not None and accelerometer_is_used(scene):
            sensor = sensor_body(scene), 2.0 * np.pi * table.bandwidth
        start = device.position, device.velocity
        return cls(tuple(bodies), tuple(masses), grounded, tuple(links), spring, actuator_rate, sensor, start)

    def __hash__(self) -> int:
        return hash(repr(self))  # one of the fields is a dict, which has no hash

    @property
    def count(self) -> int:
        """N, the number of bodies."""
        return len(self.bodies)

    @property
    def positions(self) -> tuple[str, ...]:
        return "x", *(f"{link.name}.stretch" for link in self.links)

    @property
    def states(self) -> tuple[str, ...]:
        rates = ["v", *(f"{link.name}.rate" for link in self.links)]
        actuator = ["actuator"] if self.actuator_rate is not None else []
        return *self.positions, *rates, *actuator, *(["accelerometer"] if self.sensor else [])

    def start_state(self, *members: int) -> np.ndarray:
        """Returns all states at t = 0, shape (states,); for a batch of that many members, (states, members)."""
        z = np.zeros((len(self.states), *members))
        z[0], z[self.count] = self.start
        return z

    def absolute(self) -> Matrix:
        """Returns T, the matrix from relative positions (velocities) to those of all bodies, shape (N, N)."""
        return np.tril(np.ones((self.count, self.count)))

    def accelerations(self, stuck: bool = False) -> Matrix:
        """Returns the matrix from (states, command, friction, load) to all accelerations, shape (N, states + 3).

        ``load`` is tau + k_h rest. ``stuck``: body 0 is held by friction whatever acts on it.
        """
        n, size = self.count, len(self.states)
        forces = np.zeros((n, size + 3), _wide)
        for i, link in enumerate(self.links):
            pull = np.zeros(size + 3, _wide)
            pull[i + 1], pull[n + i + 1] = link.stiffness, link.damping
            forces[i] += pull
            forces[i + 1] -= pull
        for body, damping in self.grounded.values():
            forces[body, n : n + body + 1] -= damping
        forces[-1, :n] -= self.spring[0]
        forces[0, size if self.actuator_rate is None else self.states.index("actuator")] += 1.0
        forces[0, size + 1] += 1.0
        forces[-1, size + 2] += 1.0
        result = forces / np.array(self.masses_kg, _wide)[:, None]
        if stuck:
            result[0] = 0.0
        return result

    def rates(self, stuck: bool = False) -> Matrix:
        """Returns the matrix from (states, command, friction, load) to the rates, shape (states, states + 3), 1/s.

        While body 0 is stuck, v is 0 and so is its rate, and x stays.
        """
        n, size = self.count, len(self.states)
        accelerations = self.accelerations(stuck)
        rates = np.zeros((size, size + 3), _wide)
        rates[np.arange(n), n + np.arange(n)] = 1.0
        rates[n : 2 * n] = np.diff(accelerations, axis=0, prepend=np.zeros((1, size + 3), _wide))
        if stuck:
            rates[0] = 0.0
        if self.actuator_rate is not None:
            p = self.states.index("actuator")
            rates[p, p], rates[p, size] = -self.actuator_rate, self.actuator_rate
        if self.sensor:
            body, rate = self.sensor
            rates[-1] = rate * accelerations[body]
            rates[-1, size - 1] -= rate
        return rates

    def poles(self) -> NDArray[np.complex128]:
        """Returns the eigenvalues s of free motions e^(s t), 1/s, complex, shape (states,)."""
        return np.linalg.eigvals(self.rates()[:, : len(self.states)].astype(float)).astype(np.complex128)

    def real_for(self, step_s: float) -> type[np.floating]:
        """Returns the float type in which to sum forms of rates; see ``transition.real_for``."""
        n = self.count
        return real_for(float(np.abs(self.rates()[n : 2 * n, n : 2 * n]).max()), step_s)

    def scales(self, step_s: float) -> np.ndarray:
        """Returns factors that make (states, command, friction, load) velocities: c of lengths, h/m of forces, h of y.

        c is at least 1/h and at least the fastest natural frequency (row sums bound it).
        """
        n, size, h = self.count, len(self.states), _wide(step_s)
        stiff = np.abs(self.rates()[n : 2 * n, :n]).sum(axis=1).max()
        scales = np.ones(size + 3, _wide)
        scales[:n] = max(np.sqrt(stiff), 1.0 / h)
        force = h / min(self.masses_kg)
        scales[size:] = force
        if self.actuator_rate is not None:
            scales[self.states.index("actuator")] = force
        if self.sensor:
            scales[size - 1] = h
        return scales


def sensor_body(scene: Scene) -> int:
    """Returns the body an accelerometer is mounted on: the first if there is no cable, or for an ideal one."""
    is_at_tip = scene.accelerometer is not None and scene.accelerometer.mount == "tip"
    return int(scene.transmission is not None and is_at_tip)
