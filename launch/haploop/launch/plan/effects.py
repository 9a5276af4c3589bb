"""The single table of effects: all that a scene may name besides device, hand, wall and elements.

An effect that is not named is absent: its modules are not imported and no instruction is spent on it.
"""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from haploop.controller.estimators.base import Estimator
from haploop.controller.estimators.choose import estimator_class, estimators_for
from haploop.launch.plan import rules
from haploop.launch.plan.effect import CHAIN, COUNTED, HISTORY, LINE, LINEAR_RATES, NOISY, RUBBING, Effect
from haploop.launch.plan.meant.notes import note_unmeant
from haploop.launch.plan.meant.rule import Note
from haploop.plant.integrators.registry import find_integrator, integrator_module, integrator_names
from haploop.protocol.installed import brought, cached_until_brought, entry_points_of, loaded
from haploop.protocol.scene.effects import Accelerometer
from haploop.protocol.scene.estimators import Acceleration, Velocity
from haploop.protocol.scene.paths import value_at, without
from haploop.protocol.scene.scene import Scene, accelerometer_is_used
from haploop.protocol.ticks import Timebase
from haploop.protocol.trees import tree_leaves

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element

# Other packages name theirs in this group of entry points.
_GROUP = "haploop.effects"


def _plant(module: str, *others: str) -> tuple[str, ...]:
    return f"haploop.plant.{module}", *others


def _integrators() -> Iterator[Effect]:
    """Makes the effects of all methods of ``clock.integrator`` except the exact transition."""
    for name in integrator_names():
        if name != "exact":
            method = find_integrator(name)
            modules = (integrator_module(name), method.motions[0].partition(":")[0])
            yield Effect(
                "clock.integrator",
                "plant",
                (*dict.fromkeys(modules), *LINEAR_RATES * (method.method is not None), *HISTORY),
                "motion",
                f"every step is {method.does}",
                value=name,
                # The map of a fixed-step method is not that of the loop; the map of an exact method is.
                linear=method.is_exact,
                batches=False,
                note=rules.note_growth,
                frees={} if method.is_exact else {"integration error": rules.exactly},
            )


def _estimators(of: str, names: Container[str] | None = None) -> Iterator[Effect]:
    """Makes the effects of the estimators that a table may name, except the backward difference."""
    for name, kind in estimators_for(of).items():
        if name in names if names is not None else name != "difference":
            yield Effect(
                f"{of}.estimator",
                "controller",
                (kind.__module__,),
                "estimate",
                f"{of[0]} is {kind.does}",
                value=name,
                states=partial(_memory_of, of),
                linear=kind.linear,
                takes_out=partial(_without_estimator, of),
            )


def _memory_of(of: str, scene: Scene) -> int:
    """Counts the numbers that an estimator remembers; counts of ticks are not among them."""
    named = scene.estimate(of).estimator or "difference"
    estimator = estimator_class(named).from_scene(scene, of, Timebase.from_scene(scene).period_s)
    return sum(isinstance(leaf, float) for leaf in tree_leaves(estimator.start(0.0, (0.0, 0.0))))


def _without_estimator(of: str, scene: Scene) -> Scene:
    if of == "velocity":
        scene = replace(scene, velocity=Velocity(cutoff=scene.estimate(of).cutoff))
    elif table := scene.acceleration:
        scene = replace(scene, acceleration=Acceleration(source=table.source, cutoff=table.cutoff))
    from_kalman = value_at(scene, "acceleration.source") == "kalman"
    return without(scene, *["acceleration.source"] * from_kalman)


def _noise_memory(scene: Scene) -> int:
    """Counts the memory of an accelerometer's noise, which is correlated where its bandwidth is limited."""
    table = scene.accelerometer or Accelerometer()
    return int(bool(table.noise_density) and table.bandwidth is not None)


def _delay_memory(scene: Scene) -> int:
    table = scene.accelerometer or Accelerometer()
    return round(table.delay * scene.clock.plant_rate)


def _goes_by_whole_steps(scene: Scene) -> bool:
    from haploop.plant.friction.substeps import goes_by_whole_steps

    return goes_by_whole_steps(scene)


_LINE_COUNTS = ("lost.commands_dropped", "lost.commands_lost")
_LIMITED = {"actuator limits": rules.left_out("actuator")}
_OF_ACCELEROMETER = _plant("sensing.accelerometer", *NOISY, *COUNTED)

