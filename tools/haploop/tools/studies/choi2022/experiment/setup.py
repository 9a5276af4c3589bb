"""A PHANToM Premium 1.5 in a hand that taps and presses a wall, with all that nobody published as numbers to choose."""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from functools import cache
from typing import Any, Self

from haploop.launch.scene.file import load
from haploop.tools.cost.grid import scenes_folder

Elements = list[dict[str, Any]]
KINDS = ("nothing", "damping", "bidirectional-inertia", "unidirectional-inertia")
SCENE_FILE = "premium_press.toml"
# Published: Cavusoglu et al. 2002 (mass, viscous and dry friction of the joint with its motor, at the tip); Fu
# and Cavusoglu 2012 (the hand).
MASS_KG, DAMPING_N_S_M, FRICTION_N, HAND_KG = 0.0525, 0.0114, 0.048, 0.269
# Bandwidth in Hz and what is left of the delay in s, by the filter setting of an MPU-9250 (its data sheet: 0.50, 1.38
# and 1.88 ms in all, of which a first-order filter of that bandwidth is 0.15, 0.38 and 0.73 ms).
UNITS: dict[str, tuple[float | None, float]] = {
    "ideal": (None, 0.0),
    "1046 Hz": (1046.0, 0.0003),
    "420 Hz": (420.0, 0.001),
    "218 Hz": (218.0, 0.0012),
}
# Cutoff in Hz of the low-pass over the velocity that damping and the gate of eq. 9 see, or none.
VELOCITIES: dict[str, float | None] = {"none": None, "200 Hz": 200.0, "50 Hz": 50.0}


@dataclass(frozen=True)
class Setup:
    """An interpretation of the experiments: one value for each thing that is not published.

    Two masses on an elastic drive ring at mode_Hz = sqrt(k / mu) / 2 pi, mu = m_1 m_2 / (m_1 + m_2), with the damping
    ratio d / (2 sqrt(k mu)). The near one carries actuator, encoder and friction.

    Attributes:
        mode_Hz: frequency of the drive's mode, the device in no hand.
        near_share: the near mass over both.
        mode_damping: ratio of the mode's damping to the critical.
        push_N: force of the hand, pressing.
        entry_m_s: speed at which the wall is met.
        hand: share of the published hand's mass, damping and stiffness.
        delay_s: extra delay of the loop, beyond the hold.
        unit: setting of the inertial unit, a key of ``UNITS``.
        mount: the mass the unit is on, "motor" (near) or "tip" (far).
        velocity: low-pass over the encoder's differences, a key of ``VELOCITIES``.
        acceleration: "unit", or "encoder" for differences of the velocity, which the paper found too noisy.
        friction_N: Coulomb friction at the near mass (published: 0.048 N); 0 leaves it out, which is some forty times
            cheaper to run.
    """

    mode_Hz: float
    near_share: float
    mode_damping: float
    push_N: float
    entry_m_s: float
    hand: float
    delay_s: float
    unit: str
    mount: str
    velocity: str = "none"
    acceleration: str = "unit"
    friction_N: float = 0.0

    @classmethod
    def from_scene(cls, scene: dict[str, Any]) -> Self:
        """Reads it from a scene made by ``scene``, or from its file; numbers to three digits."""
        near, far = scene["transmission"]["motor_mass"], scene["device"]["mass"]
        reduced, spring = near * far / (near + far), scene["transmission"]["stiffness"]
        bandwidth, late = scene["accelerometer"].get("bandwidth"), scene["accelerometer"].get("delay", 0.0)
        cutoff = scene.get("velocity", {}).get("cutoff")
        return cls(
            mode_Hz=_rounded(math.sqrt(spring / reduced) / (2.0 * math.pi)),
            near_share=_rounded(near / (near + far)),
            mode_damping=_rounded(scene["transmission"]["damping"] / (2.0 * math.sqrt(spring * reduced))),
            push_N=-scene["hand"]["force"]["value"],
            entry_m_s=-scene["device"]["velocity"],
            hand=_rounded(scene["hand"]["mass"] / HAND_KG),
            delay_s=scene["clock"]["round_trip_delay"],
            unit=next(name for name, unit in UNITS.items() if unit == (bandwidth, late)),
            mount=scene["accelerometer"]["mount"],
            velocity=next(name for name, one in VELOCITIES.items() if one == cutoff),
            friction_N=scene["friction"]["kinetic"] if "friction" in scene else 0.0,
        )

    def scene(self, stiffness: float, elements: Elements, seed: int = 1) -> dict[str, Any]:
        """Returns the resolved scene with a wall of this stiffness in N/m."""
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
        scene["accelerometer"] |= {"delay": late, "mount": self.mount} | ({"bandwidth": bandwidth} if bandwidth else {})
        if cutoff := VELOCITIES[self.velocity]:
            scene["velocity"] = {"cutoff": cutoff}
        if self.acceleration == "encoder":
            scene["acceleration"] = {"source": "encoder"}
            del scene["accelerometer"]
        for table in (scene["hand"], scene["hand"]["grip"]):
            for key in table.keys() & {"mass", "damping", "stiffness"}:
                table[key] *= self.hand
        scene["hand"]["force"]["value"] = -self.push_N
        scene["wall"]["stiffness"] = float(stiffness)
        if self.friction_N:
            scene["friction"] = {"kinetic": self.friction_N}
        if elements:
            scene["dissipation"] = elements
        return scene

    def linear_scene(self, elements: Elements) -> dict[str, Any]:
        """Returns the scene without friction and encoder, linear in contact where its elements are."""
        from haploop.tools.linear.stiffness_limit import smooth

        scene = smooth(self.scene(1.0, elements))
        scene.pop("friction", None)
        return scene

    @classmethod
    def from_row(cls, row: Mapping[str, Any]) -> Self:
        """Takes it from a row that holds its values among others."""
        return cls(**{key.name: row[key.name] for key in fields(cls)})

    def as_dict(self) -> dict[str, Any]:
        """Returns all values by name."""
        return asdict(self)


def nearest() -> Setup:
    """Returns the setup of ``premium_press.toml``: that nearest to the paper which the search of Fig. 7 found."""
    return Setup.from_scene(_of_the_file())


def elements_of(kind: str, size: float) -> Elements:
    """Makes one element of a kind of ``KINDS``: damping in N s/m, inertia in kg."""
    match kind:
        case "nothing":
            return []
        case "damping":
            return [{"kind": kind, "acts": "in-contact", "damping": size}]
        case _:
            return [{"kind": kind, "acts": "in-contact", "mass": size}]


def both(damping: float, mass: float) -> Elements:
    """Makes damping in N s/m with unidirectional inertia in kg."""
    return elements_of("damping", damping) + elements_of("unidirectional-inertia", mass)


def _rounded(value: float, digits: int = 3) -> float:
    return float(f"{value:.{digits}g}")


@cache
def _of_the_file() -> dict[str, Any]:
    return load(scenes_folder() / SCENE_FILE)


@cache
def _base() -> dict[str, Any]:
    """Returns what all setups have in common: the published hand, and nothing of the unit's setting."""
    scene = copy.deepcopy(_of_the_file())
    scene["dissipation"] = []
    share = Setup.from_scene(scene).hand
    for table in (scene["hand"], scene["hand"]["grip"]):
        for key in table.keys() & {"mass", "damping", "stiffness"}:
            table[key] = _rounded(table[key] / share, 6)
    for table in ("velocity", "friction"):
        scene.pop(table, None)
    scene["accelerometer"].pop("bandwidth", None)
    return scene
