"""haploop dissipate as its users meet it: what it says, draws and refuses."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.toml_writer import to_toml
from haploop.tools.cli.app import app
from haploop.tools.dissipate.figure import make_figure
from haploop.tools.dissipate.report import conclusion, note_sentences
from haploop.tools.figure.data import FigureError
from helpers.data.recordings import outcome, write
from helpers.scenes.least import KINDS, scene

T = np.arange(3000) * 1e-3
X = 2e-3 * np.sin(2.0 * np.pi * 6.0 * T) + 3e-5 * np.sin(2.0 * np.pi * 180.0 * T)
SQUEEZE = """
from typing import Annotated
from haploop.controller.dissipation import Element, Motion, Quantity

class Squeeze(Element):
    kind = "squeeze"
    damping: Annotated[float, Quantity("N s/m", at_least=0)]

    def force(self, motion: Motion):
        return -2.0 * self.damping * motion.v
"""


def dissipate(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, ["dissipate", *map(str, arguments)])


def refused(result: Result, *words: str) -> None:
    assert result.exit_code == 2, result.output
    assert result.stdout == ""
    assert all(word in result.stderr for word in words), result.stderr


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    return write(tmp_path / "tap.csv", {"t": T, "x": X})


@pytest.fixture
def no_figure(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leaves the drawing out, which takes longer than all else."""

    def undrawn(_outcome: object) -> None:
        raise FigureError("left out")

    monkeypatch.setattr("haploop.tools.dissipate.command.make_figure", undrawn)


@pytest.mark.slow
def test_the_last_line_of_the_table_names_the_figure(recording: Path) -> None:
    result = dissipate(recording, "--damping", "2.7", "--mass", "0.0018")
    assert result.exit_code == 0, result.output
    figure = recording.with_name("tap-dissipate.png")
    assert result.stdout.splitlines()[-1] == str(figure)
    assert figure.stat().st_size > 20_000
    for words in ("damping 2.7 N s/m", "bidirectional inertia 1.80 g", "unidirectional inertia", "3000 samples"):
        assert words in result.stdout


@pytest.mark.slow
def test_json_holds_what_the_table_does_and_the_figure_is_where_it_is_asked_for(
    recording: Path, tmp_path: Path
) -> None:
    data = json.loads(
        dissipate(recording, "--damping", "2.7", "--mass", "0.0018", "--json", "--out", tmp_path / "f.svg").stdout
    )
    assert [element["kind"] for element in data["elements"]] == [
        "damping",
        "bidirectional-inertia",
        "unidirectional-inertia",
    ]
    assert data["elements"][0]["true_J"] == outcome(recording, dampings=["2.7"]).elements[0].true_J
    assert (data["samples"], data["gaps"], data["rate_Hz"]) == (3000, 0, pytest.approx(1000.0))
    assert Path(data["figure"]) == tmp_path / "f.svg"
    assert (tmp_path / "f.svg").exists()


@pytest.mark.usefixtures("no_figure")
def test_numbers_may_carry_units_and_elements_be_of_any_kind(recording: Path, tmp_path: Path) -> None:
    plugin = tmp_path / "squeeze.py"
    plugin.write_text(SQUEEZE)
    elements = ("--damping", "0.0027 N s/mm", "--element", "squeeze damping=1.35", "--plugin", plugin)
    data = json.loads(dissipate(recording, *elements, "--json").stdout)
    damping, squeeze = data["elements"]
    assert damping["parameters"] == {"damping": pytest.approx(2.7), "acts": "always"}
    assert squeeze["true_J"] == pytest.approx(damping["true_J"], rel=1e-12)


@pytest.mark.usefixtures("no_figure")
def test_estimates_are_those_that_are_set(recording: Path) -> None:
    plain, filtered = (
        json.loads(dissipate(recording, "--mass", "0.0018", "--json", *more).stdout)["elements"][0]
        for more in ((), ("--set", "velocity.cutoff=20"))
    )
    assert filtered["strongest_N"] < 0.3 * plain["strongest_N"]


