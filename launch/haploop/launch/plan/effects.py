"""The one table of effects: what a scene may name beside device, hand, wall and elements, and what it then costs.

An effect that is not named is not there: its modules are not imported and no instruction is spent on it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

# What bodies in a row, or forces that change between ticks, are moved by in place of ``haploop.plant.motion.one_mass``.
_HISTORY = tuple(f"haploop.plant.chain.{name}" for name in ("history", "chain", "tables", "sensed_acceleration"))
_EXACT = tuple(f"haploop.plant.chain.{name}" for name in ("motion", "transition"))
_CHAIN = (*_EXACT, *_HISTORY)
_EXACT_RUBBING = tuple(f"haploop.plant.friction.{name}" for name in ("motion", "substeps"))
_RUBBING = (*_EXACT_RUBBING, "haploop.plant.friction.stick_slip")
# And where another integrator than the exact flow moves them, with friction or without.
_METHODS = "haploop.plant.integrators"
_STEPWISE = (*(f"{_METHODS}.{name}" for name in ("stepwise", "one_step", "linear_rates")), *_HISTORY)
_STEPWISE_RUBBING = tuple(f"{_METHODS}.{name}" for name in ("stepwise_friction", "friction_projection"))
_DOP853_RUBBING = (f"{_METHODS}.dop853_friction",)
_DRAWN = ("haploop.plant.random.streams",)
_NOISY = ("haploop.plant.sensing.band_limited_noise", *_DRAWN)
_COUNTED = ("haploop.plant.counters",)
_LINE = ("haploop.plant.line.lossy", *_DRAWN, *_COUNTED, *_CHAIN)

Stage = Literal["motion", "measurement", "estimate", "line", "actuation"]


@dataclass(frozen=True)
class Effect:
    """One row of the table.

    Attributes:
        key: dotted key of the scene that names it.
        node: the process it acts in.
        modules: what it imports beside the node's own core; the first is where it is written.
        stage: when it acts: in the motion, at every plant step; in the measurement, the estimate, on the line to the
            device or in the actuation, once a tick.
        does: what it does, in one phrase.
        value: what must stand at the key; None where being there is enough.
        columns: what it adds to the log's ``/plant``.
        counts: what it adds to the summary, as entry and key.
        states: numbers it remembers from tick to tick or step to step: a count, or what counts them in a scene.
    """

    key: str
    node: Literal["plant", "controller"]
    modules: tuple[str, ...]
    stage: Stage
    does: str
    value: str | None = None
    columns: tuple[str, ...] = ()
    counts: tuple[str, ...] = ()
    states: int | Callable[[dict[str, Any]], int] = 0

    @property
    def name(self) -> str:
        """The key, with the value where several may stand there."""
        return f"{self.key} = {self.value}" if self.value else self.key

    @property
    def acts(self) -> str:
        """How often: "every plant step" or "every tick"."""
        return "every plant step" if self.stage == "motion" else "every tick"

    def modules_in(self, scene: dict[str, Any]) -> tuple[str, ...]:
        """What it imports in a scene: an integrator has its own in place of what moves bodies exactly."""
        integrator = at(scene, "clock.integrator") or "exact"
        if integrator == "exact":
            return self.modules
        rubbing = _DOP853_RUBBING if integrator == "dop853" else _STEPWISE_RUBBING
        kept = tuple(module for module in self.modules if module not in (*_EXACT, *_EXACT_RUBBING))
        return kept + (rubbing if self.key == "friction" else ())

    def is_named(self, scene: dict[str, Any]) -> bool:
        """Whether a resolved scene names it; a number that is 0 names nothing."""
        found = at(scene, self.key)
        return bool(found) if self.value is None else found == self.value

    def states_in(self, scene: dict[str, Any]) -> int:
        """How many states it adds to a scene that names it."""
        return self.states if isinstance(self.states, int) else self.states(scene)


def at(scene: dict[str, Any], key: str) -> Any:
    """What stands at a dotted key of a scene; None where nothing does."""
    found: Any = scene
    for part in key.split("."):
        found = found.get(part) if isinstance(found, dict) else None
    return found


def _controller(module: str) -> tuple[str, ...]:
    return (f"haploop.controller.{module}",)


def _plant(module: str, *others: str) -> tuple[str, ...]:
    return f"haploop.plant.{module}", *others


def _integrator(name: str, does: str, *modules: str) -> Effect:
    """A method of ``clock.integrator``, written in a module of its own."""
    own = f"{_METHODS}.{name.replace('-', '_')}"
    return Effect("clock.integrator", "plant", (own, *modules), "motion", f"every step is {does}", value=name)


def _noise_memory(scene: dict[str, Any]) -> int:
    """An accelerometer's noise is correlated where its bandwidth is limited."""
    table = scene["accelerometer"]
    return int(bool(table["noise_density"]) and "bandwidth" in table)


