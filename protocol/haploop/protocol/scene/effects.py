"""The tables of the effects a real device has. Each is simulated only if the scene has its table."""

from __future__ import annotations

from typing import Annotated, Literal

from haploop.protocol.quantity import si
from haploop.protocol.scene.table import Table

Bandwidth = Annotated[float, si("Hz", "corner of a first-order low-pass", above=0)]


class Noise(Table):
    """Noise on the measured position, before the encoder rounds it: white, band-limited by a first-order low-pass."""

    deviation: Annotated[float, si("m", "standard deviation", at_least=0)]
    cutoff: Annotated[float, si("Hz", "where its spectrum has fallen to half", above=0)]


class Accelerometer(Table):
    """A real accelerometer in place of the ideal one: whatever the table leaves out is ideal."""

    range: Annotated[float | None, si("m/s^2", "largest reading in either direction", above=0)] = None
    resolution: Annotated[float | None, si("m/s^2", "one count", above=0)] = None
    noise_density: Annotated[float, si("m/s^2/Hz^0.5", "density of its white noise", at_least=0)] = 0.0
    bandwidth: Bandwidth | None = None
    delay: Annotated[float, si("s", "age of a reading, whole plant steps", at_least=0, at_most=10)] = 0.0
    bias: Annotated[float, si("m/s^2", "reading at rest")] = 0.0
    mount: Literal["tip", "motor"] = "tip"


class Friction(Table):
    """Dry friction, at the motor if there is a transmission; it holds exactly what does not move."""

    kinetic: Annotated[float, si("N", "force against the motion", at_least=0)]
    breakaway: Annotated[float | None, si("N", "force that sets it in motion, at least kinetic", at_least=0)] = None
    stribeck_velocity: Annotated[
        float | None, si("m/s", "speed over which breakaway falls towards kinetic", above=0)
    ] = None


class Transmission(Table):
    """A cable between motor and tip. ``[device]`` is then the tip; actuator, encoder and friction are at the motor."""

    motor_mass: Annotated[float, si("kg", "inertia of the motor, as a mass at the tip", above=0)]
    stiffness: Annotated[float, si("N/m", "stiffness", above=0)]
    damping: Annotated[float, si("N s/m", "damping within the transmission", at_least=0)] = 0.0
    motor_damping: Annotated[float, si("N s/m", "viscous damping of the motor", at_least=0)] = 0.0


class Grip(Table):
    """The grip between the tip and the hand's mass; the force of the muscles then acts on that mass."""

    stiffness: Annotated[float, si("N/m", "stiffness", above=0)]
    damping: Annotated[float, si("N s/m", "viscous damping", at_least=0)] = 0.0


_SATURATION = (
    "largest force in either direction at every instant; from a data sheet the peak force for taps, the continuous "
    "force for walls that are pressed for long: heat is not simulated"
)


class Actuator(Table):
    """The limits of the motor and its amplifier."""

    saturation: Annotated[float | None, si("N", _SATURATION, above=0)] = None
    bandwidth: Bandwidth | None = None
    resolution: Annotated[float | None, si("N", "one step of force", above=0)] = None


class UniformJitter(Table):
    """Every whole number of plant steps from 0 to most is equally likely."""

    kind = "uniform"
    most: Annotated[float, si("s", "longest additional delay, whole plant steps", at_least=0, at_most=10)]


class GammaJitter(Table):
    """Gamma-distributed, rounded to the nearest plant step."""

    kind = "gamma"
    mean: Annotated[float, si("s", "mean additional delay", above=0, at_most=10)]
    deviation: Annotated[float, si("s", "standard deviation of the additional delay", above=0, at_most=10)]


class Loss(Table):
    """Commands are lost, each independently of the others; the device holds the last one it received."""

    probability: Annotated[float, si("", "share of the commands that are lost", at_least=0, at_most=1)]


Jitter = UniformJitter | GammaJitter
