"""The plant with its effects a second time: bodies in absolute coordinates, integrated numerically from event to event.

scipy's DOP853 at 1e-12; dry friction as an event that ends a piece of the motion; every heat and every work as a
separate state, integrated together with the motion. Only the scene is shared with haploop.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import scipy

from haploop.protocol.scene.effects import Accelerometer
from haploop.protocol.scene.scene import Hand, Scene


class Bodies:
    """[motor -cable-] tip [-grip- hand] - hand's spring and damper - ground, from a resolved scene.

    The state is z = (x_0 ... x_N-1, v_0 ... v_N-1, p, y, energies), p the force of the actuator and y the output of a
    band-limited accelerometer (both 0 where the scene has none), energies named by ``books``.
    """

    def __init__(self, scene: Scene) -> None:
        device, hand, cable = scene.device, scene.hand or Hand(), scene.transmission
        grip, meter = hand.grip, scene.accelerometer or Accelerometer()
        masses, ground, links = [device.mass], [device.damping], []
        if cable:
            masses.insert(0, cable.motor_mass)
            ground.insert(0, cable.motor_damping)
            links.append((cable.stiffness, cable.damping))
        tip = len(masses) - 1
        if grip:
            masses.append(hand.mass)
            ground.append(hand.damping)
            links.append((grip.stiffness, grip.damping))
        else:
            masses[-1] += hand.mass
            ground[-1] += hand.damping
        self.m, self.ground = np.array(masses), np.array(ground)
        self.link_k, self.link_b = np.array(links).reshape(-1, 2).T
        self.hand_k, self.rest = hand.stiffness, hand.rest
        self.actuator_rate = math.tau * ((scene.actuator and scene.actuator.bandwidth) or 0.0)
        self.meter_rate = math.tau * (meter.bandwidth or 0.0)
        self.meter_body = 0 if meter.mount == "motor" else tip
        self.friction = scene.friction
        self.count = n = len(masses)
        self.books = ["hand_work", "actuator_work", "friction_heat"]
        self.books += [f"ground_heat.{i}" for i in range(n)] + [f"link_heat.{i}" for i in range(n - 1)]
        self.z = np.zeros(2 * n + 2 + len(self.books))
        self.z[:n], self.z[n : 2 * n] = device.position, device.velocity
        self.sliding = 0.0 if scene.friction is None else float(np.sign(device.velocity))

    def friction_N(self, speed: float) -> float:
        """Magnitude of the friction force in motion."""
        table = self.friction
        if table is None:
            return 0.0
        if table.stribeck_velocity is None:
            return table.kinetic
        return table.kinetic + (self.breakaway_N - table.kinetic) * math.exp(-((speed / table.stribeck_velocity) ** 2))

    @property
    def breakaway_N(self) -> float:
        assert self.friction is not None
        return self.friction.kinetic if self.friction.breakaway is None else self.friction.breakaway

    def net(self, z: np.ndarray, command: float, tau: float) -> np.ndarray:
        """The sum of all forces except friction on every body, N."""
        n = self.count
        x, v = z[:n], z[n : 2 * n]
        force = -self.ground * v
        pull = self.link_k * (x[1:] - x[:-1]) + self.link_b * (v[1:] - v[:-1])
        force[:-1] += pull
        force[1:] -= pull
        force[0] += z[2 * n] if self.actuator_rate else command
        force[-1] += tau - self.hand_k * (x[-1] - self.rest)
        return force

    def accelerations(self, z: np.ndarray, command: float, tau: float) -> np.ndarray:
        a = self.net(z, command, tau) / self.m
        if self.friction is not None:
            stuck = self.sliding == 0.0
            a[0] = 0.0 if stuck else a[0] - self.sliding * self.friction_N(z[self.count]) / self.m[0]
        return a

    def rates(self, t: float, z: np.ndarray, command: float, tau: float, slope: float) -> np.ndarray:
        """dz/dt under a held command and tau + slope t."""
        n, load = self.count, tau + slope * t
        v, a = z[n : 2 * n], self.accelerations(z, command, load)
        applied = z[2 * n] if self.actuator_rate else command
        energies = [load * v[-1], applied * v[0], self.friction_N(v[0]) * self.sliding * v[0]]
        low_passed = [self.actuator_rate * (command - z[2 * n]), self.meter_rate * (a[self.meter_body] - z[2 * n + 1])]
        stretching = v[1:] - v[:-1]
        return np.concatenate([v, a, low_passed, energies, self.ground * v**2, self.link_b * stretching**2])

    def stored_J(self) -> float:
        """Kinetic energy and the energy of all springs, J."""
        n, z = self.count, self.z
        kinetic, springs = self.m * z[n : 2 * n] ** 2, self.link_k * np.diff(z[:n]) ** 2
        return (kinetic.sum() + springs.sum() + self.hand_k * (z[n - 1] - self.rest) ** 2) / 2.0

    def energies(self) -> dict[str, float]:
        return dict(zip(self.books, self.z[2 * self.count + 2 :].tolist(), strict=True))

    def reading(self, command: float, tau: float) -> float:
        """Returns the reading of an accelerometer now, under the command held until now."""
        if self.meter_rate:
            return float(self.z[2 * self.count + 1])
        return float(self.accelerations(self.z, command, tau)[self.meter_body])

    def advance(self, command: float, tau: float, slope: float, duration: float) -> None:
        """Moves on under a held command and tau + slope t, from one stop or slip of body 0 to the next."""
        done = 0.0
        while done < duration:
            if self.friction is not None and self.sliding == 0.0:
                self._break_away(self._load(0.0, self.z, command, tau + slope * done))
            done += self._piece(command, tau + slope * done, slope, duration - done)

    def _load(self, _t: float, z: np.ndarray, command: float, tau: float) -> float:
        return float(self.net(z, command, tau)[0])

    def _break_away(self, load: float) -> None:
        if abs(load) > self.breakaway_N:
            self.sliding = math.copysign(1.0, load)

    def _piece(self, command: float, tau: float, slope: float, duration: float) -> float:
        """Moves until body 0 stops or breaks away, at most for ``duration``; returns how long it took."""
        n, forces = self.count, (command, tau, slope)
        if self.friction is None:
            self.z = self._solve(duration, forces)
            return duration
        found = self._solved(duration, forces, self._events())
        hidden = [
            float(t)
            for t, z in zip(found.t_events[1], found.y_events[1], strict=True)
            if self._spare(t, z, *forces) < 0
        ]
        if hidden:  # the margin vanishes and returns within an integration step
            found = self._solved(hidden[0], forces, self._events())
        if not found.t_events[0].size:
            self.z = found.y[:, -1]
            return duration
        length = float(found.t_events[0][0])
        if length > 0.0:  # once more without interpolation
            self.z = self._solve(length, forces)
        if self.sliding:
            self.z[n], self.sliding = 0.0, 0.0
        else:
            self.sliding = math.copysign(1.0, self._load(length, self.z, command, tau + slope * length))
        return length

    def _spare(self, t: float, z: np.ndarray, command: float, tau: float, slope: float) -> float:
        """Returns the margin, above 0, until body 0 stops (speed) or breaks away (force)."""
        if self.sliding:
            return self.sliding * float(z[self.count])
        return self.breakaway_N - abs(self._load(t, z, command, tau + slope * t))

    def _spare_rate(self, t: float, z: np.ndarray, command: float, tau: float, slope: float) -> float:
        """Returns the rate of ``_spare``."""
        change = self.rates(t, z, command, tau, slope)
        if self.sliding:
            return self.sliding * float(change[self.count])
        load_rate = float(self.net(change, 0.0, slope - self.hand_k * self.rest)[0])
        return -math.copysign(load_rate, load_rate * self._load(t, z, command, tau + slope * t))

    def _events(self) -> list[Any]:
        """The end of the margin, which ends the piece, and the minima of the margin before."""

        def ceases(*at: Any) -> float:
            return self._spare(*at)

        def is_least(*at: Any) -> float:
            return self._spare_rate(*at)

        ceases.terminal, ceases.direction = True, -1.0  # pyright: ignore[reportFunctionMemberAccess]
        is_least.direction = 1.0  # pyright: ignore[reportFunctionMemberAccess]
        return [ceases, is_least]

    def _solve(self, duration: float, forces: tuple[float, float, float]) -> np.ndarray:
        return self._solved(duration, forces, None).y[:, -1].copy()

    def _solved(self, duration: float, forces: tuple[float, float, float], events: list[Any] | None) -> Any:
        solved = scipy.integrate.solve_ivp(
            self.rates, (0.0, duration), self.z, "DOP853", events=events, args=forces, rtol=1e-12, atol=1e-16
        )
        assert solved.success, solved.message
        return solved
