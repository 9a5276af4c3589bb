"""The tables of a scene file, with units, bounds and defaults. A table that is absent is not simulated."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING
from functools import cache, reduce
from operator import or_
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar

from pydantic import Field, create_model

from haploop.launch.scene.tables.base import Table
from haploop.launch.scene.tables.effects import (
    Accelerometer,
    Actuator,
    Friction,
    Grip,
    Jitter,
    Loss,
    Noise,
    Transmission,
)
from haploop.launch.scene.tables.estimators import Acceleration, Velocity
from haploop.launch.scene.tables.hand_force import HandForce
from haploop.launch.scene.tables.number import Number, si

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element

TableType = TypeVar("TableType", bound=Table)
Integrator = Literal["exact", "semi-implicit-euler", "euler", "rk4", "implicit-midpoint", "dop853"]


class Clock(Table):
    """Rates, delay and what moves the plant; the plant rate is a whole multiple of the control rate."""

    plant_rate: Annotated[int, si("Hz", "steps of the plant per second", whole=True, at_least=1)] = 10_000
    control_rate: Annotated[int, si("Hz", "ticks of the controller per second", whole=True, at_least=1)] = 1_000
    round_trip_delay: Annotated[float, si("s", "from a sample to the force that answers it", at_least=0)] = 0.0
    integrator: Integrator = "exact"


class Device(Table):
    """The device: a mass with viscous damping (Choi et al. 2022, eq. 10)."""

    mass: Annotated[float, si("kg", "moving mass", above=0)]
    damping: Annotated[float, si("N s/m", "viscous damping", at_least=0)]
    position: Annotated[float, si("m", "position at t = 0")] = 0.0
    velocity: Annotated[float, si("m/s", "velocity at t = 0")] = 0.0


class Hand(Table):
    """The hand, attached rigidly (Choi et al. 2022, eq. 11) or by a grip, and the force of its muscles."""

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


class Wall(Table):
    """The virtual wall: a spring, felt inside."""

    position: Annotated[float, si("m", "where the surface is")]
    stiffness: Annotated[float, si("N/m", "stiffness", at_least=0)]
    occupies: Literal["below", "above"] = "below"


class Run(Table):
    """How a run is carried out; nothing here changes a bit of its result."""

    log: Literal["steps", "ticks", "none"] = "steps"
    pin: bool = True
    block_ticks: Annotated[int, si("", "most ticks in a block of telemetry", whole=True, at_least=1)] = 1000
    window_blocks: Annotated[int, si("", "blocks the clock grants ahead", whole=True, at_least=1, at_most=100)] = 2
    deadline: Annotated[float, si("s", "wall time a node may stay silent", above=0)] = 5.0


class EventTable(Table):
    """What changes during the run; exactly one of swap, set, pause and stop."""

    at: Annotated[float, si("s", "time; the first tick at or after it sees the change", at_least=0)]
    element: Annotated[int | None, si("", "which element a swap replaces", whole=True, at_least=0)] = None
    set: dict[str, Any] | None = Field(None, description='new values: { "wall.stiffness" = 200.0 }')
    pause: Literal[True] | None = None
    stop: Literal[True] | None = None


class SceneTable(Table):
    """A scene: one sampled haptic loop."""

    title: str
    duration: Annotated[float, si("s", "simulated time", above=0)]
    seed: Annotated[int, si("", "seed of everything random", whole=True, at_least=0, below=2**63)] = 0
    diverged_beyond: Annotated[float, si("m", "the run ends when the device is farther from 0", above=0)] = 1.0
    clock: Clock = Field(default_factory=Clock)
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


def number_of(table: type[Table], key: str) -> Number:
    """How the number at ``key`` of a table is read."""
    return next(mark for mark in table.model_fields[key].metadata if isinstance(mark, Number))


def scene_model(kinds: Mapping[str, type[Element]]) -> type[SceneTable]:
    """The whole scene, with the kinds of dissipation element that are at hand."""
    return _scene_model(tuple(kinds.items()))


@cache
def _scene_model(kinds: tuple[tuple[str, type[Element]], ...]) -> type[SceneTable]:
    nothing = _table("none", Table, "Removes the element.", {"kind": (Literal["none"], ...)})
    elements = [_element_table(kind, element) for kind, element in kinds]
    event = _table("Event", EventTable, EventTable.__doc__, {"swap": (_one_of([*elements, nothing]) | None, None)})
    keys = {
        "dissipation": (list[_one_of(elements or [nothing])] | None, None),
        "event": (list[event] | None, None),
        "run": (Run, Field(default_factory=Run)),
    }
    return _table("Scene", SceneTable, SceneTable.__doc__, keys)


def _element_table(kind: str, element: type[Element]) -> type[Table]:
    keys: dict[str, Any] = {
        "kind": (Literal[kind], ...),  # pyright: ignore[reportInvalidTypeForm]
        "acts": (Literal["in-contact", "always"], "in-contact"),
    }
    for name, (quantity, default) in element.parameters().items():
        keys[name] = (Annotated[float, Number(quantity)], ... if default is MISSING else default)
    return _table(kind, Table, element.__doc__, keys)


def _table(name: str, base: type[TableType], about: str | None, keys: dict[str, Any]) -> type[TableType]:
    return create_model(name, __base__=base, __doc__=about, **keys)


def _one_of(tables: list[type[Table]]) -> Any:
    """A table of one of these kinds."""
    return Annotated[reduce(or_, tables), Field(discriminator="kind")] if len(tables) > 1 else tables[0]
