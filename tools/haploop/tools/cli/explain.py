"""``haploop explain``: a loop's limits, the effect of one count, the order of its steps, the cost of every effect."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Annotated, Any

import typer

from haploop.protocol.amounts import amount, fixed
from haploop.tools.command.given import kinds_with, print_notes
from haploop.tools.command.options import Json, Plugin, SceneFile, Set, plain_errors, print_json
from haploop.tools.render.terminal import make_facts, make_table
from haploop.tools.render.units import parameters, spring

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rich.console import RenderableType
    from rich.table import Table

    from haploop.controller.dissipation import Element
    from haploop.launch.plan.plan import Plan, Step
    from haploop.protocol.scene.scene import Scene
    from haploop.tools.linear.terms import Limit, OneCount
    from haploop.tools.operations import Bill

# From so many times a limit on, its share is told in times.
_TIMES = 10.0
_READING = (
    "A call into NumPy counts as one instruction. An entry's instructions are those that the loop would save "
    "without that entry alone; they are negative where something more expensive takes its place."
)
_OF_LIMITS = (
    "A limit applies to the loop of its formula: passive with any passive hand, or stable for small swings in lasting "
    "contact; haploop judge says what a run does."
)


def explain(
    scene: SceneFile,
    set: Set = None,
    plugin: Plugin = None,
    cost: Annotated[bool, typer.Option("--cost", help="also modules, columns and instructions of each effect")] = False,
    json: Json = False,
) -> None:
    """Show a loop's limits, its counts, and the order of its steps."""
    from haploop.launch.plan.plan import plan
    from haploop.launch.scene.events import elements_of, try_out
    from haploop.launch.scene.file import load
    from haploop.tools.operations import bill
    from haploop.tools.render.terminal import console

    with plain_errors():
        kinds = kinds_with(plugin or [])
        resolved = load(scene, set or [], kinds)
        try_out(elements_of(resolved), kinds)
        notes = print_notes(resolved, kinds, scene, set or [])
        planned = plan(resolved)
        costs = bill(resolved, planned.named, kinds) if cost else None
    if json:
        print_json(as_data(resolved, planned, costs, kinds) | {"notes": notes})
    else:
        console().print(explanation(resolved, planned, costs, kinds))


def as_data(scene: Scene, planned: Plan, costs: Bill | None, kinds: Mapping[str, type[Element]]) -> dict[str, Any]:
    """Returns terms, limits and plan of a scene, and its costs if they were counted, as one JSON object."""
    from haploop.tools.linear.terms import limits_of, modes, one_count

    counted = one_count(scene, kinds)
    data = {
        "title": scene.title,
        "period_s": 1.0 / scene.clock.control_rate,
        "delay_s": scene.clock.round_trip_delay,
        "modes": [dataclasses.asdict(mode) for mode in modes(scene)],
        "limits": [dataclasses.asdict(limit) for limit in limits_of(scene, kinds)],
        "one_count": dataclasses.asdict(counted) if counted else None,
        "bodies_kg": planned.bodies,
        **{name: getattr(planned, name) for name in ("states", "memory", "modules", "columns", "counts")},
        "plant_step": [dataclasses.asdict(step) for step in planned.plant_step],
        "tick": [dataclasses.asdict(step) for step in planned.tick],
        "effects": [
            {
                **{name: getattr(effect, name) for name in ("name", "node", "acts", "does", "columns", "counts")},
                "modules": effect.modules_in(scene),
                "states": effect.states_in(scene),
            }
            for effect in planned.named
        ],
        "elements": [{"kind": element.name} for element in scene.dissipation],
        "absent": [effect.name for effect in planned.absent],
    }
    if costs:
        whole = costs.whole
        for effect in data["effects"]:
            effect["instructions_per_tick"] = costs.effects[effect["name"]]
            effect["multiplications_per_tick"] = costs.multiplications[1][effect["name"]]
        for element, instructions in zip(data["elements"], costs.elements, strict=True):
            element["instructions_per_tick"] = instructions
        each = {"plant": whole.plant / whole.ticks, "controller": whole.controller / whole.ticks}
        data |= {"instructions_per_tick": each, "multiplications_per_tick": costs.multiplications[0]}
    return data


