"""The plan of a resolved scene: bodies, states, the steps of a tick and of a plant step, effects named and absent."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from haploop.controller.tick import MOTION_COLUMNS
from haploop.launch.plan.effect import Effect, Stage
from haploop.launch.plan.effects import all_effects, effects_of
from haploop.plant.chain.chain import Chain
from haploop.plant.choose import needs_chain
from haploop.plant.integrators.registry import find_integrator
from haploop.protocol.scene.paths import value_at
from haploop.protocol.scene.scene import Scene
from haploop.protocol.scene.table import Table
from haploop.protocol.ticks import Timebase


@dataclass(frozen=True)
class Step:
    """One thing that happens; ``effect`` names the effect that brings it, "" for what every scene has."""

    node: str
    what: str
    effect: str = ""


@dataclass(frozen=True)
class Plan:
    """What a scene comes to.

    Attributes:
        bodies: name -> mass in kg, from the actuator to the hand.
        states: what is integrated from plant step to plant step.
        memory: how many numbers effects remember besides the states, from tick to tick, by the effect's name.
        modules: node -> what its effects import besides its core.
        columns: channel of the log -> its columns, time stamps aside.
    """

    bodies: dict[str, float]
    states: tuple[str, ...]
    memory: dict[str, int]
    plant_step: tuple[Step, ...]
    tick: tuple[Step, ...]
    modules: dict[str, tuple[str, ...]]
    columns: dict[str, tuple[str, ...]]
    counts: tuple[str, ...]
    named: tuple[Effect, ...]
    absent: tuple[Effect, ...]


def plan(scene: Scene) -> Plan:
    named = effects_of(scene)
    chain = Chain.from_scene(scene)
    # The states of effects in the motion are integrated instead.
    remembered = {effect.name: effect.states_in(scene) for effect in named if effect.stage != "motion"}
    elements = (f"dissipation.{index}" for index in range(len(scene.dissipation)))
    return Plan(
        bodies=dict(zip(chain.bodies, chain.masses_kg, strict=True)),
        states=chain.states,
        memory={name: count for name, count in remembered.items() if count},
        plant_step=_plant_step(chain, named, scene),
        tick=_tick(scene, chain, named),
        modules={
            node: _once(module for effect in named if effect.node == node for module in effect.modules_in(scene))
            for node in ("plant", "controller")
        },
        columns={
            "/plant": ("x", "v", "force", *_once(column for effect in named for column in effect.columns)),
            "/controller": (*MOTION_COLUMNS, *elements, "total", "in_contact"),
        },
        counts=_once(count for effect in named for count in effect.counts),
        named=named,
        absent=tuple(effect for effect in all_effects() if effect not in named),
    )


def multiplications(scene: Scene) -> int:
    """Counts multiplications that move the bodies through one tick: each state by each state, command and friction.

    One mass is moved once per hold and filled in at the plant steps; a chain of bodies is moved to every plant step.
    The classical Runge-Kutta method moves them four times; for DOP853, twelve times per tick are counted, the least
    that there is.
    """
    time, size = Timebase.from_scene(scene), len(Chain.from_scene(scene).states)
    if needs_chain(scene):
        method = find_integrator(scene.clock.integrator)
        moves = method.evaluations * (1 if method.chooses_steps else time.steps_per_tick)
        return moves * size * (size + 2)
    return (time.steps_per_tick + (2 if time.delay_steps % time.steps_per_tick else 1)) * size * (size + 1)


def _plant_step(chain: Chain, named: tuple[Effect, ...], scene: Scene) -> tuple[Step, ...]:
    bodies = " - ".join(chain.bodies)
    method = "exact flow" if scene.clock.integrator == "exact" else scene.clock.integrator
    what = f"{method} of {len(chain.states)} states ({bodies}), the command held, the force of the hand linear"
    return Step("plant", what), *_stage("motion", named, scene)


def _tick(scene: Scene, chain: Chain, named: tuple[Effect, ...]) -> tuple[Step, ...]:
    late = f"{Timebase.from_scene(scene).delay_steps} plant steps"
    return (
        Step("plant", f"the position of the {chain.bodies[0]} is sampled"),
        *_stage("measurement", named, scene),
        *_estimates(scene, named),
        *_forces(scene),
        Step("controller", "their sum is the command"),
        *_stage("line", named, scene),
        Step("plant", f"the command takes effect {late} after its sample and is held until the next does"),
        *_stage("actuation", named, scene),
    )


def _estimates(scene: Scene, named: tuple[Effect, ...]) -> Iterable[Step]:
    """Yields a backward difference where no effect stands in its place, then its low-pass."""
    for table, letter, of in (("velocity", "v", "the position"), ("acceleration", "a", "v")):
        effects = [e for e in named if e.stage == "estimate" and e.key.startswith(f"{table}.")]
        if all(effect.key.endswith(".cutoff") for effect in effects):
            yield Step("controller", f"{letter} is the backward difference of {of}")
        yield from _stage("estimate", effects, scene)


def _forces(scene: Scene) -> Iterable[Step]:
    if wall := scene.wall:
        sign = "<" if wall.occupies == "below" else ">"
        named = f"{wall.kind}{_values(wall.others)}, " if wall.kind else ""
        yield Step("controller", f"wall: {named}{wall.stiffness:g} N/m where x {sign} {wall.position:g} m")
    for table in scene.dissipation:
        yield Step("controller", f"{table.name}{_values(table)}, {table.acts}")


def _stage(stage: Stage, named: Iterable[Effect], scene: Scene) -> tuple[Step, ...]:
    """Returns what the named effects of a stage do, with their values."""
    return tuple(
        Step(effect.node, effect.does + _values(value_at(scene, effect.key), effect.key), effect.name)
        for effect in named
        if effect.stage == stage
    )


def _values(found: Any, key: str = "") -> str:
    """Returns the numbers of an effect, or of an element, in parentheses."""
    name = key.rpartition(".")[2]
    table = found.as_dict() if isinstance(found, Table) else found if isinstance(found, dict) else {name: found}
    words = [f"{k} = {v:g}" for k, v in table.items() if isinstance(v, (int, float)) and not isinstance(v, bool)]
    return f" ({', '.join(words)})" if words else ""


def _once(entries: Iterable[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(entries))
