"""README and the tutorials, followed to the letter: commands run, files are taken, what they quote comes out."""

from __future__ import annotations

import json
import math
import os
import re
import signal
import subprocess
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from haploop.launch.processes import run_directory
from haploop.tools.sweep.table import read as read_table
from helpers.documented import LIVE, Block, blocks, commands
from helpers.live.launched import HAPLOOP, PATIENT
from helpers.live.waiting import PATIENCE_S, wait_for

pytestmark = [pytest.mark.slow, pytest.mark.long]

HOUSE = Path(__file__).parents[1]
TUTORIALS = HOUSE / "docs/tutorials"
# A run that others are to meet goes on for long enough, in real time; it is stopped at the end of its block.
GOES_ON = ("--set", "duration=600", "--pace", "1", "--set", PATIENT)
# A command may have to compile, and a sweep takes half a minute on a machine with nothing else to do.
COMMAND_PATIENCE_S = 900.0
# What waits for the next run, or for the page of a run to be closed, is ended by Ctrl-C.
STAYS = {"--view", "plotjuggler"}
# What takes minutes is left out.
MINUTES = ("advise",)
TAP = [f"{k / 1000},{math.sin(2 * math.pi * k / 1000) + 0.5 * math.sin(50 * math.pi * k / 1000)}" for k in range(3000)]
# Files that a reader has.
OWN_FILES = {
    "tap.csv": "\n".join(["t (s),x (mm)", *TAP, ""]),
    "push.csv": "t (ms), F [mN]\n0,0\n500,-600\n",
}