# In the order in which they act within their stage.
EFFECTS: tuple[Effect, ...] = (
    _integrator("euler", "one of the explicit Euler method, order 1", *_STEPWISE),
    _integrator("semi-implicit-euler", "one of the semi-implicit Euler method, order 1", *_STEPWISE),
    _integrator("rk4", "one of the classical Runge-Kutta method, order 4", *_STEPWISE),
    _integrator("implicit-midpoint", "one of the implicit midpoint rule, order 2", *_STEPWISE),
    _integrator("dop853", "made of DOP853's own steps, order 8, from event to event", *_HISTORY),
    Effect(
        "transmission",
        "plant",
        _CHAIN,
        "motion",
        "a cable lets the tip lag behind the motor",
        columns=("tip_x", "tip_v"),
        states=2,
    ),
    Effect(
        "hand.grip",
        "plant",
        _CHAIN,
        "motion",
        "a grip lets the hand's mass lag behind the tip",
        columns=("hand_x", "hand_v"),
        states=2,
    ),
    Effect(
        "actuator.bandwidth",
        "plant",
        _CHAIN,
        "motion",
        "the force follows the command with a lag",
        columns=("actuator",),
        states=1,
    ),
    Effect(
        "friction",
        "plant",
        ("haploop.plant.friction.law", *_RUBBING, *_CHAIN),
        "motion",
        "dry friction brakes what slips and holds what has stopped",
        columns=("friction",),
    ),
    Effect(
        "accelerometer.bandwidth", "plant", _CHAIN, "motion", "the accelerometer feels through a low-pass", states=1
    ),
    Effect(
        "accelerometer.delay",
        "plant",
        _CHAIN,
        "measurement",
        "the accelerometer tells what it felt earlier",
        states=lambda scene: round(scene["accelerometer"]["delay"] * scene["clock"]["plant_rate"]),
    ),
    Effect(
        "noise", "plant", _plant("sensing.noise", *_NOISY), "measurement", "noise is added to the position", states=1
    ),
    Effect("encoder", "plant", (), "measurement", "the position is rounded to whole counts"),
    Effect(
        "accelerometer",
        "plant",
        _plant("sensing.accelerometer", *_NOISY, *_COUNTED),
        "measurement",
        "bias, noise and resolution make the reading of the acceleration",
        states=_noise_memory,
    ),
    Effect(
        "accelerometer.range",
        "plant",
        _plant("sensing.accelerometer", *_NOISY, *_COUNTED),
        "measurement",
        "the reading is cut off beyond the range",
        counts=("accelerometer.clipped_ticks",),
    ),
    Effect(
        "velocity.estimator",
        "controller",
        _controller("estimators.window"),
        "estimate",
        "v is a difference over a window",
        value="window",
        states=lambda scene: scene["velocity"]["ticks"],
    ),
    Effect(
        "velocity.estimator",
        "controller",
        _controller("estimators.foaw"),
        "estimate",
        "v is the slope over the longest window that fits",
        value="foaw",
        states=lambda scene: scene["velocity"]["ticks"],
    ),
    Effect(
        "velocity.estimator",
        "controller",
        _controller("estimators.kalman"),
        "estimate",
        "v is that of a Kalman filter of position, velocity and acceleration",
        value="kalman",
        states=3,
    ),
    Effect("velocity.cutoff", "controller", (), "estimate", "v is low-passed", states=1),
    Effect("acceleration.source", "controller", (), "estimate", "a is read, not estimated", value="accelerometer"),
    Effect("acceleration.source", "controller", (), "estimate", "a is that of the Kalman filter", value="kalman"),
    Effect(
        "acceleration.estimator",
        "controller",
        _controller("estimators.window"),
        "estimate",
        "a is a difference of v over a window",
        value="window",
        states=lambda scene: scene["acceleration"]["ticks"],
    ),
    Effect(
        "acceleration.estimator",
        "controller",
        _controller("estimators.foaw"),
        "estimate",
        "a is the slope of v over the longest window that fits",
        value="foaw",
        states=lambda scene: scene["acceleration"]["ticks"],
    ),
    Effect("acceleration.cutoff", "controller", (), "estimate", "a is low-passed", states=1),
    Effect(
        "jitter",
        "plant",
        _plant("line.jitter", *_LINE),
        "line",
        "each command is delayed by a random number of plant steps; one overtaken is dropped",
        counts=("lost.commands_dropped", "lost.commands_lost"),
    ),
    Effect(
        "loss",
        "plant",
        _plant("line.loss", *_LINE),
        "line",
        "commands are lost at random; the device holds the last one",
        counts=("lost.commands_dropped", "lost.commands_lost"),
    ),
    Effect(
        "actuator.resolution",
        "plant",
        _plant("line.actuator", *_COUNTED),
        "actuation",
        "the force is rounded to whole steps",
    ),
    Effect(
        "actuator.saturation",
        "plant",
        _plant("line.actuator", *_COUNTED),
        "actuation",
        "the force is cut off beyond what the motor gives",
        counts=("actuator.saturated_commands",),
    ),
)
