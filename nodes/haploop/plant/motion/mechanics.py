"""Device and hand as one linear mechanical system: m a + b v + k (x - rest) = f_d + tau."""

from __future__ import annotations

from dataclasses import dataclass

from haploop.protocol.scene.scene import Scene


@dataclass(frozen=True)
class Mechanics:
    """The device with the hand rigidly attached (Choi et al. 2022, eq. 10 and 11 added), or the device alone.

    Attributes:
        dampers: physical dampers by name, N s/m; their sum is b.
        stiffness, rest_m: k_h, N/m; x_rest.
        start: initial position in m and velocity in m/s.
    """

    mass_kg: float
    dampers: dict[str, float]
    stiffness: float
    rest_m: float
    start: tuple[float, float]

    @classmethod
    def from_scene(cls, scene: Scene) -> Mechanics:
        device, hand = scene.device, scene.hand
        start = device.position, device.velocity
        if hand is None:
            return cls(device.mass, {"device": device.damping}, 0.0, 0.0, start)
        dampers = {"device": device.damping, "hand": hand.damping}
        return cls(device.mass + hand.mass, dampers, hand.stiffness, hand.rest, start)

    @property
    def damping(self) -> float:
        """b, N s/m."""
        return sum(self.dampers.values())

    def kinetic_J(self, v):
        """Kinetic energy at velocity v (m/s)."""
        return 0.5 * self.mass_kg * v * v

    def spring_J(self, x):
        """Energy in the hand's spring at position x (m)."""
        return 0.5 * self.stiffness * (x - self.rest_m) * (x - self.rest_m)
