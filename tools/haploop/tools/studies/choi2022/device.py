"""A PHANToM Premium 1.5 in a hand that taps and presses a wall; everything that was not published is a value to choose.

Its nearest interpretation is a scene file: launch/scenes/premium_press.toml.
"""

from __future__ import annotations

import math
import tomllib
from dataclasses import asdict, dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, Self

from haploop.launch.scene.bundled import bundled_folder
from haploop.protocol.scene.effects import Friction, Transmission
from haploop.protocol.scene.estimators import Acceleration, Velocity
from haploop.protocol.scene.hand_force import Constant
from haploop.protocol.scene.scene import Device, ElementTable, Hand, Scene
from haploop.tools.linear.stiffness_limit import smooth
from haploop.tools.search.random import Row
from haploop.tools.studies.choi2022.runs import hand_of, shipped, wall_of

Elements = tuple[ElementTable, ...]
KINDS = ("nothing", "damping", "bidirectional-inertia", "unidirectional-inertia")
SCENE_FILE = "premium_press.toml"
_TEMPLATE = Path(__file__).with_name("premium_press.toml.in")
_PLACES = {"motor": "the near side, that of the rotor", "tip": "the motor's body, which moves with the link"}
# Published: Cavusoglu et al. 2002 (mass, viscous and dry friction of the joint with its motor, at the tip); Fu
# and Cavusoglu 2012 (the hand).
MASS_KG, DAMPING_N_S_M, FRICTION_N, HAND_KG = 0.0525, 0.0114, 0.048, 0.269
# Bandwidth in Hz and the rest of the delay in s, by the filter setting of an MPU-9250 (its data sheet: 0.50, 1.38 and
# 1.88 ms in total, of which a first-order filter of that bandwidth causes 0.15, 0.38 and 0.73 ms).
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

    Two masses on an elastic drive vibrate at mode_Hz = sqrt(k / mu) / 2 pi, mu = m_1 m_2 / (m_1 + m_2), with the
    damping ratio d / (2 sqrt(k mu)). The near one carries actuator, encoder and friction.

    Attributes:
        mode_Hz: frequency of the drive's mode, with the device in no hand.
        near_share: the near mass as a share of both.
        mode_damping: ratio of the mode's damping to its critical damping.
        push_N: force with which the hand presses.
        entry_m_s: speed at which the wall is met.
        hand: share of the published hand's mass, damping and stiffness.
        delay_s: extra delay of the loop, beyond the hold.
        unit: setting of the inertial unit, a key of ``UNITS``.
        mount: the mass that carries the unit, "motor" (near) or "tip" (far).
        velocity: low-pass over the encoder's differences, a key of ``VELOCITIES``.
        acceleration: "unit", or "encoder" for differences of the velocity, which the paper found too noisy.
        friction_N: Coulomb friction at the near mass (published: 0.048 N); 0 leaves it out, which makes a run some
            forty times cheaper.
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
    def from_scene(cls, scene: Scene) -> Self:
        """Reads a setup from a scene made by ``scene``, or from its file; numbers to three digits."""
        drive, unit, hand = scene.transmission, scene.accelerometer, hand_of(scene)
        if not (drive and unit and isinstance(hand.force, Constant)):
            raise ValueError("A setup has a drive, an inertial unit and a hand that presses.")
        near, far = drive.motor_mass, scene.device.mass
        reduced = near * far / (near + far)
        cutoff = scene.velocity.cutoff if scene.velocity else None
        return cls(
            mode_Hz=_rounded(math.sqrt(drive.stiffness / reduced) / (2.0 * math.pi)),
            near_share=_rounded(near / (near + far)),
            mode_damping=_rounded(drive.damping / (2.0 * math.sqrt(drive.stiffness * reduced))),
            push_N=-hand.force.value,
            entry_m_s=-scene.device.velocity,
            hand=_rounded(hand.mass / HAND_KG),
            delay_s=scene.clock.round_trip_delay,
            unit=next(name for name, one in UNITS.items() if one == (unit.bandwidth, unit.delay)),
            mount=unit.mount,
            velocity=next(name for name, one in VELOCITIES.items() if one == cutoff),
            friction_N=scene.friction.kinetic if scene.friction else 0.0,
        )

    def as_dict(self) -> Row:
        return asdict(self)

    def scene(self, stiffness: float, elements: Elements = ()) -> Scene:
        """Returns the resolved scene of this setup with a wall of this stiffness in N/m."""
        base, unit = shipped(SCENE_FILE), shipped(SCENE_FILE).accelerometer
        assert unit
        near, far = self.near_share * MASS_KG, (1.0 - self.near_share) * MASS_KG
        reduced = near * far / MASS_KG
        spring = (2.0 * math.pi * self.mode_Hz) ** 2 * reduced
        bandwidth, late = UNITS[self.unit]
        cutoff, by_unit = VELOCITIES[self.velocity], self.acceleration == "unit"
        return replace(
            base,
            clock=replace(base.clock, round_trip_delay=self.delay_s),
            device=Device(mass=far, damping=0.0, velocity=-self.entry_m_s),
            transmission=Transmission(
                motor_mass=near,
                stiffness=spring,
                damping=2.0 * self.mode_damping * math.sqrt(spring * reduced),
                motor_damping=DAMPING_N_S_M,
            ),
            accelerometer=replace(unit, bandwidth=bandwidth, delay=late, mount=self.mount) if by_unit else None,
            velocity=Velocity(cutoff=cutoff) if cutoff else None,
            acceleration=Acceleration(source="accelerometer" if by_unit else "encoder"),
            hand=replace(_hand_times(self.hand), force=Constant(value=-self.push_N)),
            wall=replace(wall_of(base), stiffness=float(stiffness)),
            friction=Friction(kinetic=self.friction_N) if self.friction_N else None,
            dissipation=elements,
        )

    def linear_scene(self, elements: Elements = ()) -> Scene:
        """Returns the scene without friction and encoder; it is linear in contact if its elements are linear."""
        return replace(smooth(self.scene(1.0, elements)), friction=None)


