"""What the terminal shows: the books at the end of a run, the state of live runs, the kinds of element."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

from haploop.tools.render.amounts import amount, fixed, parameters, spring
from haploop.tools.render.plant_words import counts, plant_books
from haploop.tools.render.progress import ProgressLine

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rich.console import Console, RenderableType
    from rich.table import Table

    from haploop.controller.dissipation import Element
    from haploop.protocol.quantity import Quantity

__all__ = [
    "ProgressLine",
    "console",
    "plugins_table",
    "print_summary",
    "status_table",
    "summary_table",
]

VERDICT_STYLES = {"steady": "bold green", "limit-cycle": "bold yellow", "diverged": "bold red", "no-contact": "bold"}
# The causes of a wall's leak, as the summary names them and as people do.
LEAKS = {"sampling_and_hold_J": "sampling and hold", "quantisation_J": "quantisation", "delay_J": "delay"}


def console(stderr: bool = False) -> Console:
    """A terminal, or a pipe: then without colours, and as wide as the lines are."""
    from rich.console import Console

    made = Console(stderr=stderr, highlight=False)
    if not made.is_terminal:
        made.width = 100
    return made


def print_summary(summary: dict[str, Any]) -> None:
    """Show what came of a run, on stderr."""
    console(stderr=True).print(summary_table(summary))


def summary_table(summary: dict[str, Any]) -> RenderableType:
    """Verdict, key numbers and every book of a run, from its summary."""
    from rich.console import Group
    from rich.text import Text

    word = summary["verdict"]
    head = Text.assemble((word, VERDICT_STYLES.get(word, "bold")), "  ", (summary["title"], "bold"))
    parts: list[RenderableType] = [head, Text(_rule_in_short(summary["verdict_rule"]), style="dim")]
    if summary["ended"] not in ("done", "diverged"):
        parts.append(Text(f"ended early: {summary['ended']}", style="bold red"))
    return Group(*parts, _grid(_key_figures(summary)), _books(summary["energy"], _control_rate(summary)))


def _rule_in_short(rule: str) -> str:
    """What was seen, without the limits it was held against."""
    seen = rule.partition("; ")[0].rstrip(".")
    return f"{seen[:1].upper()}{seen[1:]}."


def _control_rate(summary: dict[str, Any]) -> float:
    return summary["ticks"] / summary["duration_s"] if summary["duration_s"] else 1.0


def _key_figures(summary: dict[str, Any]) -> list[tuple[str, str]]:
    window = summary["window"]
    ran = f"{summary['duration_s']:g} s, {summary['ticks']} ticks"
    if summary["wall_s"]:
        ran += f", in {amount(summary['wall_s'], 's')} ({fixed(summary['real_time_factor'])} times real time)"
    figures = [("ran", ran), ("oscillation", f"{amount(window['oscillation_m'], 'm')} peak to peak{_growth(window)}")]
    if window["penetration_mean_m"] is not None:
        depth = f"{amount(window['penetration_mean_m'], 'm')} on average"
        outside = 100 * window["outside_fraction"]
        figures.append(("penetration", depth + (f", outside the wall {outside:.0f} % of the time" if outside else "")))
    if window["displayed_stiffness_N_m"] is not None:
        figures.append(("displayed stiffness", spring(window["displayed_stiffness_N_m"])))
    if happened := counts(summary):
        figures.append(("in all", ", ".join(f"{count} {words}" for words, count in happened.items())))
    return figures


def _growth(window: dict[str, Any]) -> str:
    """How the swings grow; nothing where nothing swings, or as little as a limit cycle's."""
    rate = window.get("growth_1_s") or 0.0
    if abs(rate) < 0.5:
        return ""
    return f", {'growing' if rate > 0 else 'dying away'} as e^({rate:+.2g} t/s)"


def _grid(rows: list[tuple[str, str]]) -> Table:
    from rich.table import Table

    grid = Table.grid(padding=(0, 2))
    grid.add_column(style="dim", no_wrap=True)
    grid.add_column()
    for row in rows:
        grid.add_row(*row)
    return grid


def _books(energy: dict[str, Any], control_rate: float) -> Table:
    """The energy books: wall with its leak, elements, then what the plant moved."""
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1))
    table.add_column("energy taken out of the device by")
    for name in ("at work", "true", "sampled"):
        table.add_column(name, justify="right", no_wrap=True)
    for row in _virtual_rows(energy, control_rate):
        table.add_row(*row)
    table.add_section()
    table.add_row("energy in the plant", "", "", "", style="bold")
    for name, value in _plant_rows(energy):
        table.add_row(name, "", value, "")
    return table


