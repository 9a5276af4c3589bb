"""The grid of ``haploop cost``: a scene with every method at every plant rate, and how far off each run is."""

from __future__ import annotations

import hashlib
import json
import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from haploop.controller.dissipation import ElementError
from haploop.launch.scene.bundled import bundled_folder
from haploop.launch.scene.file import load
from haploop.launch.scene.mistakes import COMMAND_LINE, SceneError
from haploop.plant.integrators.registry import INTEGRATORS
from haploop.protocol.scene.scene import Scene
from haploop.tools.cost.data import Errors
from haploop.tools.cost.reference import Reference, exactly, statistics
from haploop.tools.machine import machine, source_digest, versions
from haploop.tools.trajectory import Trajectory, trajectory

METHODS = tuple(INTEGRATORS)
# Starts of a chaotic scene, their distance, and the 97.5 % quantile of Student's t with one degree of freedom less.
STARTS, _APART_M, _T = 30, 1e-6, 2.045
# Errors depend on all of these packages, and in this package on these files; times depend on more of them.
_PACKAGES = ("haploop.protocol", "haploop.plant", "haploop.controller", "haploop.logger", "haploop.launch")
_OF_ERRORS = ("cost/grid.py", "trajectory.py", "cost/reference.py")
_OF_TIMES = (
    *("cost/times.py", "cost/prices.py", "cost/alike.py"),
    *("operations.py", "linear/one_tick.py", "linear/stiffness_limit.py"),
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
        """Returns its name in the store: a hash of it and of what it is measured with."""
        return digest([self.method, self.plant_rate, self.scene, self.refusal, *made_with])


@dataclass(frozen=True)
class Grid:
    """All candidates of one scene, method by method, rates rising; the scene's own setting is one of them."""

    path: Path
    scene: Scene
    candidates: list[Candidate]

    def key(self, *made_with: Any) -> str:
        """Returns the scene's name in the store."""
        return digest([self.scene, *made_with])

    @property
    def own(self) -> tuple[str, int]:
        return self.scene.clock.integrator, self.scene.clock.plant_rate


def grid(path: Path, methods: Sequence[str], rates: Sequence[int]) -> Grid:
    """Makes every candidate of a scene file; SceneError where the scene cannot be run as it is.

    A method that chooses its own steps gains nothing from another plant rate: it is one candidate, at the lowest.
    """
    made = Grid(path, load(path), [])
    order = [*methods, made.own[0]]
    at = {method: [min(rates)] if INTEGRATORS[method].chooses_steps else rates for method in methods}
    settings = {made.own, *((method, rate) for method in methods for rate in at[method])}
    for method, rate in sorted(settings, key=lambda setting: (order.index(setting[0]), setting[1])):
        bare = Candidate(path, method, rate)
        try:
            made.candidates.append(replace(bare, scene=load(path, [*bare.overrides, "run.log=none"])))
        except SceneError as error:
            reasons = " ".join(str(mistake).removeprefix(f"{COMMAND_LINE}: ") for mistake in error.mistakes)
            made.candidates.append(replace(bare, refusal=f"Refused by the check: {reasons}"))
    return made


def digest(data: Any) -> str:
    """Returns a short hash of what JSON can hold, and of scenes."""
    text = json.dumps(data, sort_keys=True, default=Scene.as_dict)
    return hashlib.sha256(text.encode()).hexdigest()[:20]


def errors_made_with() -> list[Any]:
    """Returns what errors depend on beside the scenes: versions and the source of what is run; not the machine."""
    tools = Path(__file__).parents[1]
    files = [*(tools / name for name in _OF_ERRORS), *sorted((tools / "cost/references").glob("*"))]
    return [versions(), source_digest(_PACKAGES, files)]


def times_made_with() -> list[Any]:
    """Returns what times depend on beside the scenes: the machine, and the source of what is timed."""
    tools = Path(__file__).parents[1]
    return [machine(), *errors_made_with(), source_digest((), [tools / name for name in _OF_TIMES])]


def accuracy_scenes() -> list[Path]:
    return sorted((bundled_folder("scenes") / "accuracy").glob("*.toml"))


@dataclass(frozen=True)
class Outcome:
    """The outcome of one candidate in runs that are not timed: an error or a failure, and the ticks that it ran."""

    error: Errors | None
    failure: str | None
    ticks: int


Swings = dict[str, float | None]


def starts(scene: Scene) -> list[Scene]:
    """Returns the scene from ``STARTS`` starts, 1 µm apart, the first its own."""
    device = scene.device
    moved = (replace(device, position=device.position + start * _APART_M) for start in range(STARTS))
    return [replace(scene, device=each) for each in moved]


def true_swings(scene: Scene) -> list[Swings]:
    """Returns the swings of the exact flow from every start, with which those of a chaotic scene are compared."""
    return [_swings(each, trajectory(each)) for each in starts(exactly(scene, scene.clock.plant_rate))]


def _swings(scene: Scene, ran: Trajectory) -> Swings:
    return statistics(scene, ran.x_m, ran.v_m_s)


def outcome(candidate: Candidate, reference: Reference, swings: Sequence[Swings] = ()) -> Outcome:
    """Runs a candidate and compares it; a failure is an outcome like any other.

    Args:
        swings: those of the exact flow from all ``starts``, for a reference that cannot be compared point by point.
    """
    if candidate.scene is None:
        return Outcome(None, candidate.refusal, 0)
    try:
        # A method that blows up overflows on the way; that is reported once, as the reason for the failure.
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore", RuntimeWarning)
            ran = trajectory(candidate.scene)
            others = [] if reference.pointwise else [trajectory(each) for each in starts(candidate.scene)[1:]]
    except (ElementError, ArithmeticError, np.linalg.LinAlgError) as error:
        return Outcome(None, f"Could not continue: {error}", 0)
    ticks = ran.summary["ticks"]
    if failure := next(filter(None, (_failure(each, reference) for each in [ran, *others])), None):
        return Outcome(None, failure, ticks)
    return Outcome(_errors([ran, *others], candidate.scene, reference, swings), None, ticks)


def _failure(ran: Trajectory, reference: Reference) -> str | None:
    if ran.summary["ended"] in ("diverged", "failed"):
        return f"Diverged: {ran.summary['why']}."
    if not np.isfinite(ran.x_m).all():
        return "Not finite: a position is not a number."
    if len(ran.x_m) != len(reference.x_m):
        return f"Ended after {len(ran.x_m) - 1} ticks, the reference after {len(reference.x_m) - 1}."
    return None


def _errors(runs: list[Trajectory], scene: Scene, reference: Reference, swings: Sequence[Swings]) -> Errors:
    """Compares positions at the ticks after the start: sqrt(mean((x - x_ref)^2)) and the like.

    Where a chaotic reference forbids that, the swings at the end are compared: the mean of their differences from those
    of the exact flow from the same start, and half of its 95 % interval, by Student's t.
    """
    ran = runs[0]
    energy = ran.summary["energy"]
    residual = abs(energy["residual_J"] / energy["moved_J"]) if energy["moved_J"] else None
    if reference.pointwise:
        off = np.abs(ran.x_m - np.asarray(reference.x_m))[1:]
        return Errors(
            final_m=float(off[-1]), rms_m=math.sqrt(np.mean(off**2)), max_m=float(off.max()), residual=residual
        )
    ours = [_swings(scene, each) for each in runs]
    names = {"amplitude": "amplitude_m", "frequency": "frequency_Hz", "energy_per_cycle": "energy_per_cycle_J"}
    relative = {entry: _relative(ours, swings, name) for entry, name in names.items()}
    mine, true = (np.array([each["amplitude_m"] or 0.0 for each in runs]) for runs in (ours, swings))
    off = mine - true
    doubt_m = _T * float(off.std(ddof=1)) / math.sqrt(len(off))
    return Errors(**relative, amplitude_m=abs(float(off.mean())), doubt_m=doubt_m, residual=residual)


def _relative(ours: Sequence[Swings], theirs: Sequence[Swings], name: str) -> float | None:
    """Returns the relative error of a mean over all starts; None where one of them has no such number."""
    mine, true = ([each[name] for each in runs] for runs in (ours, theirs))
    if None in (*mine, *true):
        return None
    total = sum(filter(None, true))
    return abs((sum(filter(None, mine)) - total) / total) if total else None