def nearest() -> Setup:
    """Returns the setup of ``premium_press.toml``: the one nearest to the paper that the search of Fig. 7 found."""
    return Setup.from_scene(shipped(SCENE_FILE))


def elements_of(kind: str, *sizes: float) -> Elements:
    """Makes one element of a kind in ``KINDS``, damping in N s/m, inertia in kg; for "both", damping and inertia."""
    if kind == "both":
        return elements_of("damping", sizes[0]) + elements_of("unidirectional-inertia", sizes[1])
    if kind == "nothing":
        return ()
    return (ElementTable(name=kind, parameters={"damping" if kind == "damping" else "mass": sizes[0]}),)


def file_text(setup: Setup) -> str:
    """Returns the scene file of a setup, ``premium_press.toml.in`` with its numbers to six digits."""
    scene = setup.scene(5000.0)
    bandwidth, cutoff = UNITS[setup.unit][0], VELOCITIES[setup.velocity]
    return _TEMPLATE.read_text(encoding="utf-8").format(
        setup=setup,
        mass=MASS_KG,
        share=100 * setup.near_share,
        ratio=100 * setup.mode_damping,
        setting=f"at its setting of {setup.unit}" if bandwidth else "but with no lag of its own",
        bandwidth=f"bandwidth = {bandwidth}  # Hz. ASSUMPTION\n" if bandwidth else "",
        place=_PLACES[setup.mount],
        filtered=f"\n[velocity]\ncutoff = {cutoff}  # Hz. ASSUMPTION\n" if cutoff else "",
        **_six_digits(scene.as_dict()),
    )


def _six_digits(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _six_digits(one) for key, one in value.items()}
    return _rounded(value, 6) if isinstance(value, float) else value


def _rounded(value: float, digits: int = 3) -> float:
    return float(f"{value:.{digits}g}")


@cache
def _hand_times(share: float) -> Hand:
    """Makes the published hand with its mass, damping and stiffness scaled by ``share``."""
    file = bundled_folder("hands") / "fu_cavusoglu_y.toml"
    table = tomllib.loads(file.read_text(encoding="utf-8"))["hand"]
    grip, hand = ({key: share * value for key, value in of.items() if key != "grip"} for of in (table["grip"], table))
    base = hand_of(shipped(SCENE_FILE))
    return replace(base, grip=base.grip and replace(base.grip, **grip), **hand)
