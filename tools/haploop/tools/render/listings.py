"""Tables on the terminal that list what there is: live runs and their state, what comes with haploop, element kinds."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

from haploop.protocol.amounts import amount
from haploop.tools.render.report import lateness_rows, program_rows
from haploop.tools.render.terminal import make_table, seen, verdict_style

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rich.console import RenderableType
    from rich.table import Table

    from haploop.controller.dissipation import Element
    from haploop.protocol.quantity import Quantity
    from haploop.protocol.transport.wire import Message


def status_table(data: Message) -> RenderableType:
    """Makes the report of a live run: progress, verdict so far, and the lag of every node."""
    from rich.console import Group
    from rich.text import Text

    rate, pace = data["control_rate"], data.get("pace", "free")
    unpaced = {"free": "as fast as it goes", "plant": "by the plant's own time"}
    at_pace = unpaced[pace] if isinstance(pace, str) else f"at pace {pace:g}"
    state = ("paused", "bold yellow") if data["paused"] else ("running", "bold green")
    where = f"  {data['tick'] / rate:g} s of {data['end'] / rate:g} s, tick {data['tick']} of {data['end']}, {at_pace}"
    head = Text.assemble((data.get("run", ""), "bold"), "  " if data.get("run") else "", data["title"])
    parts: list[RenderableType] = [head, Text.assemble(state, where)]
    if status := data.get("status"):
        word = "settling" if status["verdict"] == "undecided" else seen(status["verdict"])
        when = "" if word == "settling" else " in its last half second"
        looks = f"{when}, oscillation {amount(status['oscillation_m'], 'm')} peak to peak"
        parts.append(Text.assemble((word, verdict_style(word)), looks))
    parts += [Text(f"{words} {late}") for words, late in lateness_rows(data)]
    parts += [Text(reason, "yellow") for reason in data.get("refused", {}).values()]
    parts += [Text(f"{words}: {what}") for words, what in program_rows(data)]
    return Group(*parts, _nodes(data["nodes"], rate))


def _nodes(nodes: list[Message], control_rate: float) -> Table:
    from rich.text import Text

    numbers = ("pid", "tick", "behind", "skipped")
    table = make_table("node", *numbers[:3], "waits for", "skipped", numbers=numbers, unbroken=("node",))
    for node in nodes:
        behind, skipped = node["behind_ticks"], node.get("skipped_ticks", 0)
        ticks = f"{behind} tick{'s' * (behind != 1)}"
        lag = f"{ticks}, {amount(behind / control_rate, 's')}" if behind else "–"
        skips = "–" if node.get("lossless", True) else Text(f"{skipped} ticks", "yellow" if skipped else "")
        table.add_row(Text(node["role"]), str(node["pid"]), str(node["tick"]), lag, node["waits_for"] or "–", skips)
    return table


def bundled_table(listed: Mapping[str, Mapping[str, str]]) -> Table:
    """Makes the table of what comes with haploop: folder, name, and what it is."""
    table = make_table("", "name", "what it is", unbroken=("", "name"))
    for folder, files in listed.items():
        for number, (name, about) in enumerate(files.items()):
            table.add_row("" if number else folder, name, about)
        table.add_section()
    return table


def plugins_table(kinds: Mapping[str, type[Element]]) -> Table:
    """Makes the table of element kinds: purpose, parameters with unit, bounds and default."""
    from rich.text import Text

    table = make_table("kind", "what it does", "parameters", unbroken=("kind",))
    for kind, element in kinds.items():
        about = (element.__doc__ or "").strip().partition("\n")[0]
        about = "" if about.startswith(f"{element.__name__}(") else about  # the docstring that a dataclass generates
        lines = [_parameter(name, *declared) for name, declared in element.parameters().items()]
        # As text: a formula's v[k] is no markup.
        table.add_row(kind, Text(about), Text("\n".join(lines) or "–"))
        table.add_section()
    return table


def _parameter(name: str, quantity: Quantity, default: Any) -> str:
    words = [f"{name} ({quantity.unit})" if quantity.unit else name]
    words += [" or ".join(map(quantity.text, quantity.choices))] if quantity.choices else []
    for bound in ("at_least", "above", "at_most", "below"):
        value = getattr(quantity, bound)
        words += [f"{bound.replace('_', ' ')} {value:g}"] if value is not None else []
    if default is not dataclasses.MISSING:
        words.append(f"default {quantity.text(default) if quantity.choices else format(default, 'g')}")
    return ", ".join(words)
