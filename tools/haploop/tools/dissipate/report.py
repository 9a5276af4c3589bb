"""What the terminal shows of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from haploop.tools.dissipate.outcome import ElementOutcome, Outcome, in_words
from haploop.tools.render.terminal import make_table
from haploop.tools.render.units import amount, fixed

if TYPE_CHECKING:
    from rich.console import RenderableType


def report(outcome: Outcome) -> RenderableType:
    """Answer, table and what is to be known."""
    from rich.console import Group
    from rich.text import Text

    numbers = ("true", "sampled", "took", "gave back", "largest force")
    table = make_table("would have taken out of the device", *numbers, numbers=numbers)
    for element in outcome.elements:
        table.add_row(*row_of(element))
    head = Text(f"{outcome.name}: {answer(outcome)}", style="bold")
    return Group(head, table, *(Text(sentence, style="dim") for sentence in in_words(outcome)))


def row_of(element: ElementOutcome) -> tuple[str, ...]:
    """Label, true and sampled energy, what it took and gave back, and its largest force."""
    energies = (element.true_J, element.sampled_J, element.taken_J, element.given_J)
    return element.label, *(amount(value, "J") for value in energies), amount(element.strongest_N, "N")


def answer(outcome: Outcome) -> str:
    """In one sentence, which element would have dissipated most."""
    ranked = sorted(outcome.elements, key=lambda element: element.true_J, reverse=True)
    best, others = ranked[0], ranked[1:]
    if best.true_J <= 0.0:
        return "none of these would have dissipated; all would have fed the motion."
    words = f"{best.label} would have dissipated {amount(best.true_J, 'J')}"
    if not others:
        return f"{words}."
    feeding = [element for element in others if element.true_J < 0.0]
    taking = [element for element in others if element.true_J > 0.0]
    parts = [f"{_times(best, element)} {element.label}" for element in taking[:2]]
    if parts:
        words += ", " + " and ".join(parts)
    if feeding:
        words += f"; {feeding[-1].label} would have fed {amount(-feeding[-1].true_J, 'J')} into the motion"
    return f"{words}."


def _times(best: ElementOutcome, other: ElementOutcome) -> str:
    ratio = best.true_J / other.true_J
    return "as much as" if ratio < 1.005 else f"{fixed(ratio)} times as much as" if ratio < 1e4 else "far more than"
