"""Tables of sweeps as the engine writes them, made by running or by hand."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from haploop.launch.runs.in_batch import run_batch
from haploop.launch.scene.toml_writer import to_toml
from haploop.protocol.scene.scene import Scene
from haploop.tools.sweep.map.data import AMPLITUDE, PROVISOS, MapData, make_map_data
from haploop.tools.sweep.table import JOINS
from helpers.scenes.least import KINDS, scene

UNITS = {
    "wall.stiffness": "N/m",
    "dissipation.0.damping": "N s/m",
    "dissipation.0.mass": "kg",
    "clock.round_trip_delay": "s",
    "device.mass": "kg",
    "device.damping": "N s/m",
    "hand.force.value": "N",
}
Result = dict[str, Any]


def cells_of(axes: Mapping[str, Sequence[Any]], seeds: int = 1) -> list[dict[str, Any]]:
    """A dict for every cell: the axes' values by key, and the seed."""
    values = itertools.product(*axes.values(), range(1, seeds + 1))
    return [dict(zip([*axes, "seed"], cell, strict=True)) for cell in values]


def ran(axes: Mapping[str, Sequence[Any]], scene_of: Callable[[dict[str, Any]], Scene], seeds: int = 1) -> MapData:
    """The map of scenes that are run, in arrays where possible."""
    cells = cells_of(axes, seeds)
    scenes = [scene_of(cell) for cell in cells]
    results = run_batch(scenes, KINDS, energy=False)
    return table(axes, cells, results, scenes)


def table(
    axes: Mapping[str, Sequence[Any]],
    cells: Sequence[dict[str, Any]],
    results: Sequence[Result],
    scenes: Sequence[Scene | None],
    title: str = "a sweep",
) -> MapData:
    """The map of given results: summaries, or ``ended`` and ``why`` alone."""
    columns: dict[str, list[Any]] = {key: [cell[key] for cell in cells] for key in [*axes, "seed"]}
    columns["cell"] = [*range(len(cells))]
    columns["verdict"] = [result.get("verdict") for result in results]
    columns[AMPLITUDE] = [result.get("window", {}).get("oscillation_m") for result in results]
    if any("provisos" in result for result in results):
        columns[PROVISOS] = [JOINS.join(result.get("provisos", [])) for result in results]
    columns["ended"] = [result.get("ended", "done") for result in results]
    columns["why"] = [result.get("why", "") for result in results]
    columns["scene"] = [None if scene is None else to_toml(scene.as_dict()) for scene in scenes]
    base = next((scene.title for scene in scenes if scene is not None), "none")
    axes_of_file = {key: [*values] for key, values in axes.items()}
    return make_map_data(columns, UNITS, {"title": title, "base": {"title": base}, "axes": axes_of_file})


def said(verdict: str | None, oscillation_m: float | None = None) -> Result:
    """A result with a verdict; a failed one if there is none."""
    if verdict is None:
        return {"ended": "failed", "why": "A plugin raised."}
    return {"verdict": verdict, "window": {"oscillation_m": oscillation_m}}


# A sweep with a result of every kind.
K, B = "wall.stiffness", "dissipation.0.damping"
STIFFNESSES, DAMPINGS = [100.0, 200.0, 300.0, 400.0], [0.1, 0.2, 0.5, 1.0, 2.0]
WITH_DAMPING = scene(
    title="a base", wall={"position": -0.001, "stiffness": 100.0}, dissipation=[{"kind": "damping", "damping": 0.1}]
)


def result_of(cell: dict[str, Any]) -> dict[str, Any]:
    """A result of every kind, by place."""
    k, b = cell[K], cell[B]
    if b == 2.0:
        return said(None)
    if k == 400.0:
        return said("diverged", math.inf)
    if k / b > 1000.0:
        return said("limit-cycle", 1e-6 * k / b)
    return said("no-contact" if k == 100.0 else "steady", 1e-7)


def with_all_kinds(title: str = "a sweep") -> MapData:
    axes = {K: STIFFNESSES, B: DAMPINGS}
    cells = cells_of(axes)
    return table(axes, cells, [result_of(cell) for cell in cells], [WITH_DAMPING] * len(cells), title)
