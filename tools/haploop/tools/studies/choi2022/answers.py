"""Answers of long calculations, kept beside the figures: a study that was stopped continues where it was."""

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
# What an answer depends on; of this study everything except its figures, which only draw and report.
_PROGRAM = tuple(
    f"haploop.{name}"
    for name in ["protocol", "plant", "controller", "logger", "launch", "tools.linear", "tools.search"]
)


class Job(NamedTuple):
    """A call whose answer goes to a file."""

    call: Callable[[Any], Any]
    item: Any
    file: Path

    def keep(self) -> None:
        """Computes the answer, and writes the file whole or not at all."""
        unfinished = self.file.with_suffix(f".{os.getpid()}")
        unfinished.write_bytes(pickle.dumps(self.call(self.item)))
        unfinished.replace(self.file)


class Answers:
    """Calls of importable functions in processes; an answer that this program left in the directory is not recomputed.

    Args:
        out: directory of the figures.
        small: whether calculations of seconds are wanted, with fewer runs; their results may differ.
        workers: number of processes; as many as there are cores when None.
    """

    def __init__(self, out: Path, *, small: bool = False, workers: int | None = None, stage: Stage = silent) -> None:
        self.out, self.small, self.workers, self.stage = out, small, workers, stage

    @cached_property
    def folder(self) -> Path:
        """The folder of this program's answers; a different program has a different folder."""
        here = Path(__file__).parent
        scenes = (bundled_folder(name) for name in ("scenes", "hands", "devices"))
        files = [
            *here.glob("*.py"),
            here / "interpretations.toml",
            *(one for of in scenes for one in of.rglob("*.toml")),
        ]
        return self.out / FOLDER / source_digest(_PROGRAM, sorted(files))

    def map_parallel(self, name: str, call: Callable[[Item], Answer], items: Sequence[Item]) -> list[Answer]:
        """Returns what a function returns for each item, in the order of the items.

        Items are distinguished by their ``repr``, which must therefore show all of an item: no arrays.
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
