"""The resolved scene of the controller that works on a recorded motion: estimators, wall and elements."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from haploop.controller.dissipation import Element
from haploop.launch.scene.file import resolved
from haploop.launch.scene.layers import Layers, key_path
from haploop.protocol.scene.scene import Clock, Device, Scene, accelerometer_is_used
from haploop.tools.cli.options import parse_assignments
from haploop.tools.dissipate.samples import RecordingError, holds_readings

Kinds = Mapping[str, "type[Element]"]
# Tables that can be overridden; [encoder] tells the estimators to what the positions were rounded.
_ESTIMATES = ("velocity", "acceleration", "encoder")
_ESTIMATED = frozenset({"velocity", "acceleration"})


@dataclass(frozen=True)
class Selection:
    """The elements to be booked, and how the controller sees the motion.

    Attributes:
        dampings, masses: of damping, and of bi- and unidirectional inertia; numbers in SI units or text with a unit.
        elements: others, each as "KIND KEY=VALUE ...".
        wall, occupies: position of a wall, and the side of it on which the elements act; without one they always act.
        overrides: ``KEY=VALUE`` for ``[velocity]``, ``[acceleration]`` and ``[encoder]``.
    """

    dampings: Sequence[str] = ()
    masses: Sequence[str] = ()
    elements: Sequence[str] = ()
    wall: str | None = None
    occupies: str = "below"
    overrides: Sequence[str] = ()

    @property
    def has_elements(self) -> bool:
        return bool(self.dampings or self.masses or self.elements)

    def tables(self) -> frozenset[str]:
        """Returns the tables that the overrides change; RecordingError where one is of another table."""
        found = set()
        for text in self.overrides:
            table = (key_path(text.partition("=")[0]) or [text])[0]
            if table not in _ESTIMATES:
                raise RecordingError(
                    f"--set {text} has no meaning here: a recorded motion stays as it is. "
                    "What can be set are keys of [velocity], [acceleration] and [encoder]."
                )
            found.add(table)
        return frozenset(found)

    def estimated_anew(self) -> frozenset[str]:
        """Returns which of "velocity" and "acceleration" the overrides change, directly or by their source."""
        return _ESTIMATED if self.tables() - {"acceleration"} else _ESTIMATED & self.tables()


def make_scene_for_text(
    selection: Selection, path: Path, period_s: float, recorded: frozenset[str], kinds: Kinds
) -> Scene:
    """Makes the scene for a recording in a text file.

    Raises RecordingError where the selection does not fit it, SceneError where a number or a kind is wrong.
    """
    if clash := sorted(selection.tables() & recorded):
        raise RecordingError(f"Give either a column of the {clash[0]} or --set for its estimate, not both.")
    rate = max(1, round(1.0 / period_s))
    clock, device = Clock(plant_rate=rate, control_rate=rate), Device(mass=1.0, damping=0.0)
    bare = Scene(title=path.stem, duration=1.0 / rate, clock=clock, device=device)
    made = _make_scene(bare, selection, path, kinds)
    if accelerometer_is_used(made) and "acceleration" not in recorded:
        raise RecordingError("The estimates read an accelerometer; say with --acceleration which column that is.")
    return made


def make_scene_for_log(selection: Selection, path: Path, scene: Scene, kinds: Kinds) -> Scene:
    """Makes the scene for a run's log: its own estimators, wall and events of the wall unless others are selected.

    Raises RecordingError where the selection does not fit it, SceneError where a number or a kind is wrong.
    """
    kept = ("title", "duration", "clock", "device", "encoder", "noise", "accelerometer", *_ESTIMATED, "wall")
    made = _make_scene(Scene(**{key: getattr(scene, key) for key in kept}), selection, path, kinds)
    if selection.overrides and accelerometer_is_used(made) and not holds_readings(scene):
        raise RecordingError("The estimates read an accelerometer, but its readings are not in the log.")
    walls = tuple(event for event in scene.event if any(key.startswith("wall.") for key in event.set or ()))
    return replace(made, event=() if selection.wall else walls)


def _make_scene(bare: Scene, selection: Selection, path: Path, kinds: Kinds) -> Scene:
    """Resolves a scene with the selected wall, elements and estimates, in the words in which they were given."""
    layers = Layers(path, bare.as_dict())
    if selection.wall is not None:
        wall = {"position": _value(selection.wall), "stiffness": 0.0, "occupies": selection.occupies}
        layers.data["wall"] = wall
    elements = [{"kind": "damping", "damping": _value(text)} for text in selection.dampings]
    for kind in ("bidirectional-inertia", "unidirectional-inertia"):
        elements += [{"kind": kind, "mass": _value(text)} for text in selection.masses]
    for text in selection.elements:
        kind, *parameters = shlex.split(text) or [""]
        elements.append({"kind": kind, **parse_assignments(parameters)})
    if "wall" not in layers.data:
        if any(table["kind"] == "unidirectional-damping" for table in elements):
            raise RecordingError("Unidirectional damping acts on the way into a wall; say where it begins with --wall.")
        elements = [{"acts": "always", **table} for table in elements]
    layers.data["dissipation"] = elements
    return resolved(layers, selection.overrides, kinds)


def _value(text: str) -> Any:
    return parse_assignments([f"value={text}"])["value"]
