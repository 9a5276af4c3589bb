"""A PHANToM Premium 1.5 in a hand, tapping and pressing a wall, with all that nobody published as numbers to choose."""

from __future__ import annotations

import copy
import math
from dataclasses import asdict, dataclass, replace
from functools import cache
from typing import Any

from haploop.launch.scene_file import load
from haploop.tools.cost_grid import scenes_folder

Elements = list[dict[str, Any]]
KINDS = ("nothing", "damping", "bidirectional-inertia", "unidirectional-inertia")
# Published: Cavusoglu et al. 2002 (mass and viscous friction of the joint with its motor, taken to the tip).
MASS_KG, DAMPING_N_S_M = 0.0525, 0.0114
# Bandwidth in Hz and what is left of the delay in s, by the filter setting of an MPU-9250 (its data sheet: 0.50, 1.38
# and 1.88 ms in all, of which a first-order filter of that bandwidth is 0.15, 0.38 and 0.73 ms).
UNITS: dict[str, tuple[float | None, float]] = {
    "ideal": (None, 0.0),
    "1046 Hz": (1046.0, 0.0003),
    "420 Hz": (420.0, 0.001),
    "218 Hz": (218.0, 0.0012),
}


@dataclass(frozen=True)
class Setup:
    """What of the experiments is not published, one value each; the defaults are one of the readings near the paper.

    Two masses on an elastic drive ring at mode_Hz = sqrt(k / mu) / 2 pi, mu = m_1 m_2 / (m_1 + m_2), with the damping
    ratio d / (2 sqrt(k mu)). The near one carries actuator, encoder and friction.

    Attributes:
        mode_Hz: frequency of the drive's mode, the device in no hand.
        near_share: the near mass over both.
        mode_damping: ratio of the mode's damping to the critical.
        delay_s: extra delay of the loop, beyond the hold.
        unit: setting of the inertial unit, a key of ``UNITS``.
        mount: the mass the unit is on, "motor" (near) or "tip" (far).
        push_N: force of the hand, pressing.
        entry_m_s: speed at which the wall is met.
        friction_N: Coulomb friction at the near mass (published: 0.048 N); 0 leaves it out, which is cheaper to run.
        hand: share of the published hand's mass, damping and stiffness.
    """

    mode_Hz: float = 225.0
    near_share: float = 0.45
    mode_damping: float = 0.013
    delay_s: float = 0.0016
    unit: str = "420 Hz"
    mount: str = "tip"
    push_N: float = 3.0
    entry_m_s: float = 0.2
    friction_N: float = 0.048
    hand: float = 1.0

    def scene(self, stiffness: float, elements: Elements, seed: int = 1) -> dict[str, Any]:
        """The resolved scene with a wall of this stiffness in N/m."""
        scene = copy.deepcopy(_base())
        near, far = self.near_share * MASS_KG, (1.0 - self.near_share) * MASS_KG
        reduced = near * far / MASS_KG
        spring = (2.0 * math.pi * self.mode_Hz) ** 2 * reduced
        scene["seed"] = seed
        scene["clock"]["round_trip_delay"] = self.delay_s
        scene["device"] |= {"mass": far, "damping": 0.0, "velocity": -self.entry_m_s}
        scene["transmission"] |= {
            "motor_mass": near,
            "stiffness": spring,
            "damping": 2.0 * self.mode_damping * math.sqrt(spring * reduced),
            "motor_damping": DAMPING_N_S_M,
        }
        bandwidth, late = UNITS[self.unit]
        scene["accelerometer"] |= {"delay": late, "mount": self.mount}
        if bandwidth is None:
            del scene["accelerometer"]["bandwidth"]
        else:
            scene["accelerometer"]["bandwidth"] = bandwidth
        for table in (scene["hand"], scene["hand"]["grip"]):
            for key in ("mass", "damping", "stiffness"):
                if key in table:
                    table[key] *= self.hand
        scene["hand"]["force"]["value"] = -self.push_N
        scene["wall"]["stiffness"] = float(stiffness)
        if self.friction_N:
            scene["friction"]["kinetic"] = self.friction_N
        else:
            del scene["friction"]
        if elements:
            scene["dissipation"] = elements
        return scene

    def cheap(self, wanted: bool = True) -> Setup:
        """Without friction, where that is wanted."""
        return replace(self, friction_N=0.0) if wanted else self

    def linear_scene(self, elements: Elements) -> dict[str, Any]:
        """The scene without friction and encoder, whose loop in contact is one linear map where its elements are."""
        from haploop.tools.stiffness_limit import smooth

        scene = smooth(self.scene(1.0, elements))
        scene.pop("friction", None)
        return scene

    def as_dict(self) -> dict[str, Any]:
        """All of it by name."""
        return asdict(self)


def elements_of(kind: str, size: float) -> Elements:
    """One element of a kind of ``KINDS``: damping in N s/m, inertia in kg."""
    match kind:
        case "nothing":
            return []
        case "damping":
            return [{"kind": kind, "acts": "in-contact", "damping": size}]
        case _:
            return [{"kind": kind, "acts": "in-contact", "mass": size}]


def both(damping: float, mass: float) -> Elements:
    """Damping in N s/m with unidirectional inertia in kg."""
    return elements_of("damping", damping) + elements_of("unidirectional-inertia", mass)


@cache
def _base() -> dict[str, Any]:
    return load(scenes_folder() / "premium_press.toml") | {"dissipation": []}
