"""The controller of a scene as an importer of FMUs sees it, and as the header that its C is compiled with."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from haploop.controller.controller import make_params
from haploop.controller.dissipation import registry
from haploop.controller.dissipation.bidirectional_inertia import BidirectionalInertia
from haploop.controller.dissipation.damping import Damping
from haploop.controller.dissipation.unidirectional_damping import UnidirectionalDamping
from haploop.controller.dissipation.unidirectional_inertia import UnidirectionalInertia
from haploop.controller.estimators.base import Difference, Estimator, LowPass, Unchanged
from haploop.controller.estimators.kalman import FusedKalman, Kalman
from haploop.controller.estimators.windows import BestFit, EndFit, WindowDifference
from haploop.controller.tick import ControllerParams
from haploop.protocol.quantity import MEANT
from haploop.protocol.scene.scene import Scene, accelerometer_is_used
from haploop.protocol.ticks import Timebase

# What controller.h can do, by the names of its enumerations. A class derived from one of these may do something else.
ELEMENTS = {
    Damping: "DAMPING",
    UnidirectionalDamping: "UNIDIRECTIONAL_DAMPING",
    BidirectionalInertia: "BIDIRECTIONAL_INERTIA",
    UnidirectionalInertia: "UNIDIRECTIONAL_INERTIA",
}
ESTIMATORS = {
    Unchanged: "UNCHANGED",
    Difference: "DIFFERENCE",
    WindowDifference: "WINDOW",
    EndFit: "END_FIT",
    BestFit: "BEST_FIT",
    Kalman: "KALMAN",
    FusedKalman: "FUSED_KALMAN",
}
_INPUTS = {"encoder": "OF_VELOCITY", "accelerometer": "OF_ACCELEROMETER", "kalman": "OF_KALMAN"}


class NotExportable(Exception):
    """A scene from whose controller no FMU can be made; the message names everything that prevents it."""


@dataclass(frozen=True)
class Variable:
    """A variable of the FMU; its place in the list is its reference.

    Attributes:
        name: that of the scene's key, if it has one.
        symbol: the name of its reference in the C code; "" for the parameter of an element.
        least: the least that may be set; the most is ``MEANT`` of the unit.
    """

    name: str
    symbol: str
    unit: str
    causality: str
    about: str
    start: float = 0.0
    least: float = -math.inf

    @property
    def bounds(self) -> tuple[float, float]:
        most = MEANT[self.unit][0]
        return max(self.least, -most), most


def controller_of(scene: Scene) -> ControllerParams:
    """Returns the controller of a resolved scene from which an FMU can be made.

    Raises:
        NotExportable: the C code lacks an element or an estimator; commands are drawn or changed in mid-run.
    """
    params = make_params(scene, Timebase.from_scene(scene).period_s, registry())
    found = list(_obstacles(scene, params))
    if found:
        raise NotExportable("No FMU can be made of this scene:\n" + "\n".join(f"- {one}" for one in found))
    return params


def _obstacles(scene: Scene, params: ControllerParams) -> Iterator[str]:
    for index, active in enumerate(params.elements):
        if type(active.element) not in ELEMENTS:
            kinds = ", ".join(kind.kind for kind in ELEMENTS)
            yield f"dissipation.{index} is {active.element.kind}, which is Python code; an FMU supports only {kinds}."
    if params.wall.kind != "spring":
        yield f"wall.kind is {params.wall.kind}; an FMU supports only springs."
    for table, estimator in (("velocity", params.velocity), ("acceleration", params.acceleration)):
        if type(_unfiltered(estimator)[0]) not in ESTIMATORS:
            yield f"{table}.estimator is {_unfiltered(estimator)[0].name}, which is Python code of another package."
    for name in ("jitter", "loss"):
        if getattr(scene, name) is not None:
            yield f"[{name}] draws random numbers for every command; remove the table."
    for index, event in enumerate(scene.event):
        if event.swap or event.set:
            yield f"event.{index} changes the loop at {event.at:g} s; an importer sets parameters itself. Remove it."
    for name in scene.others:
        yield f"[{name}] belongs to another package; whether the controller or the line uses it is unknown."


def _unfiltered(estimator: Estimator) -> tuple[Estimator, float]:
    """Returns an estimator without its low-pass, and the gain of that low-pass, 0 if there is none."""
    return (estimator.raw, estimator.gain) if isinstance(estimator, LowPass) else (estimator, 0.0)


def variables_of(scene: Scene, params: ControllerParams) -> list[Variable]:
    """Returns all variables of the FMU: time, force, inputs and parameters, which can be set at any time."""
    found = [
        Variable("time", "TIME", "s", "independent", "time"),
        Variable("force", "FORCE", "N", "output", "force in effect on the device, along +x"),
        Variable("position", "POSITION", "m", "input", "position at the encoder", scene.device.position),
    ]
    if accelerometer_is_used(scene):
        found.append(Variable("acceleration", "ACCELERATION", "m/s^2", "input", "reading of the accelerometer"))

    def parameter(name: str, unit: str, about: str, start: float | None, least: float = 0.0) -> None:
        if start is not None:
            symbol = "" if name.startswith("dissipation.") else name.upper().replace(".", "_")
            found.append(Variable(name, symbol, unit, "parameter", about, start, least))

    if table := scene.encoder:
        about = "one count of the encoder, to which the position is rounded here; 0: the position is rounded already"
        parameter("encoder.resolution", "m", about, table.resolution)
    if table := scene.wall:
        parameter("wall.position", "m", "where the wall's surface is", table.position, -math.inf)
        parameter("wall.stiffness", "N/m", "stiffness of the wall", table.stiffness)
    if table := scene.actuator:
        parameter("actuator.resolution", "N", "one step of the actuator's force; 0: none", table.resolution)
        parameter("actuator.saturation", "N", "largest force of the actuator; 0: no limit", table.saturation)
    for index, active in enumerate(params.elements):
        for name, (quantity, _) in active.element.parameters().items():
            about = f"of dissipation element {index}, {active.element.kind}"
            parameter(f"dissipation.{index}.{name}", quantity.unit, about, getattr(active.element, name))
    return found


def step_count(time: Timebase) -> int:
    """Returns the longest communication step, in plant steps, such that the force changes only at the ends of steps."""
    return math.gcd(time.steps_per_tick, time.delay_steps)


def header(scene: Scene, params: ControllerParams, variables: list[Variable], token: str) -> str:
    """Returns ``scene.h``: everything specific to the scene, with numbers written so that no bit is lost."""
    time = Timebase.from_scene(scene)
    optional = "ACCELERATION ENCODER_RESOLUTION WALL_POSITION WALL_STIFFNESS ACTUATOR_RESOLUTION ACTUATOR_SATURATION"
    references = dict.fromkeys(optional.split(), 0) | {v.symbol: i for i, v in enumerate(variables) if v.symbol}
    of_v, of_a = _unfiltered(params.velocity), _unfiltered(params.acceleration)
    numbers = {
        "TOKEN": f'"{token}"',
        "PLANT_RATE": time.plant_rate.__float__().hex(),
        "STEPS_PER_TICK": time.steps_per_tick,
        "DELAY_STEPS": time.delay_steps,
        "COMMANDS": time.lookahead_ticks + 2,
        "PERIOD_S": time.period_s.hex(),
        "INWARD": params.wall.inward.hex(),
        "ENCODER_ROUNDING": "floor" if scene.encoder and scene.encoder.rounding == "floor" else "rint",
        "INPUT": _INPUTS[params.input],
        "MOST_TICKS": max(_ticks(of_v[0]), _ticks(of_a[0]), 1),
        "N_ELEMENTS": len(params.elements),
        "VARIABLES": len(variables),
        **references,
    }
    places = [place for place, variable in enumerate(variables) if variable.name.startswith("dissipation.")]
    elements = [
        f"{{{ELEMENTS[type(active.element)]}, {int(active.acts == 'always')}, {place}}}"
        for place, active in zip(places, params.elements, strict=True)  # one parameter each
    ]
    known = [f'{{"{v.name}", {float(v.start).hex()}, {v.bounds[0].hex()}, {v.bounds[1].hex()}}}' for v in variables]
    return "\n".join(
        [
            *(f"#define {name} {value}" for name, value in numbers.items()),
            f"static const struct Estimator OF_V = {_estimator(*of_v)}, OF_A = {_estimator(*of_a)};",
            f"static const struct ActiveElement ELEMENTS[] = {{{', '.join(elements or ['{DAMPING, 0, 0}'])}}};",
            "static const struct { const char *name; double start, least, most; } KNOWN[] = {",
            *(f"    {one}," for one in known),
            "};\n",
        ]
    )


def _ticks(of: Estimator) -> int:
    return of.ticks if isinstance(of, WindowDifference | EndFit) else 0


def _estimator(of: Estimator, low_pass: float) -> str:
    """Returns one of ``ESTIMATORS`` as an initialiser of ``struct Estimator``."""
    bound = float(of.bound) if isinstance(of, EndFit) else 0.0
    gains = [column for row in zip(*of.gain, strict=True) for column in row] if isinstance(of, Kalman) else [0.0]
    gain = ", ".join(float(one).hex() for one in gains)
    return f"{{{ESTIMATORS[type(of)]}, {_ticks(of)}, {bound.hex()}, {float(low_pass).hex()}, {{{gain}}}}}"
