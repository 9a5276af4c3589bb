"""A plant in plain Python on the seat of examples/: one mass by RK4, the hand's force at every stage. No haploop.

usage: plain_plant.py SOCKETS, by `haploop run --node plant=...`
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "examples"))
from hand import hand_force
from seat import take_seat


def main():
    seat = take_seat("plain plant", "1")
    device, hand, h = seat.scene["device"], seat.scene.get("hand", {}), seat.step_s
    mass, damping = (device[key] + hand.get(key, 0.0) for key in ("mass", "damping"))
    stiffness, rest, tau = hand.get("stiffness", 0.0), hand.get("rest", 0.0), hand_force(seat.scene)
    x, v, step = device.get("position", 0.0), device.get("velocity", 0.0), 0

    def rates(t, x, v, force):
        return v, (force + tau(t) - damping * v - stiffness * (x - rest)) / mass

    def advance(force):
        nonlocal x, v, step
        t = step * h
        k1 = rates(t, x, v, force)
        k2 = rates(t + h / 2, x + h / 2 * k1[0], v + h / 2 * k1[1], force)
        k3 = rates(t + h / 2, x + h / 2 * k2[0], v + h / 2 * k2[1], force)
        k4 = rates(t + h, x + h * k3[0], v + h * k3[1], force)
        x += h / 6 * (k1[0] + 2 * k2[0] + 2 * k3[0] + k4[0])
        v += h / 6 * (k1[1] + 2 * k2[1] + 2 * k3[1] + k4[1])
        step += 1
        return x, v

    seat.run(advance, x, v)


if __name__ == "__main__":
    main()
