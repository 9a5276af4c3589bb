"""A figure in the making: the runs of the program behind it, and the files it leaves."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypedDict, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from haploop.controller.dissipation import registry
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.file import load
from haploop.launch.scene.toml_writer import to_toml
from haploop.logger.log.recording import MemoryLog, Recording
from haploop.logger.summary import Summary
from haploop.protocol.scene.scene import Hand, Scene, Wall, by_window
from haploop.tools.cost.grid import scenes_folder
from haploop.tools.executor.executors import make_executor, map_parallel
from haploop.tools.executor.pool import Pool
from haploop.tools.figure.style import write_figure
from haploop.tools.render.progress import Stage, silent
from haploop.tools.search.random import Row
from haploop.tools.studies.choi2022.claims import Finding, texts_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Item = TypeVar("Item")
Answer = TypeVar("Answer")
_LAST_S = 0.5


class Kept(TypedDict):
    """What the page needs of a figure, as figure_N.json holds it."""

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


class Work:
    """The means and the results of one figure.

    Args:
        small: whether a version of seconds is wanted, with fewer runs; it need not come to the same verdicts.
        workers: processes for many runs; as many as there are cores when None.

    Attributes:
        texts: of the figure, by name: its title among them.
        answer: what a builder of devices can take from it, in a sentence or two; empty for what has none.
        supports: whether the answer says that what the paper claims holds.
        caption: what is to be seen, in a sentence or two; that of the texts unless set.
        notes: whole sections in Markdown that go below the figure on the page.
    """

    def __init__(
        self, out: Path, number: int, *, small: bool = False, workers: int | None = None, stage: Stage = silent
    ) -> None:
        self.out, self.number, self.small, self.workers, self.stage = out, number, small, workers, stage
        self.kinds = registry()
        self.texts = texts_of(number)
        self.answer, self.supports, self.caption = "", False, self.texts.get("caption", "")
        self.notes: list[str] = []
        self._files: list[str] = []
        self._seen: dict[str, str] = {}

    def map_parallel(self, name: str, call: Callable[[Item], Answer], items: Sequence[Item]) -> list[Answer]:
        """Returns what an importable function returns for each item, in their order."""
        with make_executor(self.workers) as executor:
            return map_parallel(executor, call, items, self.stage(name, len(items)))

    def run_all(self, name: str, scenes: Sequence[Scene]) -> list[Summary]:
        """Returns the results of scenes without their energy books, in their order."""
        advance = self.stage(name, len(scenes))
        found: dict[int, Summary] = {}
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

    def tell(self, name: str, /, **computed: Any) -> str:
        """Returns one of the texts with what was computed in the place of names in braces."""
        return self.texts[name].format(**computed)

    def conclude(self, name: str = "", /, *, supports: bool, **computed: Any) -> None:
        """Sets the answer: the text ``answer``, or ``answer_NAME`` of several, which the caller chooses by a rule."""
        self.answer, self.supports = self.tell(f"answer_{name}" if name else "answer", **computed), bool(supports)

    def text(self, name: str, text: str) -> None:
        self.path(name).write_text(text, encoding="utf-8")

    def figure(self, figure: Figure, name: str, seen: str = "") -> None:
        """Writes a picture, ``name`` without its suffix; what is seen on it goes below it."""
        write_figure(figure, self.path(f"{name}.png"))
        self._seen[f"{name}.png"] = seen

    def data(self, name: str, columns: Mapping[str, ArrayLike]) -> None:
        """Writes arrays by name; the unit stands at the end of each name."""
        arrays = {key: np.asarray(value) for key, value in columns.items()}
        np.savez_compressed(self.path(f"{name}.npz"), allow_pickle=True, **arrays)

    def table(self, name: str, rows: Sequence[Row]) -> None:
        """Writes rows as Parquet, NaN for what a row does not use; nothing where pyarrow is missing."""
        try:
            import pyarrow
            import pyarrow.parquet
        except ImportError:
            return
        pyarrow.parquet.write_table(pyarrow.Table.from_pylist(list(rows)), self.path(f"{name}.parquet"))

    def scene(self, name: str, scene: Scene) -> None:
        self.text(f"{name}.toml", to_toml(scene.as_dict()))

    def keep(self, findings: Sequence[Finding]) -> None:
        """Writes what the page needs: figure_N.json."""
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


@cache
def shipped(name: str) -> Scene:
    """Returns a scene that comes with haploop, by the name of its file."""
    return load(scenes_folder() / name)


def fig6(panel: str) -> Scene:
    """Returns the scene of a panel of Fig. 6, "a", "b" or "c", in our interpretation."""
    return shipped(f"fig6{panel}.toml")


def wall_of(scene: Scene) -> Wall:
    """Returns the wall of a scene that is known to have one."""
    assert scene.wall
    return scene.wall


def hand_of(scene: Scene) -> Hand:
    """Returns the hand of a scene that is known to have one."""
    assert scene.hand
    return scene.hand


class Run(NamedTuple):
    """A run in this process: its resolved scene, its summary, and its log by channel."""

    scene: Scene
    summary: Summary
    log: Recording


def run(scene: Scene) -> Run:
    """Runs a scene; its verdict is the cheap one, of the last half second alone."""
    memory = MemoryLog()
    summary = run_in_process(by_window(scene), registry(), memory=memory)
    return Run(scene, summary, memory.recording())


def spectrum(log: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Returns frequencies in Hz and amplitudes in m of the position in the last half second, its trend taken out."""
    t, x = log["/plant"]["t"], log["/plant"]["x"]
    last = t >= t[-1] - _LAST_S
    t, x = t[last], x[last]
    x = x - np.polyval(np.polyfit(t - t[0], x, 1), t - t[0])
    window = np.hanning(len(x))
    amplitudes = np.abs(np.fft.rfft(x * window)) / window.sum() * 2.0 * np.sqrt(2.0 / 3.0)
    return np.fft.rfftfreq(len(x), t[1] - t[0]), amplitudes


def strongest_Hz(log: Recording) -> float:
    frequencies, amplitudes = spectrum(log)
    return float(frequencies[np.argmax(amplitudes[1:]) + 1])


def faster_m(log: Recording, frequency_Hz: float) -> float:
    """Returns the root mean square of what of the position is faster than a frequency."""
    frequencies, amplitudes = spectrum(log)
    return float(np.sqrt((amplitudes[frequencies > frequency_Hz] ** 2).sum() / 2.0))
