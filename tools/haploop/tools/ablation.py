"""A scene with each of its effects taken out in turn: what each of them costs."""

from __future__ import annotations

from typing import Any

from haploop.launch.plan.plan import effects_of
from haploop.tools.operations import without

WHOLE, AGAIN, NONE = "all effects", "all effects again", "no effect"


def ablations(scene: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """The resolved scene, twice; without each of its effects, by the effect's name; and with none left.

    Measured alike, the first two differ by chance alone: how far is how much a difference between others means.
    """
    parts = {effect.name: without(effect, scene) for effect in effects_of(scene)}
    return {WHOLE: scene, AGAIN: scene, **parts, NONE: without_all(scene)}


def without_all(scene: dict[str, Any]) -> dict[str, Any]:
    """The scene with no effect left."""
    while named := effects_of(scene):
        scene = without(named[0], scene)
    return scene
