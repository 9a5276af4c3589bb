"""The files of a run, read back after somebody or something else had them."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from haploop.launch.runs.replay import ReplayError, replay
from haploop.launch.runs.run_files import recorded_scene, recorded_summary
from haploop.launch.runs.start import prepare, run
from haploop.launch.scene.mistakes import SceneError
from haploop.logger import read
from haploop.logger.log import LogError
from haploop.tools.figure.data import FigureError, RunData
from helpers.scenes.brake import source

FIG6C = Path(__file__).parents[2] / "launch" / "scenes" / "fig6c.toml"


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("made")
    (folder / "brake.py").write_text(source())
    sets = ["duration=0.3", "run.verdict=window", 'dissipation=[{kind="brake",damping=0.1}]']
    run(prepare(FIG6C, sets, [folder / "brake.py"], folder / "run"), in_process=True)
    return folder / "run"


@pytest.fixture
def directory(made: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "run"))


def change_summary(directory: Path, change: Callable[[dict], object]) -> None:
    path = directory / "summary.json"
    summary = json.loads(path.read_text())
    change(summary)
    path.write_text(json.dumps(summary))


def test_a_long_run_that_was_not_judged_is_repeated_without_comparing_its_verdict(tmp_path, monkeypatch):
    """Every healthy run of processes of more than 60 s was said to differ."""
    run(prepare(FIG6C, ["duration=0.3"], out=tmp_path / "run"), in_process=True)
    monkeypatch.setattr("haploop.launch.runs.replay.REPEATED_S", 0.2)
    assert replay(tmp_path / "run").differences == []
    path = tmp_path / "run/summary.json"
    summary = json.loads(path.read_text())
    del summary["stability"], summary["checksum"]
    path.write_text(json.dumps({**summary, "verdict": "swinging"}))
    assert replay(tmp_path / "run").differences == []
    monkeypatch.setattr("haploop.launch.runs.replay.REPEATED_S", 60.0)
    told = replay(tmp_path / "run").differences
    assert told == ["verdict of the summary differs.", "stability of the summary differs."]


def test_a_number_changed_in_the_summary_is_refused_by_its_checksum(directory):
    change_summary(directory, lambda summary: summary["window"].update(oscillation_m=1.0))
    for reader in (recorded_summary, replay, RunData.from_directory):
        with pytest.raises(LogError, match="does not match its checksum"):
            reader(directory)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "is not a JSON object that haploop wrote"),
        ("[]", "is not a JSON object that haploop wrote"),
        ("[" * 100_000, "is not a JSON object that haploop wrote"),
        ('{"ended": "done", "versions": {"haploop": "0.0.9"}}', "verdict is missing .* written by version 0.0.9"),
        ('{"ended": 3}', "ended is missing or of the wrong type"),
    ],
)
def test_a_summary_of_something_else_is_refused_with_what_it_lacks(directory, text, sentence):
    (directory / "summary.json").write_text(text)
    with pytest.raises(LogError, match=sentence):
        recorded_summary(directory)


def test_the_scene_of_a_run_is_that_of_its_log_whatever_became_of_the_file_beside_it(directory):
    before, path = RunData.from_directory(directory).scene, directory / "scene.toml"
    path.write_text(path.read_text().replace("stiffness = 150.0", "stiffness = 950.0"))
    assert RunData.from_directory(directory).scene == before
    assert [line for line in replay(directory).differences if "differs from the scene in the log" in line]
    path.unlink()
    assert RunData.from_directory(directory).scene == before
    assert [line for line in replay(directory).differences if "cannot be read: No such file" in line]


def test_a_scene_is_shown_without_the_plugin_it_names_and_not_repeated_without_it(directory):
    [plugin] = (directory / "plugins").iterdir()
    plugin.write_text(plugin.read_text().replace("-self.damping", "-2 * self.damping"))
    with pytest.raises(ReplayError, match="has changed since the run was made"):
        replay(directory)
    plugin.unlink()
    assert RunData.from_directory(directory).scene.dissipation[0].parameters == {"damping": 0.1}
    with pytest.raises(ReplayError, match="is missing; the run cannot be repeated without its plugin"):
        replay(directory)


def test_a_scene_that_is_none_is_refused_with_its_mistakes(directory):
    with pytest.raises(SceneError, match="The scene in the log is not TOML"):
        recorded_scene(directory, {"scene.toml": b"\xff"})
    with pytest.raises(SceneError, match="newer is not a key of a scene"):
        recorded_scene(directory, {"scene.toml": (directory / "scene.toml").read_bytes() + b"[newer]\n"})
    assert recorded_scene(directory / "nowhere", {}) is None


def test_a_log_without_a_tick_is_said_to_hold_none(directory):
    log = directory / "log.mcap"
    log.write_bytes(log.read_bytes()[: log.read_bytes().index(b"\x06") + 40])
    assert not any(len(next(iter(table.values()))) for topic, table in read(directory).items() if topic != "/events")
    with pytest.raises(ReplayError, match=r"holds no tick, so there is nothing to repeat\. .* was cut off"):
        replay(directory)
    with pytest.raises(FigureError, match=r"holds no tick, so there is nothing to draw\. .* was cut off"):
        RunData.from_directory(directory)


def test_a_repeated_log_that_was_cut_says_so(directory):
    log = directory / "log.mcap"
    log.write_bytes(log.read_bytes()[:-300])
    (directory / "summary.json").unlink()
    again = replay(directory)
    assert (again.differences, again.summary["ticks"]) == ([], 300)
    assert "was cut off or is still being written" in again.cut