@pytest.mark.usefixtures("no_figure")
def test_the_log_of_a_run_takes_no_more_than_its_directory(tmp_path: Path) -> None:
    made = scene(duration=0.2, hand={"stiffness": 50.0, "force": {"kind": "constant", "value": -1.0}})
    directory = tmp_path / "run"
    directory.mkdir()
    run_in_process(made, KINDS, out=directory, attachments={"scene.toml": to_toml(made.as_dict())})
    (directory / "scene.toml").write_text(to_toml(made.as_dict()))
    for path in (directory, directory / "log.mcap"):
        result = dissipate(path, "--damping", "0.5")
        assert result.exit_code == 0, result.output
        assert "over every step of the plant" in result.stdout


def test_a_log_has_columns_of_its_own(tmp_path: Path) -> None:
    made = scene(duration=0.2)
    (tmp_path / "run").mkdir()
    run_in_process(made, KINDS, out=tmp_path / "run", attachments={"scene.toml": to_toml(made.as_dict())})
    refused(dissipate(tmp_path / "run", "--damping", "1", "--position", "x"), "which are for text files")


def test_an_export_of_a_run_is_a_recording(tmp_path: Path) -> None:
    made = scene(duration=0.2, hand={"stiffness": 50.0, "force": {"kind": "constant", "value": -1.0}})
    directory = tmp_path / "run"
    directory.mkdir()
    run_in_process(made, KINDS, out=directory, attachments={"scene.toml": to_toml(made.as_dict())})
    assert CliRunner().invoke(app, ["export", str(directory), "--to", "csv"]).exit_code == 0
    log, csv = (outcome(directory / name, dampings=["0.5"]).elements[0] for name in ("log.mcap", "controller.csv"))
    assert csv.sampled_J == pytest.approx(log.sampled_J, rel=1e-9)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--damping", "-1"), ["dissipation.0.damping", "at least 0"]),
        (("--damping", "2 kg"), ["dissipation.0.damping"]),
        (("--element", "dampning damping=1"), ["damping"]),
        (("--element", "unidirectional-damping damping=1"), ["--wall"]),
        (("--damping", "1", "--set", "wall.stiffness=100"), ["no meaning here", "[velocity]"]),
        (("--damping", "1", "--set", "velocity.cutof=100"), ["velocity.cutof", "cutoff"]),
        (("--damping", "1", "--velocity", "x", "--set", "velocity.cutoff=10"), ["not both"]),
        (("--damping", "1", "--set", "acceleration.source=accelerometer"), ["--acceleration which column"]),
        (("--damping", "1", "--unit", "0"), ["A unit cannot be 0 m"]),
        (("--damping", "1", "--position", "y"), ["'y'", "There are: t, x"]),
        (("--damping", "1", "--delay", "soon"), ["--delay"]),
        (("--damping", "1", "--delay", "-1"), ["from 0 to 60 s"]),
        (("--damping", "1", "--delay", "nan"), ["from 0 to 60 s"]),
        (("--damping", "1", "--wall", "0", "--occupies", "left"), ["occupies"]),
    ],
)
def test_what_cannot_be_done_is_said_and_nothing_is_written(
    recording: Path, arguments: tuple[str, ...], words: list[str]
) -> None:
    refused(dissipate(recording, *arguments), *words)
    assert not recording.with_name("tap-dissipate.png").exists()


def test_a_recording_that_is_not_there_is_said(tmp_path: Path) -> None:
    refused(dissipate(tmp_path / "no.csv", "--damping", "1"), "no.csv", "No such file")
    refused(dissipate(tmp_path, "--damping", "1"), "holds no log.mcap")


