"""A scene with each of its effects taken out in turn: what each of them costs."""

from __future__ import annotations

from typing import Any

from haploop.launch.plan.effects import effects_of

WHOLE, AGAIN, NONE = "all effects", "all effects again", "no effect"


def without_effects(scene: dict[str, Any]) -> dict[str, Any]:
    """Returns the scene with no effect left."""
    while named := effects_of(scene):
        scene = named[0].without(scene)
    return scene


def ablations(scene: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Returns the resolved scene, twice; without each of its effects, by the effect's name; and with none left.

    Measured alike, the first two differ by chance alone, which is what a difference between others must exceed.
    """
    parts = {effect.name: effect.without(scene) for effect in effects_of(scene)}
    return {WHOLE: scene, AGAIN: scene, **parts, NONE: without_effects(scene)}
