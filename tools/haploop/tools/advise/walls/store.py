"""Results of walls that were tried, one line each in a file, so that an interrupted advice goes on."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path

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
        case: in words.
        at_s: end of the stretch in which it was seen.
        gone: whether the device left its limits; the numbers are of no meaning then.
        motion_m, force_N, frequency_Hz, times_felt, by_force: of that stretch, as of ``Buzz``.
    """

    case: str
    at_s: float
    gone: bool
    motion_m: float = 0.0
    force_N: float = 0.0
    frequency_Hz: float = 0.0
    times_felt: float = 0.0
    by_force: bool = False


class Store:
    """What is known of walls, by a key that has everything in it that decides: a changed scene finds nothing.

    Args:
        file: JSON lines, read and added to; None keeps nothing.

    Attributes:
        known: the failure, or None, by key.
    """

    def __init__(self, file: Path | None = None) -> None:
        self._file = file
        self.known: dict[str, Failure | None] = {}
        if file and file.exists():
            lines = file.read_text(encoding="utf-8").split("\n")
            if lines.pop():  # the last line of a run that was killed
                file.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")
            for line in lines:
                key, failure = json.loads(line)
                self.known[key] = Failure(**failure) if failure else None

    def key(self, loop: Scene, wall: Tried, cases: Sequence[Case]) -> str:
        """Returns the key of a trial: loop, wall, cases and the version of haploop."""
        told = repr((version("haploop"), loop, wall, tuple(cases)))
        return hashlib.sha256(told.encode()).hexdigest()[:24]

    def add(self, results: dict[str, Failure | None]) -> None:
        """Keeps results by their keys, on disk at once."""
        self.known |= results
        if self._file:
            with self._file.open("a", encoding="utf-8") as lines:
                for key, failure in results.items():
                    lines.write(json.dumps([key, asdict(failure) if failure else None]) + "\n")