def test_the_figure_draws_the_books_that_the_table_tells(recording: Path) -> None:
    found = outcome(recording, delay_s=1e-3, dampings=["2.7"], masses=["0.0018"])
    figure = make_figure(found)
    lines = {line.get_gid(): line for ax in figure.get_axes() for line in reversed(ax.lines) if line.get_gid()}
    scale = {"µ": 1e-6, "m": 1e-3, "": 1.0, "n": 1e-9}
    (energy,) = [ax for ax in figure.get_axes() if ax.get_title(loc="left").startswith("Energy that")]
    factor = scale[energy.get_ylabel().removeprefix("energy (").removesuffix("J)")]
    for element in found.elements:
        for book in ("true", "sampled"):
            (line,) = [line for line in energy.lines if line.get_gid() == f"{element.label}.{book}"]
            assert np.asarray(line.get_ydata())[-1] * factor == pytest.approx(getattr(element, f"{book}_J"), rel=1e-9)
    assert "position" in lines
    texts = [text.get_text() for ax in figure.get_axes() for text in ax.texts]
    assert {element.label for element in found.elements} <= set(texts)


def test_the_close_view_is_where_most_was_given_back(tmp_path: Path) -> None:
    x = 2e-3 * np.sin(2.0 * np.pi * 3.0 * T)
    x[1500:1600] += 2e-4 * np.sin(2.0 * np.pi * 300.0 * T[1500:1600])  # damping feeds above a quarter of the rate
    close = outcome(write(tmp_path / "jitter.csv", {"t": T, "x": x}), dampings=["2.7"]).trace.close
    assert close is not None
    assert 1.4 < close[0, 0] < 1.6 < close[0, -1] + 0.06 < 1.71


def test_where_nothing_is_given_back_there_is_no_close_view(tmp_path: Path) -> None:
    x = np.linspace(0.0, 1e-2, 500)
    found = outcome(write(tmp_path / "slide.csv", {"t": T[:500], "x": x}), dampings=["2.7"])
    assert found.trace.close is None
    shown = [text.get_text() for ax in make_figure(found).get_axes() for text in ax.texts]
    assert "No element gave anything back." in shown


def test_the_answer_says_who_takes_most_and_who_feeds(tmp_path: Path) -> None:
    slow = write(tmp_path / "slow.csv", {"t": T, "x": 2e-3 * np.sin(2.0 * np.pi * 3.0 * T)})
    fast = write(tmp_path / "fast.csv", {"t": T, "x": 2e-5 * np.sin(2.0 * np.pi * 400.0 * T)})
    assert conclusion(outcome(slow, dampings=["2.7"])).startswith("damping 2.7 N s/m would have dissipated")
    fed = conclusion(outcome(fast, dampings=["2.7"]))
    assert fed.startswith("none of these would have dissipated; all would have fed the motion. Not reliable")
    untouched = outcome(slow, dampings=["2.7"], wall="-20 mm")
    apart = "it stays between −2.00 mm and 2.00 mm, and the wall is below −20.0 mm."
    assert conclusion(untouched) == f"none of these would have given a force on this motion: {apart}"
    assert any("only in contact with the wall" in sentence for sentence in note_sentences(untouched))
    both = conclusion(outcome(slow, dampings=["2.7", "1.35"]))
    assert "2.00 times as much as damping 1.35 N s/m" in both


def test_an_element_whose_quotation_does_not_end_is_refused(recording: Path) -> None:
    refused(dissipate(recording, "--element", 'damping damping="0.5'), "a quotation mark is not closed")


def test_an_element_that_answers_to_the_forces_of_its_loop_is_refused(recording: Path) -> None:
    kind = "passivity-controller"
    result = dissipate(recording, "--element", f"{kind} damping=2")
    refused(result, kind, "forces and energies", "haploop run")


def test_a_scene_is_no_recording_and_is_said_to_be_none(tmp_path):
    (tmp_path / "s.toml").write_text('title = "a scene"\n')
    result = dissipate(tmp_path / "s.toml")
    assert (result.exit_code, "is a scene or a sweep, not a recording" in result.stderr) == (2, True)
