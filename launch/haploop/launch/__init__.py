"""From a scene file to a finished run: scene, plan, clock and launcher.

From Python::

    from haploop.launch import load, run

    scene = load("launch/scenes/fig6c.toml", {"wall.stiffness": "0.2 N/mm"})
    result = run(scene)                                    # in this process, in memory
    result.verdict, result.quantity("window.oscillation_m")
    result["/plant"]["x"], result["/plant"].units["x"]     # an array, and its unit
    run(scene.swap("damping", at="1.5 s", damping=0.8), out="runs/swapped")

See ``haploop.launch.runs.loaded_scene.load``, ``haploop.launch.runs.loaded_scene.LoadedScene`` and
``haploop.launch.runs.result.run``, which are imported when first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from haploop.launch.runs.loaded_scene import LoadedScene as Scene
    from haploop.launch.runs.loaded_scene import load
    from haploop.launch.runs.result import Result, run

__all__ = ["Result", "Scene", "load", "run"]

_HOMES = {
    "Scene": "loaded_scene.LoadedScene",
    "load": "loaded_scene.load",
    "Result": "result.Result",
    "run": "result.run",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, _, attribute = _HOMES[name].partition(".")
    return getattr(import_module(f"{__name__}.runs.{module}"), attribute)
