"""Results of walls that were tried, kept in a readable file so that an interrupted advice can be continued."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, Self

from haploop.launch.spec import OutputError
from haploop.protocol.scene.scene import ElementTable, Scene
from haploop.tools.advise.walls.cases import Case


@dataclass(frozen=True)
class Tried:
    """A wall to be tried: its stiffness and the elements with it."""

    stiffness_N_m: float
    elements: tuple[ElementTable, ...] = ()


@dataclass(frozen=True)
class Failure:
    """What a wall does in the case that it does not bear.

    Attributes:
        case: the case in words; or why it cannot be told, with a frequency of 0.
        at_s: end of the stretch in which it was seen.
        gone: whether the device left its limits; the numbers then mean nothing.
        motion_m, force_N, frequency_Hz, times_felt, by_force: of that stretch, as in ``Buzz``.
        tried: the case; None where it cannot be told.
        other_felt, is_line, turns: as in ``Buzz``; turns are 0 where they were not counted.
        within_s: how long the stretch is.
    """

    case: str
    at_s: float
    gone: bool
    motion_m: float = 0.0
    force_N: float = 0.0
    frequency_Hz: float = 0.0
    times_felt: float = 0.0
    by_force: bool = False
    tried: Case | None = None
    other_felt: float = 0.0
    is_line: bool = True
    turns: int = 0
    within_s: float = 0.0

    @classmethod
    def from_data(cls, data: Mapping[str, Any]) -> Self:
        """Makes it from its form in JSON, by way of ``dataclasses.asdict``; raises TypeError for anything else."""
        case = data.get("tried")
        tried = case and Case(**{**case, "corner": tuple((str(name), factor) for name, factor in case["corner"])})
        return cls(**{**data, "tried": tried})


@dataclass(frozen=True)
class Job:
    """Walls that are tried on one loop, all in the same cases."""

    loop: Scene
    walls: tuple[Tried, ...]
    cases: tuple[Case, ...]

    def as_told(self) -> dict[str, Any]:
        """Returns a readable account of what is tried of its first wall; a loop is identified by digits of its hash."""
        wall = self.walls[0]
        return {
            "wall_N_m": float(f"{wall.stiffness_N_m:.4g}"),
            "elements": [element.as_dict() for element in wall.elements],
            "cases": len(self.cases),
            "first_case": self.cases[0].words if self.cases else "",
            "loop": _digest(repr(self.loop))[:6],
        }


class Store:
    """Failures of walls, or None, by a key made of everything that decides them: a changed scene finds nothing.

    They are kept in a file, one JSON object per line, so that an interrupted advice can be continued; several may add
    to one file. A broken line, as after a kill or on a full disk, is skipped, and its wall tried again.

    Args:
        file: JSON lines, read and added to; None keeps nothing.

    Raises:
        OutputError: the file cannot be read, or added to.
    """

    def __init__(self, file: Path | None = None) -> None:
        self._file, self._version = file, version("haploop")
        self.known: dict[str, Failure | None] = {}
        with self._writable():
            text = file.read_text(encoding="utf-8", errors="replace") if file and file.exists() else ""
        for line in text.split("\n"):
            with contextlib.suppress(ValueError, TypeError, KeyError, AttributeError):
                told = json.loads(line)
                key, fails = str(told["key"]), told["fails"]
                self.known[key] = None if fails is None else Failure.from_data(fails)

    def key(self, loop: Scene, wall: Tried, cases: Sequence[Case]) -> str:
        """Returns the key of a trial: loop, wall, cases and the version of haploop."""
        return _digest(repr((self._version, loop, wall, tuple(cases))))

    def add(self, results: Mapping[str, Failure | None], jobs: Mapping[str, Job]) -> None:
        """Keeps results by their keys, with what was tried for each, on disk at once, as whole lines at the end."""
        self.known |= results
        if not self._file:
            return
        lines = [
            json.dumps(jobs[key].as_told() | {"fails": asdict(failure) if failure else None, "key": key})
            for key, failure in results.items()
        ]
        with self._writable(), self._file.open("a+b") as file:
            size = file.seek(0, os.SEEK_END)
            file.seek(max(0, size - 1))
            after_broken = file.read(1) not in (b"", b"\n")
            file.write("\n".join([""] * after_broken + [*lines, ""]).encode())

    @contextlib.contextmanager
    def _writable(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise OutputError(
                f"{self._file}, which keeps the results of walls tried, cannot be used: {error.strerror}. Make room "
                "or give another directory with --out; with the same one, what is in it already is not tried again."
            ) from error


def _digest(told: str) -> str:
    return hashlib.sha256(told.encode()).hexdigest()[:24]