def _virtual_rows(energy: dict[str, Any], control_rate: float) -> list[tuple[str, str, str, str]]:
    wall, rows = energy["wall"], []
    if "leak" in wall:
        rows.append(("wall", "", amount(wall["true_J"], "J"), amount(wall["sampled_J"], "J")))
        rows += [(f"  leak by {words}", "", amount(wall["leak"][key], "J"), "") for key, words in LEAKS.items()]
        rows.append(("  held by an ideal spring", "", amount(_rounded(wall["ideal_J"], wall["true_J"]), "J"), ""))
    for element in energy["elements"]:
        values = parameters(element["parameters"])
        ticks = f"{element['from_tick'] / control_rate:g}–{element['to_tick'] / control_rate:g} s"
        name = element["kind"] + (f" ({values})" if values else "")
        rows.append((name, ticks, amount(element["true_J"], "J"), amount(element["sampled_J"], "J")))
    return rows


def _plant_rows(energy: dict[str, Any]) -> list[tuple[str, str]]:
    rows = [(words, amount(energy[key], "J")) for key, words in plant_books(energy).items()]
    rows.append(("stored at the end", amount(energy["stored_J"], "J")))
    residual, moved = energy["residual_J"], energy["moved_J"]
    share = f", {residual / moved:.1e} of what moved" if residual is not None and moved else ""
    return [*rows, ("moved in total", amount(moved, "J")), (f"residual{share}", amount(residual, "J"))]


def _rounded(value: float | None, beside: float | None) -> float | None:
    """Zero for what is only the rounding of a much larger number."""
    return 0.0 if value is not None and beside is not None and abs(value) < 1e-9 * abs(beside) else value


def status_table(data: dict[str, Any]) -> RenderableType:
    """One live run: how far it is, how it looks, and of every node its lag, whom it waits for and what it skipped."""
    from rich.console import Group
    from rich.text import Text

    rate, pace = data["control_rate"], data.get("pace", "free")
    at_pace = "as fast as it goes" if pace == "free" else f"at pace {pace:g}"
    state = ("paused", "bold yellow") if data["paused"] else ("running", "bold green")
    where = f"  {data['tick'] / rate:g} s of {data['end'] / rate:g} s, tick {data['tick']} of {data['end']}, {at_pace}"
    head = Text.assemble((data.get("run", ""), "bold"), "  " if data.get("run") else "", data["title"])
    parts: list[RenderableType] = [head, Text.assemble(state, where)]
    if status := data.get("status"):
        word = status["verdict"]
        looks = f" so far, oscillation {amount(status['oscillation_m'], 'm')} peak to peak"
        parts.append(Text.assemble((word, VERDICT_STYLES.get(word, "bold")), looks))
    return Group(*parts, _nodes(data["nodes"], rate))


def _nodes(nodes: list[dict[str, Any]], control_rate: float) -> Table:
    from rich import box
    from rich.table import Table
    from rich.text import Text

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("node", no_wrap=True)
    for name in ("pid", "tick", "behind"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("waits for")
    table.add_column("skipped", justify="right", no_wrap=True)
    for node in nodes:
        behind, skipped = node["behind_ticks"], node.get("skipped_ticks", 0)
        ticks = f"{behind} tick{'s' * (behind != 1)}"
        lag = f"{ticks}, {amount(behind / control_rate, 's')}" if behind else "–"
        skips = "–" if node.get("lossless", True) else Text(f"{skipped} ticks", "yellow" if skipped else "")
        table.add_row(Text(node["role"]), str(node["pid"]), str(node["tick"]), lag, node["waits_for"] or "–", skips)
    return table


def plugins_table(kinds: Mapping[str, type[Element]]) -> Table:
    """Every kind of element: what it does, its parameters with unit, bounds and default."""
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_lines=False)
    table.add_column("kind", no_wrap=True)
    table.add_column("what it does")
    table.add_column("parameters")
    for kind, element in kinds.items():
        about = (element.__doc__ or "").strip().partition("\n")[0]
        lines = [_parameter(name, *declared) for name, declared in element.parameters().items()]
        table.add_row(kind, about, "\n".join(lines) or "–")
        table.add_section()
    return table


def _parameter(name: str, quantity: Quantity, default: Any) -> str:
    words = [f"{name} ({quantity.unit})" if quantity.unit else name]
    for bound in ("at_least", "above", "at_most", "below"):
        value = getattr(quantity, bound)
        words += [f"{bound.replace('_', ' ')} {value:g}"] if value is not None else []
    if default is not dataclasses.MISSING:
        words.append(f"default {default:g}")
    return ", ".join(words)
