"""The front door for Python: what the command line does, as functions that return arrays and numbers.

This runs a scene, then steers a second run of it:

    from haploop.api import load, run, start

    scene = load("demo", {"wall.stiffness": "3 N/mm"})      # a file of yours, or a name that `haploop scenes` lists
    result = run(scene)                                     # in this process, in memory; same bits as `haploop run`
    result.verdict, result.provisos, result.quantity("window.oscillation_m")
    result["/plant"]["x"], result["/plant"].units["x"]      # a NumPy array, and its unit

    with start(scene, paused=True) as loop:                 # starts plant, controller and logger as processes
        loop.step(1000)
        loop.swap("damping", damping="5 N s/m")
        steadied = loop.finish()

Values are numbers in SI units, text with a unit, or pint quantities; the error for a wrong name suggests the nearest
one. Nothing is imported before it is first used. A program that sweeps, advises or compares starts worker processes,
which import that program again: guard its code with ``if __name__ == "__main__":``, as multiprocessing requires.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from haploop.api.live import LiveLoop, attach, start
    from haploop.api.studies import advise, compare, dissipate, plot, sweep
    from haploop.launch.runs.loaded_scene import LoadedScene as Scene
    from haploop.launch.runs.loaded_scene import load
    from haploop.launch.runs.result import Result, run
    from haploop.logger.log.stream import read

__all__ = [
    "LiveLoop", "Result", "Scene", "advise", "attach", "compare", "dissipate", "load", "plot", "read", "run", "start",
    "sweep",
]  # fmt: skip

_HOMES = {
    "Scene": "launch.runs.loaded_scene.LoadedScene",
    "load": "launch.runs.loaded_scene.load",
    "Result": "launch.runs.result.Result",
    "run": "launch.runs.result.run",
    "read": "logger.log.stream.read",
    **{name: f"api.live.{name}" for name in ("LiveLoop", "attach", "start")},
    **{name: f"api.studies.{name}" for name in ("advise", "compare", "dissipate", "plot", "sweep")},
}


def __dir__() -> list[str]:
    return __all__


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        from haploop.protocol.names import meant

        raise AttributeError(f"haploop.api has no {name}{meant(name, _HOMES)}; it has {', '.join(__all__)}.")
    module, _, attribute = _HOMES[name].rpartition(".")
    return getattr(import_module(f"haploop.{module}"), attribute)
