"""The scene: one sampled haptic loop. A table that is absent is not simulated."""

from __future__ import annotations

from dataclasses import field, replace
from typing import Annotated, Any, Literal

from haploop.protocol.quantity import si
from haploop.protocol.scene.effects import Accelerometer, Actuator, Friction, Grip, Jitter, Loss, Noise, Transmission
from haploop.protocol.scene.estimators import Acceleration, Velocity
from haploop.protocol.scene.hand_force import HandForce
from haploop.protocol.scene.table import OpenTable, Table, Tables

# Light takes 2.6 s to the moon and back; a force that is later than this is no answer to a hand.
LONGEST_DELAY_S = 10.0
MOST_RATE_HZ = 10**7


class Clock(Table):
    """Rates, delay and the method that moves the plant; the plant rate is a whole multiple of the control rate."""

    plant_rate: Annotated[
        int, si("Hz", "steps of the plant per second", whole=True, at_least=1, at_most=MOST_RATE_HZ)
    ] = 10_000
    control_rate: Annotated[
        int, si("Hz", "ticks of the controller per second", whole=True, at_least=1, at_most=MOST_RATE_HZ)
    ] = 1_000
    round_trip_delay: Annotated[
        float, si("s", "from a sample to the force that answers it", at_least=0, at_most=LONGEST_DELAY_S)
    ] = 0.0
    integrator: str = "exact"


class Device(Table):
    """The device: a mass with viscous damping (Choi et al. 2022, eq. 10)."""

    mass: Annotated[float, si("kg", "moving mass", above=0)]
    damping: Annotated[float, si("N s/m", "viscous damping", at_least=0)]
    position: Annotated[float, si("m", "position at t = 0")] = 0.0
    velocity: Annotated[float, si("m/s", "velocity at t = 0")] = 0.0


class Hand(Table):
    """The hand, attached rigidly (Choi et al. 2022, eq. 11) or by a grip, and the force of its muscles.

    A hand of kind "unmodelled" has no other key: only a foreign program moves its device, and the work of the hand is
    booked as what closes the energy balance.
    """

    kind: Literal["unmodelled"] | None = None  # pyright: ignore[reportIncompatibleVariableOverride]
    mass: Annotated[float, si("kg", "mass that moves with the device", at_least=0)] = 0.0
    damping: Annotated[float, si("N s/m", "viscous damping", at_least=0)] = 0.0
    stiffness: Annotated[float, si("N/m", "stiffness", at_least=0)] = 0.0
    rest: Annotated[float, si("m", "position at which the hand's spring is slack")] = 0.0
    force: HandForce | None = None
    grip: Grip | None = None


class Encoder(Table):
    """The position is read in whole counts."""

    resolution: Annotated[float, si("m", "one count", above=0)]
    rounding: Literal["nearest", "floor"] = "nearest"


class Wall(OpenTable):
    """The virtual wall, felt inside it: a spring, or a wall of the named kind with the parameters of that kind."""

    kind: str | None = None  # pyright: ignore[reportIncompatibleVariableOverride]
    position: Annotated[float, si("m", "where the surface is")]
    stiffness: Annotated[float, si("N/m", "stiffness", at_least=0)]
    occupies: Literal["below", "above"] = "below"


class Run(Table):
    """How a run is carried out and judged; nothing here changes a bit of its motion.

    ``verdict``: "pushed" holds the hand still at the end of the run and pushes it; "window", far cheaper, looks at the
    last half second alone.
    """

    log: Literal["steps", "ticks", "none"] = "steps"
    pin: bool = True
    block_ticks: Annotated[int, si("", "most ticks in a block of telemetry", whole=True, at_least=1, at_most=10**6)] = (
        1000
    )
    window_blocks: Annotated[int, si("", "blocks the clock grants ahead", whole=True, at_least=1, at_most=100)] = 2
    deadline: Annotated[float, si("s", "wall time a node may stay silent", above=0)] = 5.0
    verdict: Literal["pushed", "window"] = "pushed"
    faulty_swap: Literal["restore", "end"] = "restore"


