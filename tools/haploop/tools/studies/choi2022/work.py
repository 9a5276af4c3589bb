"""Where a figure leaves what it made: picture, data, scenes and findings."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from haploop.launch.scene.toml_writer import to_toml
from haploop.tools.figure.style import write_figure
from haploop.tools.render.progress import Stage, silent
from haploop.tools.studies.choi2022.claims import Finding

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from haploop.controller.dissipation import Element


class Work:
    """One figure in the making.

    Args:
        out: directory of all figures.
        number: of the figure.
        small: whether a version of seconds is wanted, with fewer runs; it need not come to the same verdicts.
        workers: processes for many runs; as many as there are cores when None.
        stage: told what goes on.

    Attributes:
        kinds: elements at hand.
        answer: what a builder of devices can take from it, in a sentence or two; empty for what has none.
        caption: what is to be seen, in a sentence or two.
        notes: whole sections in Markdown that go below the figure on the page.
    """

    def __init__(
        self, out: Path, number: int, *, small: bool = False, workers: int | None = None, stage: Stage = silent
    ) -> None:
        from haploop.controller.dissipation import registry

        self.out, self.number, self.small, self.workers, self.stage = out, number, small, workers, stage
        self.kinds: dict[str, type[Element]] = registry()
        self.answer = self.caption = ""
        self.notes: list[str] = []
        self._files: list[str] = []
        self._seen: dict[str, str] = {}

    def path(self, name: str) -> Path:
        """A file of this figure, noted as one that belongs to it."""
        if name not in self._files:
            self._files.append(name)
        return self.out / name

    def figure(self, figure: Figure, name: str, seen: str = "") -> None:
        """Write a picture, ``name`` without its suffix; what is seen on it goes below it."""
        write_figure(figure, self.path(f"{name}.png"))
        self._seen[f"{name}.png"] = seen

    def data(self, name: str, columns: Mapping[str, Any]) -> None:
        """Write arrays by name; the unit stands at the end of each name."""
        arrays: dict[str, Any] = {key: np.asarray(value) for key, value in columns.items()}
        np.savez_compressed(self.path(f"{name}.npz"), **arrays)

    def scene(self, name: str, scene: dict[str, Any]) -> None:
        """Write a resolved scene that runs by itself."""
        self.path(f"{name}.toml").write_text(to_toml(scene), encoding="utf-8")

    def keep(self, title: str, findings: Sequence[Finding]) -> None:
        """Write what the page needs: figure_N.json."""
        kept = {
            "number": self.number,
            "title": title,
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