def explanation(scene: Scene, planned: Plan, costs: Bill | None, kinds: Mapping[str, type[Element]]) -> RenderableType:
    """Returns the same as tables for the terminal."""
    from rich.console import Group
    from rich.text import Text

    from haploop.tools.linear.terms import limits_of, one_count

    parts = [
        Text(scene.title, style="bold"),
        _terms(scene, planned),
        _limits(scene, limits_of(scene, kinds)),
        Text(_OF_LIMITS, "dim"),
        *([_count(scene, counted)] if (counted := one_count(scene, kinds)) else []),
        _order("in every plant step", planned.plant_step),
        _order("in every tick", planned.tick),
    ]
    if costs:
        whole, moving = costs.whole, costs.multiplications[0]
        loop = f"plant {whole.plant / whole.ticks:.0f}, controller {whole.controller / whole.ticks:.0f}"
        reading = f"Per tick: {moving} multiplications move the bodies; bytecode instructions: {loop}. {_READING}"
        parts += [_inside(planned), _costs(scene, planned, costs), Text(reading, "dim")]
    return Group(*parts)


def _terms(scene: Scene, planned: Plan) -> Table:
    """Makes the table of the loop: T, masses, dampers, springs, natural frequencies, and 2 b / T and 2 f_c / q."""
    from haploop.plant.chain.chain import Chain
    from haploop.protocol.walls.registry import make_wall
    from haploop.tools.linear.terms import modes

    chain, rate = Chain.from_scene(scene), scene.clock.control_rate
    period_s, delay_s = 1.0 / rate, scene.clock.round_trip_delay
    ticks = delay_s * rate
    dampers = [f"{name} {fixed(damping)}" for name, (_, damping) in chain.grounded.items()]
    springs = [f"{link.name} {spring(link.stiffness)}" for link in chain.links]
    springs += [f"hand {spring(chain.spring[0])}"] if chain.spring[0] else []
    swings = [f"{amount(mode.frequency_Hz, 'Hz')} (damping ratio {fixed(mode.damping_ratio)})" for mode in modes(scene)]
    changes = "" if make_wall(scene.wall).stiffness_and_damping() else ", changes with the depth"
    own_N_s_m = next(damping for body, damping in chain.grounded.values() if body == 0)
    facts = {
        "period T, delay": f"{amount(period_s, 's')}, {amount(delay_s, 's')} ({ticks:g} tick{'s' * (ticks != 1)})",
        "masses m": ", ".join(
            f"{_moving(scene, name)} {amount(mass * 1e3, 'g')}" for name, mass in planned.bodies.items()
        ),
        "dampers b": f"{', '.join(dampers)} N s/m",
        "springs": ", ".join(springs) or "none",
        "wall K": spring(scene.wall.stiffness) + changes if scene.wall else "none",
        "natural frequency": ", ".join(swings) or ("changes with the depth" if changes else "none: nothing swings"),
        "2 b / T": f"{spring(2.0 * own_N_s_m / period_s)}, b of the {chain.bodies[0]} alone",
    }
    if scene.friction and scene.encoder:
        facts["2 f_c / q"] = spring(2.0 * scene.friction.kinetic / scene.encoder.resolution)
    facts["states"] = f"{len(planned.states)}: {', '.join(planned.states)}"
    return make_facts(facts.items())


def _moving(scene: Scene, body: str) -> str:
    """Returns what moves as a body: a hand without a grip moves with the last one."""
    with_hand = scene.hand and scene.hand.mass and not scene.hand.grip and body in ("device", "tip")
    return f"{body} and hand" if with_hand else body


