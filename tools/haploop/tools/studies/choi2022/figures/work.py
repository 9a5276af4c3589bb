"""A figure while it is being made: its texts and claims, and the files that it writes."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict

import numpy as np
from numpy.typing import ArrayLike

from haploop.launch.scene.toml_writer import to_toml
from haploop.protocol.scene.scene import Scene
from haploop.tools.figure.style import write_figure
from haploop.tools.render.progress import Stage, silent
from haploop.tools.studies.choi2022.answers import Answers
from haploop.tools.studies.choi2022.device import Setup
from haploop.tools.studies.choi2022.experiment import nearest, shares_in
from haploop.tools.studies.choi2022.figures.claims import ASSUMING, FAILS, Claim, Finding, claims_of, texts_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NEAREST = "[the nearest interpretation of the device](#figure-7)"


class Kept(TypedDict):
    """The data of a figure that the page needs, as figure_N.json holds them."""

    number: int
    title: str
    answer: str
    supports: bool
    caption: str
    seen: dict[str, str]
    small: bool
    files: list[str]
    findings: list[dict[str, str]]
    notes: list[str]


class Work(Answers):
    """The means and the results of one figure; its calculations go through ``map_parallel``.

    Attributes:
        texts: texts of the figure by name, its title among them.
        claims: claims that it tests, by name.
        answer: what a builder of devices can take from it, in a sentence or two; empty if there is none.
        supports: whether the answer says that what the paper claims holds.
        caption: what the figure shows, in a sentence or two; that of the texts unless set.
        notes: whole sections in Markdown that go below the figure on the page.
    """

    def __init__(
        self, out: Path, number: int, *, small: bool = False, workers: int | None = None, stage: Stage = silent
    ) -> None:
        super().__init__(out, small=small, workers=workers, stage=stage)
        self.number, self.texts, self.claims = number, texts_of(number), claims_of(number)
        self.answer, self.supports, self.caption = "", False, self.texts.get("caption", "")
        self.notes: list[str] = []
        self._files: list[str] = []
        self._seen: dict[str, str] = {}

    @property
    def nearest(self) -> Setup:
        """The interpretation of the experiments nearest to the paper."""
        return nearest(self)

    def path(self, name: str) -> Path:
        """Returns the path of a file, and records that it belongs to this figure."""
        if name not in self._files:
            self._files.append(name)
        return self.out / name

    def tell(self, name: str, /, **computed: Any) -> str:
        """Returns one of the texts, with computed values in place of the names in braces."""
        return self.texts[name].format(**computed)

    def conclude(self, name: str = "", /, *, supports: bool, **computed: Any) -> None:
        """Sets the answer: the text ``answer``, or of several ``answer_NAME``, which the caller chooses by a rule."""
        self.answer, self.supports = self.tell(f"answer_{name}" if name else "answer", **computed), bool(supports)

    def text(self, name: str, text: str) -> None:
        self.path(name).write_text(text, encoding="utf-8")

    def figure(self, figure: Figure, name: str, seen: str = "") -> None:
        """Writes a picture, ``name`` without its suffix; ``seen`` says what it shows, and goes below it."""
        write_figure(figure, self.path(f"{name}.png"))
        self._seen[f"{name}.png"] = seen

    def data(self, name: str, columns: Mapping[str, ArrayLike]) -> None:
        """Writes arrays by name; each name ends with the unit."""
        arrays = {key: np.asarray(value) for key, value in columns.items()}
        np.savez_compressed(self.path(f"{name}.npz"), allow_pickle=True, **arrays)

    def scene(self, name: str, scene: Scene) -> None:
        self.text(f"{name}.toml", to_toml(scene.as_dict()))

    def findings(self, holding: Mapping[str, bool], /, **computed: Any) -> list[Finding]:
        """Returns findings on claims, given whether each holds under the nearest interpretation of the experiments."""
        return [self.finding(self.claims[name], is_so, **computed) for name, is_so in holding.items()]

    def finding(self, claim: Claim, is_so: bool, /, **computed: Any) -> Finding:
        """Finds that a claim holds under the nearest interpretation, else under others, often or rarely, or not at all.

        Args:
            claim: its assumption is what is assumed besides the nearest interpretation.
            is_so: whether it holds under the nearest.
            computed: values that the claim's words name, for the nearest.
        """
        kept, numbers = shares_in(self.out, self.small), claim.numbers.format(**computed)
        here = NEAREST + claim.assumption.format(**computed) if is_so else ""
        if not (claim.tested and kept):
            return (
                Finding(claim, ASSUMING, numbers, f"{here}, the only one tested")
                if here
                else Finding(claim, FAILS, numbers)
            )
        found = kept["claims"][claim.tested]
        numbers += f". In {found['often']} of {kept['interpretations']} random interpretations"
        another = f"another interpretation, likeliest with {found['likeliest']}" if found["likeliest"] else ""
        return Finding.by_share(claim, numbers, found["share"], here or another)

    def keep(self, findings: Sequence[Finding]) -> None:
        """Writes the data that the page needs: figure_N.json."""
        kept: Kept = {
            "number": self.number,
            "title": self.texts["title"],
            "answer": self.answer,
            "supports": self.supports,
            "caption": self.caption,
            "seen": self._seen,
            "small": self.small,
            "files": self._files,
            "findings": [finding.as_dict() for finding in findings],
            "notes": self.notes,
        }
        text = json.dumps(kept, indent=2, ensure_ascii=False) + "\n"
        (self.out / f"figure_{self.number}.json").write_text(text, encoding="utf-8")
