"""Answers of long calculations, kept beside the figures: a study that was stopped goes on where it was."""

from __future__ import annotations

import os
import pickle
from collections.abc import Callable, Sequence
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from haploop.launch.scene.bundled import bundled_folder
from haploop.tools.executor.executors import make_executor, map_parallel
from haploop.tools.machine import source_digest
from haploop.tools.render.progress import Stage, silent

Item = TypeVar("Item")
Answer = TypeVar("Answer")
FOLDER = "answers"
# What an answer hangs on; of this study all but its figures, which only draw and tell.
_PROGRAM = tuple(
    f"haploop.{name}"
    for name in ["protocol", "plant", "controller", "logger", "launch", "tools.linear", "tools.search"]
)


class Job(NamedTuple):
    """A call of which the answer goes to a file."""

    call: Callable[[Any], Any]
    item: Any
    file: Path

    def keep(self) -> None:
        """Answers, and writes the file whole or not at all."""
        unfinished = self.file.with_suffix(f".{os.getpid()}")
        unfinished.write_bytes(pickle.dumps(self.call(self.item)))
        unfinished.replace(self.file)


class Answers:
    """Calls of importable functions on processes; an answer of the same program in the directory is not asked again.

    Args:
        out: directory of the figures.
        small: whether calculations of seconds are wanted, with fewer runs; they need not come to the same.
        workers: processes; as many as there are cores when None.
    """

    def __init__(self, out: Path, *, small: bool = False, workers: int | None = None, stage: Stage = silent) -> None:
        self.out, self.small, self.workers, self.stage = out, small, workers, stage

    @cached_property
    def folder(self) -> Path:
        """The folder of this program's answers: another program's are another's."""
        here = Path(__file__).parent
        scenes = (bundled_folder(name) for name in ("scenes", "hands", "devices"))
        files = [
            *here.glob("*.py"),
            here / "interpretations.toml",
            *(one for of in scenes for one in of.rglob("*.toml")),
        ]
        return self.out / FOLDER / source_digest(_PROGRAM, sorted(files))

    def map_parallel(self, name: str, call: Callable[[Item], Answer], items: Sequence[Item]) -> list[Answer]:
        """Returns what a function returns for each item, in their order.

        Items are told apart by their ``repr``, which therefore has to say all of them: no arrays.
        """
        assert ".figures." not in call.__module__, "what figures/ computes is not known by its source"
        self.folder.mkdir(parents=True, exist_ok=True)
        whose = f"{call.__module__}.{call.__qualname__}"
        files = [self.folder / sha256(f"{whose} {item!r}".encode()).hexdigest()[:32] for item in items]
        jobs = [Job(call, item, file) for item, file in zip(items, files, strict=True) if not file.exists()]
        advance = self.stage(name, len(jobs))
        with make_executor(self.workers) as executor:
            map_parallel(executor, Job.keep, jobs, advance)
        return [pickle.loads(file.read_bytes()) for file in files]