def _limits(scene: Scene, limits: list[Limit]) -> RenderableType:
    """Makes a table of the limits that apply to the loop, and a sentence for each reason why others do not."""
    from rich.console import Group
    from rich.text import Text

    table = make_table("limit of K by", "for", "K", "the wall here", numbers=("K",), unbroken=("for",))
    silent: dict[str, list[str]] = {}
    for limit in limits:
        if limit.stiffness_N_m is None:
            silent.setdefault(limit.why_not, []).append(limit.name)
            continue
        here = scene.wall.stiffness if scene.wall else 0.0
        times = here / limit.stiffness_N_m if here and limit.stiffness_N_m else 0.0
        share = (f"{fixed(times)} times it" if times >= _TIMES else f"{fixed(100.0 * times)} % of it") if times else ""
        table.add_row(
            limit.name, limit.kind, spring(limit.stiffness_N_m), Text("; ".join(filter(None, [share, limit.why_not])))
        )
    why = [Text(f"No limit by {' or '.join(map(_quoted, names))}: {reason}", "dim") for reason, names in silent.items()]
    return Group(*([table] if table.row_count else []), *why)


def _quoted(name: str) -> str:
    return f'"{name}"'


def _count(scene: Scene, count: OneCount) -> Table:
    from haploop.protocol.walls.registry import make_wall
    from haploop.tools.linear.terms import DEEP_COUNTS

    table = make_table("effect of one encoder count, in the wall and from rest", "at most", numbers=("at most",))
    table.add_row("position", amount(count.x_m, "m"))
    table.add_row("velocity, as estimated", amount(count.v_m_s, "m/s"))
    if not (scene.acceleration and scene.acceleration.source == "accelerometer"):
        table.add_row("acceleration, as estimated", amount(count.a_m_s2, "m/s²"))
    if scene.wall:
        deep = "" if make_wall(scene.wall).stiffness_and_damping() else f", {amount(DEEP_COUNTS * count.x_m, 'm')} deep"
        table.add_row(f"force of the wall{deep}", amount(count.wall_N, "N"))
    for element, force_N in zip(scene.dissipation, count.elements_N, strict=True):
        values = parameters(element.as_dict())
        table.add_row(f"force of {element.name}{f' ({values})' if values else ''}", amount(force_N, "N"))
    return table


def _order(title: str, steps: tuple[Step, ...]) -> Table:
    table = make_table(title, "node", "named by")
    for step in steps:
        table.add_row(step.what, step.node, step.effect or "–")
    return table


def _inside(planned: Plan) -> Table:
    remembered = ", ".join(f"{count} by {name}" for name, count in planned.memory.items())
    facts = {"remembered": remembered or "nothing"}
    for node, modules in planned.modules.items():
        facts[f"{node} also loads"] = ", ".join(modules).replace("haploop.", "") or "nothing"
    facts |= {f"log {channel}": ", ".join(columns) for channel, columns in planned.columns.items()}
    facts["counts"] = ", ".join(planned.counts) or "nothing"
    facts["absent"] = ", ".join(effect.name for effect in planned.absent)
    return make_facts(facts.items())


def _costs(scene: Scene, planned: Plan, costs: Bill) -> Table:
    """Makes the table of what each effect and each element adds."""
    numbers = ("states", "multiplications", "instructions")
    table = make_table("effect or element", "written in", "every", *numbers, numbers=numbers)
    for effect in planned.named:
        modules = effect.modules_in(scene)
        module = modules[0].removeprefix("haploop.") if modules else effect.node
        numbers = f"{costs.multiplications[1][effect.name]:+d}", f"{costs.effects[effect.name]:+.0f}"
        table.add_row(effect.name, module, effect.acts.removeprefix("every "), str(effect.states_in(scene)), *numbers)
    for element, cost in zip(scene.dissipation, costs.elements, strict=True):
        table.add_row(element.name, "controller.dissipation", "tick", "–", "–", f"{cost:+.0f}")
    return table
