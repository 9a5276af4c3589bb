"""The demo's story in the terminal: the wall, why it swings, what the element did, both sides next to each other."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from haploop.tools.demo.story import Story
from haploop.tools.render.terminal import make_table, verdict_style

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rich.console import RenderableType


def report(story: Story) -> RenderableType:
    """Returns the story as lines and one table, at most 80 letters wide."""
    from rich.console import Group
    from rich.text import Text

    table = make_table("", "before", f"with {story.element}")
    for (name, before), (_, after) in zip(story.before.rows(), story.after.rows(), strict=True):
        table.add_row(
            name, *(Text(value, verdict_style(value) if name == "verdict" else "") for value in (before, after))
        )
    return Group(
        Text(story.data.scene.title, style="bold"),
        Text(f"\n{story.why()}"),
        Text(f"\nAt {story.at_s:g} s, in mid-contact, {story.element} is swapped in. {story.outcome()}"),
        table,
        *(
            Text(f"{name}{_judged(part.summary)}: {part.summary['verdict_rule']}", style="dim")
            for name, part in story.parts()
        ),
        Text(),
    )


def _judged(summary: Mapping[str, Any]) -> str:
    """Returns the words that set the swing in a verdict's sentence apart from that of the run, which the table has."""
    return ", with the hand held still and a push" if "stability" in summary else ""