def text_of(document: Path) -> str:
    """A document with every paragraph in one line, but for its blocks of code."""
    parts = re.split(r"(^```.*?^```$)", document.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    return "".join(part if part.startswith("```") else re.sub(r"(?<=\S)\n(?=\S)", " ", part) for part in parts)


README = text_of(HOUSE / "README.md")


def nodes() -> list[str]:
    """The roles of the nodes of the run that is live; none if there is none yet, or no more."""
    with suppress(run_directory.RunNotFound, run_directory.CommandRefused):
        _, status = run_directory.ask(run_directory.find(None), "status")
        return [node["role"] for node in status["nodes"]]
    return []


class Reader:
    """Somebody who does what a document says, in a folder of their own.

    Attributes:
        folder: where they are.
        said: what every command printed on stdout, by its words.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.said: dict[str, str] = {}
        self._going: list[tuple[list[str], subprocess.Popen[bytes]]] = []
        self._scene = ""
        for name, text in OWN_FILES.items():
            (folder / name).write_text(text, encoding="utf-8")

    def does(self, document: Path) -> None:
        """Goes through a document, block by block."""
        for block in blocks(document.read_text(encoding="utf-8")):
            if block.language == "toml":
                self._writes(block.text)
            elif block.language == "python":
                self._keeps(block.text)
            else:
                self._types(block)

    def _writes(self, toml: str) -> None:
        """Writes a scene and runs it, or a sweep; tables without a device are laid over the last whole scene."""
        file = f"block{len(list(self.folder.glob('block*.toml')))}.toml"
        if "[axes]" in toml:
            (self.folder / file).write_text(toml, encoding="utf-8")
            self.runs(["sweep", file, "--out", f"runs/{file}"])
            self.runs(["plot", f"runs/{file}"])
            return
        is_whole = re.search(r"^(\[device\]|extends)", toml, re.MULTILINE)
        (self.folder / file).write_text(toml if is_whole else f'extends = "{self._scene}"\n{toml}', encoding="utf-8")
        self._scene = file if is_whole else self._scene
        self.runs(["check", file])
        self.runs(["run", file, "--out", f"runs/{file}"])

    def _keeps(self, code: str) -> None:
        """Keeps a class of the reader's own in the file that the next commands name."""
        if kind := re.search(r'^    kind = "([\w-]+)"', code, re.MULTILINE):
            (self.folder / f"{kind[1]}.py").write_text(code, encoding="utf-8")

    def _types(self, block: Block) -> None:
        """Runs the commands of a block; what steers a run does so while one goes on, and stops it last."""
        words = [one for one in commands(block) if one[0] not in MINUTES]
        live = [one for one in words if one[0] in LIVE]
        starts = [one for one in words if one[0] == "run" and live][-1:]
        for one in words:
            if one not in (*live, *starts):
                self.runs(one)
        if live:
            if not (self.folder / "my.toml").exists():
                self.runs(["new", "my.toml"])
            self._steers(starts[0] if starts else ["run", "my.toml"], live)

    def _steers(self, run: list[str], live: list[list[str]]) -> None:
        self._starts([*run, *GOES_ON])
        wait_for("the run", lambda: "controller" in nodes())
        joined = [one for one in live if one[0] == "attach"]
        for one in joined:
            before = len(nodes())
            self._starts([*one, "--port", "0"] if "plotjuggler" in one else one)
            wait_for(" ".join(one), lambda before=before: len(nodes()) > before)
        for one in live:
            if one[0] not in ("attach", "stop"):
                self.runs(one)
        self.runs(["stop"])
        wait_for("the end of the run", lambda: not nodes())
        for words, process in self._going:
            said = self._told(words)
            if "--view" in words:
                wait_for("the word that the page stays", lambda said=said: "The run is over" in said.read_text())
            if STAYS & {*words}:
                process.send_signal(signal.SIGINT)
            assert process.wait(PATIENCE_S) == 0, (words, said.read_text())
        self._going.clear()

    def _starts(self, words: list[str]) -> None:
        with self._told(words).open("w") as told:
            made = subprocess.Popen([*HAPLOOP, *words], cwd=self.folder, stdout=subprocess.DEVNULL, stderr=told)
        self._going.append((words, made))

    def _told(self, words: list[str]) -> Path:
        """The file that has what a command of these words told on stderr."""
        return self.folder / f"{words[0]}-{words[1]}.txt"

    def _call(self, words: list[str], patience_s: float = PATIENCE_S) -> subprocess.CompletedProcess[str]:
        given = [*HAPLOOP, *words]
        return subprocess.run(given, cwd=self.folder, capture_output=True, text=True, timeout=patience_s)

    def runs(self, words: list[str], patience_s: float = COMMAND_PATIENCE_S) -> str:
        """Runs a command to its end, which must be in order; ``runs/...`` is the last run there is."""
        made = sorted(self.folder.glob("runs/*/log.mcap"), key=os.path.getmtime)
        given = [str(made[-1].parent) if word == "runs/..." else word for word in words]
        done = self._call(given, patience_s)
        assert done.returncode == 0, f"haploop {' '.join(words)}: {done.stderr}"
        self.said[" ".join(words)] = done.stdout
        return done.stdout

    def clear_away(self) -> None:
        """Leaves no process behind."""
        for _, process in self._going:
            process.terminate()
            process.wait(PATIENCE_S)


@pytest.fixture
def reader(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Reader]:
    """A reader whose browser opens nothing."""
    monkeypatch.setenv("BROWSER", "true")
    made = Reader(tmp_path)
    yield made
    made.clear_away()


@pytest.mark.parametrize("name", ["own_device", "own_element", "study"])
def test_all_that_a_tutorial_tells_to_type_and_to_write_runs(name: str, reader: Reader) -> None:
    reader.does(TUTORIALS / f"{name}.md")
    assert reader.said


def test_the_first_scene_does_what_its_tutorial_says(reader: Reader) -> None:
    reader.does(TUTORIALS / "first_scene.md")
    said, text = reader.said, text_of(TUTORIALS / "first_scene.md")
    assert "Its last line names the directory" in text
    directory = reader.folder / said["run my.toml"].splitlines()[-1]
    assert "log.mcap, summary.json and scene.toml in runs/" in text
    assert {path.name for path in directory.iterdir()} >= {"log.mcap", "summary.json", "scene.toml"}
    assert "does every bit agree?" in text
    assert said["replay runs/..."].startswith("Every bit of ")
    assert "one count of the encoder comes to" in text
    assert "effect of one encoder count" in said["explain my.toml"]
    assert said["plot runs/..."].splitlines()[-1].endswith("figure.png")


def test_a_recording_that_buzzes_is_told_first_with_its_frequency(reader: Reader) -> None:
    reader.does(TUTORIALS / "recording.md")
    [said] = reader.said.values()
    assert "First it says whether the recording buzzes" in text_of(TUTORIALS / "recording.md")
    first = " ".join(said.split("\n\n")[0].split())
    assert re.search(r"buzzes.*25(\.0)? Hz", first), first


def test_readme_shows_what_its_walk_comes_to(reader: Reader) -> None:
    reader.does(HOUSE / "README.md")
    said = reader.said
    picture = said["demo"].splitlines()[-1]
    assert "the last line names the picture" in README
    assert (reader.folder / picture).is_file()
    wall, late = figures(r"a PHANToM Premium 1.5 against a wall of ([\d.]+) N/mm that answers after ([\d.]+) ms")
    assert f"a wall of {wall:g} N/mm that answers after {late:g} ms" in said["demo"]
    assert "The report and the figure say `limit-cycle`, how wide and at how many hertz" in README
    report = said["run demo --set event=[] --out runs/buzz"]
    assert re.match(r"limit-cycle\b", report)
    assert re.search(r"[\d.]+ mm .*at [\d.]+ Hz", report)
    summary = json.loads((reader.folder / "runs/buzz/summary.json").read_text(encoding="utf-8"))
    leak = summary["energy"]["wall"]["leak"]
    assert "most of the energy that the wall generates is caused by the delay" in README
    assert "Quantisation has no part in it." in README
    assert "without the delay it rests; without quantisation, friction or the actuator's limits it swings on" in README
    parts = ("actuator limits", "friction", "quantisation", "sampling and hold")
    assert summary["stability"]["without"] == {"round-trip delay": "rests"} | dict.fromkeys(parts, "swings on")
    assert leak["delay_J"] < 0.5 * leak["total_J"] < 0.0
    assert leak["quantisation_J"] > 0.01 * leak["total_J"]
    check_map(reader)


def figures(words: str) -> list[float]:
    """The numbers of a sentence of README, which must stand there."""
    found = re.search(words, README)
    assert found, words
    return [float(number) for number in found.groups()]


def check_map(reader: Reader) -> None:
    """Checks what README says of the map of step 3."""
    (cells,) = figures(r"A sweep runs a scene over two axes \((\d+) cells")
    stiffness_N_mm, damping = figures(r"At ([\d.]+) N/mm, ([\d.]+) N s/m of damping is enough in this scene")
    table = read_table(reader.folder / "runs/damping")
    assert len(table["verdict"]) == cells
    keys = zip(table["wall.stiffness"], table["dissipation.0.damping"], strict=True)
    found = {(round(k), round(b, 3)): place for place, (k, b) in enumerate(keys)}
    assert table["verdict"][found[round(1e3 * stiffness_N_mm), damping]] == "steady"
    assert "the map marks every steady cell as held by friction alone" in README
    steady = [
        str(of) for word, of in zip(table["verdict"], table["stability.provisos"], strict=True) if word == "steady"
    ]
    assert steady
    assert all("only friction holds it" in provisos for provisos in steady)


def test_a_command_that_does_not_run_a_file_that_is_none_and_a_wrong_figure_are_found(reader: Reader) -> None:
    follow: list[Callable[[], Any]] = [
        lambda: reader._types(Block("", "haploop run nowhere.toml\n")),
        lambda: reader._writes('title = "no device"\n[device]\nmas = 0.1\n'),
        lambda: figures("The answer is 9.99 N/mm"),
    ]
    for one in follow:
        with pytest.raises(AssertionError):
            one()
