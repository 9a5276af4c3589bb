"""``haploop explain``: bodies and states of a scene, the order of its steps, and the cost of every effect."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

from haploop.tools.cli.options import Json, Plugin, SceneFile, Set, plain_errors, print_json
from haploop.tools.cli.scenes import kinds_with, print_notes
from haploop.tools.render.terminal import make_facts, make_table

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.table import Table

    from haploop.launch.plan.plan import Plan, Step
    from haploop.protocol.scene.scene import Scene
    from haploop.tools.operations import Bill

_READING = (
    "A call into NumPy counts as one instruction. An entry's are those that the loop would save without it alone; "
    "they are negative where something dearer takes its place."
)


def explain(scene: SceneFile, set: Set = None, plugin: Plugin = None, json: Json = False) -> None:
    """Show what a scene comes to, and what each effect costs."""
    from haploop.launch.plan.plan import plan
    from haploop.launch.scene.events import elements_of, try_out
    from haploop.launch.scene.file import load
    from haploop.tools.operations import bill
    from haploop.tools.render.terminal import console

    with plain_errors():
        kinds = kinds_with(plugin or [])
        resolved = load(scene, set or [], kinds)
        try_out(elements_of(resolved), kinds)
        print_notes(resolved, kinds)
        planned = plan(resolved)
        costs = bill(resolved, planned.named, kinds)
    if json:
        print_json(as_data(resolved, planned, costs))
    else:
        console().print(explanation(resolved, planned, costs))


def as_data(scene: Scene, planned: Plan, costs: Bill) -> dict[str, Any]:
    """Returns the plan and its costs as one JSON object."""
    whole = costs.whole
    return {
        "title": scene.title,
        "bodies_kg": planned.bodies,
        **{name: getattr(planned, name) for name in ("states", "memory", "modules", "columns", "counts")},
        "plant_step": [dataclasses.asdict(step) for step in planned.plant_step],
        "tick": [dataclasses.asdict(step) for step in planned.tick],
        "effects": [
            {
                **{name: getattr(effect, name) for name in ("name", "node", "acts", "does", "columns", "counts")},
                "modules": effect.modules_in(scene),
                "states": effect.states_in(scene),
                "instructions_per_tick": costs.effects[effect.name],
                "multiplications_per_tick": costs.multiplications[1][effect.name],
            }
            for effect in planned.named
        ],
        "elements": [
            {"kind": element.name, "instructions_per_tick": cost}
            for element, cost in zip(scene.dissipation, costs.elements, strict=True)
        ],
        "absent": [effect.name for effect in planned.absent],
        "instructions_per_tick": {"plant": whole.plant / whole.ticks, "controller": whole.controller / whole.ticks},
        "multiplications_per_tick": costs.multiplications[0],
    }


def explanation(scene: Scene, planned: Plan, costs: Bill) -> RenderableType:
    """Returns the plan and its costs as tables for the terminal."""
    from rich.console import Group
    from rich.text import Text

    whole = costs.whole
    moving = costs.multiplications[0]
    loop = f"plant {whole.plant / whole.ticks:.0f}, controller {whole.controller / whole.ticks:.0f}"
    return Group(
        Text(scene.title, style="bold"),
        _facts(planned),
        _order("in every plant step", planned.plant_step),
        _order("in every tick", planned.tick),
        _costs(scene, planned, costs),
        Text(f"Per tick: {moving} multiplications move the bodies; bytecode instructions: {loop}. {_READING}", "dim"),
    )


def _facts(planned: Plan) -> Table:
    facts = {
        "bodies": ", ".join(f"{name} {mass * 1e3:g} g" for name, mass in planned.bodies.items()),
        "states": f"{len(planned.states)}: {', '.join(planned.states)}",
        "remembered": ", ".join(f"{count} by {name}" for name, count in planned.memory.items()) or "nothing",
    }
    for node, modules in planned.modules.items():
        facts[f"{node} also loads"] = ", ".join(modules).replace("haploop.", "") or "nothing"
    facts |= {f"log {channel}": ", ".join(columns) for channel, columns in planned.columns.items()}
    facts["counts"] = ", ".join(planned.counts) or "nothing"
    facts["absent"] = ", ".join(effect.name for effect in planned.absent)
    return make_facts(facts.items())


def _order(title: str, steps: tuple[Step, ...]) -> Table:
    table = make_table(title, "node", "named by")
    for step in steps:
        table.add_row(step.what, step.node, step.effect or "–")
    return table


def _costs(scene: Scene, planned: Plan, costs: Bill) -> Table:
    """Makes the table of what each effect and each element adds."""
    numbers = ("states", "multiplications", "instructions")
    table = make_table("what is named", "written in", "every", *numbers, numbers=numbers)
    for effect in planned.named:
        modules = effect.modules_in(scene)
        module = modules[0].removeprefix("haploop.") if modules else effect.node
        numbers = f"{costs.multiplications[1][effect.name]:+d}", f"{costs.effects[effect.name]:+.0f}"
        table.add_row(effect.name, module, effect.acts.removeprefix("every "), str(effect.states_in(scene)), *numbers)
    for element, cost in zip(scene.dissipation, costs.elements, strict=True):
        table.add_row(element.name, "controller.dissipation", "tick", "–", "–", f"{cost:+.0f}")
    return table
