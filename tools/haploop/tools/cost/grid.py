"""The grid of ``haploop cost``: a scene with every method at every plant rate, and how far off each run is."""

from __future__ import annotations

import hashlib
import itertools
import json
import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from haploop.controller.dissipation import ElementError, registry
from haploop.launch.scene.file import load
from haploop.launch.scene.mistakes import COMMAND_LINE, SceneError
from haploop.plant.integrators.registry import INTEGRATORS
from haploop.protocol.scene.scene import Scene
from haploop.tools.cost.data import Errors
from haploop.tools.machine import machine, source_digest, versions
from haploop.tools.operations import operations
from haploop.tools.reference.nearest import Reference, statistics
from haploop.tools.trajectory import Trajectory, trajectory

METHODS = tuple(INTEGRATORS)
# Measurements depend on these packages whole, and of this one on these files.
_PACKAGES = ("haploop.protocol", "haploop.plant", "haploop.controller", "haploop.logger", "haploop.launch")
_FILES = (
    *("cost/grid.py", "cost/times.py", "cost/prices.py", "linear/one_tick.py", "linear/stiffness_limit.py"),
    *("operations.py", "trajectory.py", "reference/nearest.py"),
)


@dataclass(frozen=True)
class Candidate:
    """One scene file with one method at one plant rate, Hz.

    ``scene`` is resolved, or None where the check refuses it; ``refusal`` says why.
    """

    path: Path
    method: str
    plant_rate: int
    scene: Scene | None = None
    refusal: str = ""

    @property
    def overrides(self) -> list[str]:
        return [f"clock.integrator={self.method}", f"clock.plant_rate={self.plant_rate}"]

    def key(self, *made_with: Any) -> str:
        """Returns its name in the store: a hash of the resolved scene and of what it is measured with."""
        return digest([self.method, self.plant_rate, self.scene, self.refusal, *made_with])


@dataclass(frozen=True)
class Grid:
    """All candidates of one scene, method by method, rates rising; the scene's own setting is one of them."""

    path: Path
    scene: Scene
    candidates: list[Candidate]

    @property
    def own(self) -> tuple[str, int]:
        return self.scene.clock.integrator, self.scene.clock.plant_rate


def grid(path: Path, methods: Sequence[str], rates: Sequence[int]) -> Grid:
    """Makes every candidate of a scene file; SceneError where the scene cannot be run as it is."""
    made = Grid(path, load(path), [])
    order = [*methods, made.own[0]]
    settings = {*itertools.product(methods, rates), made.own}
    for method, rate in sorted(settings, key=lambda setting: (order.index(setting[0]), setting[1])):
        made.candidates.append(_candidate(path, method, rate))
    return made


def _candidate(path: Path, method: str, rate: int) -> Candidate:
    bare = Candidate(path, method, rate)
    try:
        return replace(bare, scene=load(path, [*bare.overrides, "run.log=none"]))
    except SceneError as error:
        reasons = [str(mistake).removeprefix(f"{COMMAND_LINE}: ") for mistake in error.mistakes]
        return replace(bare, refusal=f"Refused by the check: {' '.join(reasons)}")


def digest(data: Any) -> str:
    """Returns a short hash of what JSON can hold, and of scenes."""
    text = json.dumps(data, sort_keys=True, default=Scene.as_dict)
    return hashlib.sha256(text.encode()).hexdigest()[:20]


def made_with() -> list[Any]:
    """Returns what measurements depend on beside the scenes: machine, versions and the source of what is measured."""
    tools = Path(__file__).parents[1]
    files = [*(tools / name for name in _FILES), *sorted((tools / "reference/stored").glob("*"))]
    return [machine(), versions(), source_digest(_PACKAGES, files)]


def scenes_folder() -> Path:
    """Returns the folder of haploop's own scenes: in a wheel inside haploop.launch, in a checkout beside it."""
    import haploop.launch

    package = Path(haploop.launch.__path__[0])
    inside = package / "scenes"
    return inside if inside.is_dir() else package.parents[1] / "scenes"


def accuracy_scenes() -> list[Path]:
    return sorted((scenes_folder() / "accuracy").glob("*.toml"))


@dataclass(frozen=True)
class Outcome:
    """The outcome of one candidate in one run that is not timed: an error or a failure, and the ticks that it had."""

    error: Errors | None
    failure: str | None
    ticks: int
    instructions_per_tick: float | None


def outcome(candidate: Candidate, reference: Reference) -> Outcome:
    """Runs a candidate and compares it; a failure is an outcome like any other."""
    if candidate.scene is None:
        return Outcome(None, candidate.refusal, 0, None)
    try:
        # A method that blows up overflows on the way; that is said once, as the reason of the failure.
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore", RuntimeWarning)
            ran = trajectory(candidate.scene)
    except (ElementError, ArithmeticError, np.linalg.LinAlgError) as error:
        return Outcome(None, f"Could not go on: {error}", 0, None)
    ticks = ran.summary["ticks"]
    if failure := _failure(ran, reference):
        return Outcome(None, failure, ticks, None)
    counted = operations(candidate.scene, registry()).per_tick
    return Outcome(_errors(ran, candidate.scene, reference), None, ticks, counted)


def _failure(ran: Trajectory, reference: Reference) -> str | None:
    if ran.summary["ended"] in ("diverged", "failed"):
        return f"Diverged: {ran.summary['why']}."
    if not np.isfinite(ran.x_m).all():
        return "Not finite: a position is no number."
    if len(ran.x_m) != len(reference.x_m):
        return f"Ended after {len(ran.x_m) - 1} ticks, the reference after {len(reference.x_m) - 1}."
    return None


def _errors(ran: Trajectory, scene: Scene, reference: Reference) -> Errors:
    """Compares positions at the ticks after the start: sqrt(mean((x - x_ref)^2)) and the like.

    Where a chaotic reference forbids that, the swings in the verdict's window are: |a - a_ref| / |a_ref|.
    """
    verdict, energy = ran.summary["verdict"], ran.summary["energy"]
    residual = _share(energy["residual_J"], energy["moved_J"])
    common = {"residual": residual, "verdict": verdict, "verdict_right": verdict == reference.verdict}
    if reference.pointwise:
        off = np.abs(ran.x_m - np.asarray(reference.x_m))[1:]
        return Errors(final_m=float(off[-1]), rms_m=math.sqrt(np.mean(off**2)), max_m=float(off.max()), **common)
    theirs, ours = reference.statistics, statistics(scene, ran.x_m, ran.v_m_s)
    off_by = {name: _apart(ours[name], theirs[name]) for name in theirs}
    names = {"amplitude": "amplitude_m", "frequency": "frequency_Hz", "energy_per_cycle": "energy_per_cycle_J"}
    relative = {entry: _share(off_by[name], theirs[name]) for entry, name in names.items()}
    return Errors(**relative, amplitude_m=off_by["amplitude_m"], **common)


def _apart(value: float | None, reference: float | None) -> float | None:
    return None if value is None or reference is None else abs(value - reference)


def _share(off_by: float | None, reference: float | None) -> float | None:
    return abs(off_by / reference) if off_by is not None and reference else None