# The kind of a swap that removes an element.
NO_ELEMENT = "none"


class ElementTable(Table):
    """A dissipation element: its kind, when it acts, and the values of the parameters that the kind declares.

    In a swap the kind may be ``NO_ELEMENT``.
    """

    name: str
    acts: Literal["in-contact", "always"] = "in-contact"
    parameters: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def from_dict(cls, data: Tables) -> ElementTable:
        """Makes the table from ``{"kind": ..., "acts": ..., parameter: value, ...}``."""
        parameters = {key: value for key, value in data.items() if key not in ("kind", "acts")}
        return cls(name=data["kind"], acts=data.get("acts", "in-contact"), parameters=parameters)

    def as_dict(self) -> Tables:
        """Returns what ``from_dict`` takes."""
        if self.name == NO_ELEMENT:
            return {"kind": self.name}
        return {"kind": self.name, "acts": self.acts, **self.parameters}


class EventTable(Table):
    """What changes during the run; exactly one of swap, set, pause and stop."""

    at: Annotated[float, si("s", "time; the first tick at or after it sees the change", at_least=0)]
    swap: ElementTable | None = None
    element: Annotated[int | None, si("", "which element a swap replaces", at_least=0, whole=True)] = None
    # Settable key -> value in SI units.
    set: dict[str, float] | None = None
    pause: Literal[True] | None = None
    stop: Literal[True] | None = None


class Scene(OpenTable):
    """A scene: one sampled haptic loop."""

    title: str
    duration: Annotated[float, si("s", "simulated time", above=0)]
    seed: Annotated[int, si("", "seed of everything random", whole=True, at_least=0, below=2**63)] = 0
    diverged_beyond: Annotated[
        float, si("m", "the run ends when the device is farther from 0", above=0, at_most=1e100)
    ] = 1.0
    clock: Clock = Clock()
    device: Device
    transmission: Transmission | None = None
    friction: Friction | None = None
    hand: Hand | None = None
    encoder: Encoder | None = None
    noise: Noise | None = None
    accelerometer: Accelerometer | None = None
    wall: Wall | None = None
    velocity: Velocity | None = None
    acceleration: Acceleration | None = None
    actuator: Actuator | None = None
    jitter: Jitter | None = None
    loss: Loss | None = None
    dissipation: tuple[ElementTable, ...] = ()
    event: tuple[EventTable, ...] = ()
    run: Run = Run()

    @property
    def count_m(self) -> float:
        """Returns the step of the encoder, m; 0 without one."""
        return self.encoder.resolution if self.encoder else 0.0

    def estimate(self, of: str) -> Velocity | Acceleration:
        """Returns the table of an estimate, "velocity" or "acceleration": its defaults where the scene has none."""
        return (self.velocity or Velocity()) if of == "velocity" else (self.acceleration or Acceleration())

    def in_order(self) -> Scene:
        """Returns the scene with its events in order of time."""
        in_order = tuple(sorted(self.event, key=lambda event: event.at))
        return self if in_order == self.event else replace(self, event=in_order)

    def as_dict(self) -> Tables:
        """Returns the scene as nested dicts and lists, absent tables and empty lists left out."""
        return {key: value for key, value in super().as_dict().items() if value != []}


def hand_is_unmodelled(scene: Scene) -> bool:
    """Tells whether only the device is known of all that moves: no program here can move such a scene."""
    return scene.hand is not None and scene.hand.kind is not None


def accelerometer_is_used(scene: Scene) -> bool:
    """Tells whether samples carry the plant's acceleration beside the position."""
    by_itself = scene.acceleration is not None and scene.acceleration.source == "accelerometer"
    return by_itself or bool(scene.velocity and scene.velocity.accelerometer)


def by_window(scene: Scene) -> Scene:
    """Returns the scene with the cheap verdict, that of the last half second alone."""
    return replace(scene, run=replace(scene.run, verdict="window"))
