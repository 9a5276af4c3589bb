"""The grid of ``haploop cost``: a scene with every method at every plant rate, and with its own setting."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from haploop.launch.scene.file import load
from haploop.launch.scene.mistakes import COMMAND_LINE, SceneError
from haploop.plant.integrators.registry import INTEGRATORS

METHODS = tuple(INTEGRATORS)
RATES = (1_000, 2_000, 5_000, 10_000, 20_000, 50_000, 100_000)


@dataclass(frozen=True)
class Candidate:
    """One scene with one method at one plant rate.

    Attributes:
        path: the scene file.
        method, plant_rate: of this candidate, rate in Hz.
        scene: resolved; None where the check refuses it.
        refusal: why it does; "" where it does not.
    """

    path: Path
    method: str
    plant_rate: int
    scene: dict[str, Any] | None
    refusal: str

    @property
    def overrides(self) -> list[str]:
        """The ``KEY=VALUE`` that are laid over the scene file."""
        return [f"clock.integrator={self.method}", f"clock.plant_rate={self.plant_rate}"]

    def key(self, *made_with: Any) -> str:
        """Returns its name in the store: a hash of the resolved scene and of what it is measured with."""
        return digest([self.method, self.plant_rate, self.scene, self.refusal, *made_with])


@dataclass(frozen=True)
class Grid:
    """All candidates of one scene.

    Attributes:
        scene: as its file has it, resolved.
        candidates: method by method, rates rising; the scene's own setting is one of them.
    """

    path: Path
    scene: dict[str, Any]
    candidates: list[Candidate]

    @property
    def name(self) -> str:
        """The name of the scene."""
        return self.path.stem

    @property
    def own(self) -> tuple[str, int]:
        """The method and the plant rate that the scene itself names."""
        return self.scene["clock"]["integrator"], self.scene["clock"]["plant_rate"]


def grid(path: Path, methods: Sequence[str], rates: Sequence[int]) -> Grid:
    """Makes every candidate of a scene file.

    Raises:
        SceneError: the scene cannot be run as it is.
    """
    scene = load(path)
    settings = [(method, rate) for method in methods for rate in sorted(set(rates))]
    bare = Grid(path, scene, [])
    if bare.own not in settings:
        settings.append(bare.own)
        settings.sort(key=lambda setting: (_place(setting[0], methods), setting[1]))
    return Grid(path, scene, [_candidate(path, *setting) for setting in settings])


def _place(method: str, methods: Sequence[str]) -> int:
    return methods.index(method) if method in methods else len(methods)


def _candidate(path: Path, method: str, rate: int) -> Candidate:
    bare = Candidate(path, method, rate, None, "")
    try:
        return Candidate(path, method, rate, load(path, [*bare.overrides, "run.log=none"]), "")
    except SceneError as error:
        reasons = [str(mistake).removeprefix(f"{COMMAND_LINE}: ") for mistake in error.mistakes]
        return Candidate(path, method, rate, None, f"Refused by the check: {' '.join(reasons)}")


def digest(data: Any) -> str:
    """Returns a short hash of what JSON can hold."""
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()[:20]


def scenes_folder() -> Path:
    """Returns the folder of haploop's own scenes: in a wheel inside haploop.launch, in a checkout beside it."""
    import haploop.launch

    package = Path(haploop.launch.__path__[0])
    inside = package / "scenes"
    return inside if inside.is_dir() else package.parents[1] / "scenes"


def accuracy_scenes() -> list[Path]:
    """Returns the scenes made for this comparison."""
    return sorted((scenes_folder() / "accuracy").glob("*.toml"))
