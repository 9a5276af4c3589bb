"""Elements of the plugin files that a command was given, and notes on its scene or its recording."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from haploop.controller.dissipation import Element
    from haploop.launch.plan.meant.rule import Note
    from haploop.protocol.scene.scene import Scene

_OWN = "haploop.controller."
_IN_PLACE = "The element {0} comes from a plugin, in place of the installed one."


def kinds_with(plugins: list[Path]) -> dict[str, type[Element]]:
    """Returns the installed elements and those of some plugin files."""
    from haploop.controller.dissipation import registry

    return registry(plugins)


def print_note(note: str) -> None:
    """Prints a note on stderr, unless there is none."""
    if note:
        print(f"Note: {note}", file=sys.stderr)


def notes_in_place(kinds: Mapping[str, type[Element]]) -> list[Note]:
    """Returns a note on each of these elements that comes from a plugin and has the name of an installed one."""
    from haploop.controller.dissipation.registry import installed
    from haploop.launch.plan.meant.rule import Note

    of_files = sorted(name for name, kind in kinds.items() if not kind.__module__.startswith(_OWN))
    return [Note(_IN_PLACE.format(name), "dissipation") for name in of_files if name in installed()]


def print_notes(
    scene: Scene, kinds: Mapping[str, type[Element]], path: Path | None = None, overrides: Sequence[str] = ()
) -> list[Note]:
    """Prints on stderr what in a resolved scene may not be what was meant, one line each; returns these notes.

    If the file the scene was read from, and what was laid over it, are given, each note begins with its file and line.
    """
    from haploop.launch.plan.effects import notes
    from haploop.launch.scene.file import places

    named = [table.name for table in (*scene.dissipation, *(event.swap for event in scene.event if event.swap))]
    found = [*notes_in_place({name: kinds[name] for name in named if name in kinds}), *notes(scene, kinds)]
    where = places(path, overrides, [note.key for note in found]) if path and found else [""] * len(found)
    for note, place in zip(found, where, strict=True):
        print(f"{place}: Note: {note}" if place else f"Note: {note}", file=sys.stderr)
    return found