# In the order in which they act within their stage.
EFFECTS: tuple[Effect, ...] = (
    *_integrators(),
    Effect("transmission", "plant", CHAIN, "motion", "a cable lets the tip lag behind the motor",
           columns=("tip_x", "tip_v"), states=2, frees={"structural mode": rules.rigid},
           scaled_with={"device mass": "transmission.motor_mass", "device damping": "transmission.motor_damping"}),
    Effect("hand.grip", "plant", CHAIN, "motion", "a grip lets the hand's mass lag behind the tip",
           columns=("hand_x", "hand_v"), states=2, check=rules.check_grip,
           scaled_with={"hand damping": "hand.grip.damping", "hand stiffness": "hand.grip.stiffness"}),
    Effect("actuator.bandwidth", "plant", CHAIN, "motion", "the force follows the command with a lag",
           columns=("actuator",), states=1, check=rules.check_actuator, frees=_LIMITED),
    Effect("friction", "plant", ("haploop.plant.friction.stick_slip", *RUBBING, *CHAIN), "motion",
           "dry friction brakes what slips and holds what has stopped", columns=("friction",), linear=False,
           batches=_goes_by_whole_steps, check=rules.check_friction, frees={"friction": rules.frictionless},
           scaled_with={"friction": "friction.breakaway"}),
    Effect("accelerometer.bandwidth", "plant", CHAIN, "motion", "the accelerometer measures through a low-pass",
           states=1, used=accelerometer_is_used),
    Effect("accelerometer.delay", "plant", CHAIN, "measurement", "the accelerometer gives what it measured earlier",
           states=_delay_memory, used=accelerometer_is_used),
    Effect("noise", "plant", NOISY, "measurement", "noise is added to the position", states=1, left_out=("noise",),
           frees={"noise": rules.left_out("noise")}),
    Effect("encoder", "plant", (), "measurement", "the position is rounded to whole counts", left_out=("encoder",),
           frees={"quantisation": rules.unrounded}),
    Effect("accelerometer", "plant", _OF_ACCELEROMETER, "measurement",
           "bias, noise and resolution change the reading of the acceleration", states=_noise_memory,
           left_out=("accelerometer.bias", "accelerometer.noise_density", "accelerometer.resolution"),
           used=accelerometer_is_used, check=rules.check_accelerometer, note=rules.note_accelerometer,
           frees={"noise": rules.noiseless}),
    Effect("accelerometer.range", "plant", _OF_ACCELEROMETER, "measurement",
           "the reading is cut off beyond the range", counts=("accelerometer.clipped_ticks",),
           left_out=("accelerometer.range",), used=accelerometer_is_used),
    *_estimators("velocity"),
    Effect("velocity.cutoff", "controller", (), "estimate", "v is low-passed", states=1),
    Effect("acceleration.source", "controller", (), "estimate", "a is read, not estimated", value="accelerometer"),
    Effect("acceleration.source", "controller", (), "estimate", "a comes from the Kalman filter", value="kalman"),
    *_estimators("acceleration"),
    Effect("acceleration.cutoff", "controller", (), "estimate", "a is low-passed", states=1),
    Effect("jitter", "plant", LINE, "line",
           "each command is delayed by a random number of plant steps; one overtaken is dropped",
           counts=_LINE_COUNTS, linear=False, batches=False, check=rules.check_jitter,
           frees={"jitter and loss": rules.left_out("jitter")}),
    Effect("loss", "plant", LINE, "line", "commands are lost at random; the device holds the last one",
           counts=_LINE_COUNTS, linear=False, batches=False, frees={"jitter and loss": rules.left_out("loss")}),
    Effect("actuator.resolution", "plant", _plant("line.actuator", *COUNTED), "actuation",
           "the force is rounded to whole steps", left_out=("actuator.resolution",), frees=_LIMITED),
    Effect("actuator.saturation", "plant", _plant("line.actuator", *COUNTED), "actuation",
           "the force is cut off at the largest that the motor gives", counts=("actuator.saturated_commands",),
           left_out=("actuator.saturation",), frees=_LIMITED),
)  # fmt: skip


@cached_until_brought
def all_effects() -> tuple[Effect, ...]:
    """Returns the effects of the table and, after them, those of other packages and of plugin files."""
    of_files = [effect for of in ("velocity", "acceleration") for effect in _estimators(of, brought(Estimator.group))]
    return *EFFECTS, *of_files, *(loaded(entry) for entry in entry_points_of(_GROUP))


@cached_until_brought
def alone_perhaps() -> tuple[Effect, ...]:
    """Returns the effects with which a scene cannot always be one of many that run as one."""
    return tuple(effect for effect in all_effects() if effect.batches is not True or effect.table)


def effects_of(scene: Scene) -> tuple[Effect, ...]:
    """Returns the effects that a resolved scene simulates."""
    return tuple(effect for effect in all_effects() if effect.is_in(scene))


def notes(scene: Scene, kinds: Mapping[str, type[Element]] | None = None) -> list[Note]:
    """Returns notes on what is valid in a resolved scene, but may not have been meant; one sentence each.

    ``kinds`` are those of its elements; without them nothing is said about the elements.
    """
    of_effects = [
        Note(note, effect.key) for effect in all_effects() if effect.is_named(scene) for note in effect.note(scene)
    ]
    return (
        note_unmeant(scene) + of_effects + [Note(note, "dissipation") for note in rules.note_order(scene, kinds or {})]
    )
