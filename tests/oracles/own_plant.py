"""Plants of a device and a hand as one mass, by a chosen integrator; nothing of haploop is imported.

usage (as the plant of a run): own_plant.py METHOD [SHARE [HELD]] DIRECTORY

m a + b v + k (x - rest) = f + tau, f held over a plant step, tau a straight line over it.
METHOD: exact, rk4, euler (explicit), semi (semi-implicit Euler), or gain: exact, except that the velocity after each
step is made larger by SHARE (smaller where SHARE is below 0), so that it invents energy on purpose.
HELD: a file for the force that a device would be given at every tick, one per line.
"""

import os
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[2] / "examples"))

from hand import hand_force

METHODS = ("exact", "rk4", "euler", "semi", "gain")


class OnePart:
    """Device and hand of a scene, a table as in the protocol: x in m, v in m/s, and the step that moves them on."""

    def __init__(self, scene, step_s, method, share=0.0):
        device, hand = scene["device"], scene.get("hand") or {}
        self.x, self.v = device.get("position", 0.0), device.get("velocity", 0.0)
        self.mass = device["mass"] + hand.get("mass", 0.0)
        self.damping = device["damping"] + hand.get("damping", 0.0)
        self.stiffness, self.rest = hand.get("stiffness", 0.0), hand.get("rest", 0.0)
        self._h, self._tau, self._steps = step_s, hand_force(scene), 0
        self._share = share if method == "gain" else 0.0
        self._move = getattr(self, f"_{'exact' if method == 'gain' else method}")

    def step(self, force):
        """Moves on by a plant step under a held force, N; returns x and v after it."""
        begin, end = (self._tau((self._steps + i) * self._h) for i in (0, 1))
        self._move(force + begin, (end - begin) / self._h)
        self._steps += 1
        self.v *= 1.0 + self._share
        return self.x, self.v

    def _rates(self, x, v, push):
        return v, (push - self.damping * v - self.stiffness * (x - self.rest)) / self.mass

    def _exact(self, push, rise):
        """The Taylor series of the motion: each derivative follows from the two before it."""
        h, before, now = self._h, self.v, self._rates(self.x, self.v, push)[1]
        dx, dv, factor = h * before, 0.0, h
        for order in range(1, 30):
            dv += factor * now
            factor *= h / (order + 1)
            dx += factor * now
            following = (rise if order == 1 else 0.0) - self.damping * now - self.stiffness * before
            before, now = now, following / self.mass
        self.x, self.v = self.x + dx, self.v + dv

    def _rk4(self, push, rise):
        h, x, v = self._h, self.x, self.v
        k1 = self._rates(x, v, push)
        k2 = self._rates(x + h / 2 * k1[0], v + h / 2 * k1[1], push + rise * h / 2)
        k3 = self._rates(x + h / 2 * k2[0], v + h / 2 * k2[1], push + rise * h / 2)
        k4 = self._rates(x + h * k3[0], v + h * k3[1], push + rise * h)
        slopes = [(a + 2 * b + 2 * c + d) / 6 for a, b, c, d in zip(k1, k2, k3, k4, strict=True)]
        self.x, self.v = x + h * slopes[0], v + h * slopes[1]

    def _euler(self, push, rise):
        dx, dv = self._rates(self.x, self.v, push)
        self.x, self.v = self.x + self._h * dx, self.v + self._h * dv

    def _semi(self, push, rise):
        self.v += self._h * self._rates(self.x, self.v, push)[1]
        self.x += self._h * self.v


if __name__ == "__main__":
    from seat import take_seat

    chosen = sys.argv[1:-1]
    seat = take_seat("own plant", "1")
    plant = OnePart(seat.scene, seat.step_s, chosen[0], float(chosen[1]) if len(chosen) > 1 else 0.0)
    with Path(chosen[2] if len(chosen) > 2 else os.devnull).open("w", buffering=1, encoding="utf-8") as held:
        seat.run(plant.step, plant.x, plant.v, lambda force: print(force, file=held))
