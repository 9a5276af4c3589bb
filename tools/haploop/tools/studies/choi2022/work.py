"""A figure in the making, and the files it leaves: pictures, data, scenes and findings."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from haploop.controller.dissipation import registry
from haploop.launch.scene.toml_writer import to_toml
from haploop.tools.executor.executors import make_executor, map_parallel
from haploop.tools.executor.pool import Pool
from haploop.tools.figure.style import write_figure
from haploop.tools.render.progress import Stage, silent
from haploop.tools.studies.choi2022.claims import Finding, texts_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Item = TypeVar("Item")
Answer = TypeVar("Answer")


class Work:
    """The means and the results of one figure.

    Args:
        out: directory of all figures.
        number: of the figure.
        small: whether a version of seconds is wanted, with fewer runs; it need not come to the same verdicts.
        workers: processes for many runs; as many as there are cores when None.
        stage: shows the progress of many runs.

    Attributes:
        kinds: classes of elements, by name.
        texts: of the figure, by name: its title among them.
        answer: what a builder of devices can take from it, in a sentence or two; empty for what has none.
        caption: what is to be seen, in a sentence or two; that of the texts unless set.
        notes: whole sections in Markdown that go below the figure on the page.
    """

    def __init__(
        self, out: Path, number: int, *, small: bool = False, workers: int | None = None, stage: Stage = silent
    ) -> None:
        self.out, self.number, self.small, self.workers, self.stage = out, number, small, workers, stage
        self.kinds = registry()
        self.texts = texts_of(number)
        self.answer, self.caption = "", self.texts.get("caption", "")
        self.notes: list[str] = []
        self._files: list[str] = []
        self._seen: dict[str, str] = {}

    def map_parallel(self, name: str, call: Callable[[Item], Answer], items: Sequence[Item]) -> list[Answer]:
        """Returns what an importable function returns for each item, in their order."""
        with make_executor(self.workers) as executor:
            return map_parallel(executor, call, items, self.stage(name, len(items)))

    def run_all(self, name: str, scenes: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
        """Returns the results of scenes without their energy books, in their order."""
        advance = self.stage(name, len(scenes))
        found: dict[int, dict[str, Any]] = {}
        with Pool(self.workers) as pool:
            for index, result in pool.results(scenes, energy=False):
                found[index] = result
                advance()
        return [found[index] for index in range(len(scenes))]

    def path(self, name: str) -> Path:
        """Returns the path of a file, noted as one that belongs to this figure."""
        if name not in self._files:
            self._files.append(name)
        return self.out / name

    def tell(self, name: str, **computed: Any) -> str:
        """Returns one of the texts with what was computed in the place of names in braces."""
        return self.texts[name].format(**computed)

    def text(self, name: str, text: str) -> None:
        """Writes a text file."""
        self.path(name).write_text(text, encoding="utf-8")

    def figure(self, figure: Figure, name: str, seen: str = "") -> None:
        """Writes a picture, ``name`` without its suffix; what is seen on it goes below it."""
        write_figure(figure, self.path(f"{name}.png"))
        self._seen[f"{name}.png"] = seen

    def data(self, name: str, columns: Mapping[str, Any]) -> None:
        """Writes arrays by name; the unit stands at the end of each name."""
        arrays: dict[str, Any] = {key: np.asarray(value) for key, value in columns.items()}
        np.savez_compressed(self.path(f"{name}.npz"), **arrays)

    def scene(self, name: str, scene: dict[str, Any]) -> None:
        """Writes a resolved scene that runs by itself."""
        self.text(f"{name}.toml", to_toml(scene))

    def keep(self, findings: Sequence[Finding]) -> None:
        """Writes what the page needs: figure_N.json."""
        kept = {
            "number": self.number,
            "title": self.texts["title"],
            "answer": self.answer,
            "caption": self.caption,
            "seen": self._seen,
            "small": self.small,
            "files": self._files,
            "findings": [finding.as_dict() for finding in findings],
            "notes": self.notes,
        }
        text = json.dumps(kept, indent=2, ensure_ascii=False) + "\n"
        (self.out / f"figure_{self.number}.json").write_text(text, encoding="utf-8")
