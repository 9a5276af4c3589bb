"""A scene without some of its tables, keys or effects; the cost of an effect is the difference to the whole."""

from __future__ import annotations

from typing import Any

from haploop.launch.plan.effects import Effect
from haploop.launch.plan.plan import effects_of

WHOLE, AGAIN, NONE = "all effects", "all effects again", "no effect"
# Keys of an estimate that are not an estimator's own.
_NOT_OF_AN_ESTIMATOR = ("source", "cutoff")


def without_keys(scene: dict[str, Any], *keys: str) -> dict[str, Any]:
    """Returns a scene without some dotted keys; it shares what stays, and an absent key changes nothing."""
    for key in keys:
        first, _, rest = key.partition(".")
        if first not in scene:
            continue
        left = {name: value for name, value in scene.items() if name != first}
        scene = {**left, first: without_keys(scene[first], rest)} if rest else left
    return scene


def without_effect(effect: Effect, scene: dict[str, Any]) -> dict[str, Any]:
    """Returns a resolved scene without an effect, and without what cannot be there without it."""
    table, _, last = effect.key.rpartition(".")
    if last != "estimator":
        return without_keys(scene, effect.key)
    kept = {key: value for key, value in scene[table].items() if key in _NOT_OF_AN_ESTIMATOR}
    from_kalman = scene.get("acceleration", {}).get("source") == "kalman"
    return without_keys({**scene, table: kept}, *(["acceleration.source"] if from_kalman else []))


def without_effects(scene: dict[str, Any]) -> dict[str, Any]:
    """Returns the scene with no effect left."""
    while named := effects_of(scene):
        scene = without_effect(named[0], scene)
    return scene


def ablations(scene: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Returns the resolved scene, twice; without each of its effects, by the effect's name; and with none left.

    Measured alike, the first two differ by chance alone, which is what a difference between others must exceed.
    """
    parts = {effect.name: without_effect(effect, scene) for effect in effects_of(scene)}
    return {WHOLE: scene, AGAIN: scene, **parts, NONE: without_effects(scene)}
