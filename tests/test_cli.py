"""The command line as its users meet it: what it prints where, and its exit status."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest
from typer.testing import CliRunner

from haploop.tools.cli.app import app
from haploop.tools.command.options import note_without_numba
from helpers.live.in_process import ask
from helpers.live.launched import HAPLOOP

SCENES = Path(__file__).parents[1] / "launch" / "scenes"
FIG6C = str(SCENES / "fig6c.toml")
BRAKE = '''
from typing import Annotated
from haploop.controller.dissipation import Element, Motion, Quantity, where

class Brake(Element):
    """A force of constant size against the motion, on the way in only."""
    kind = "brake"
    force_N: Annotated[float, Quantity("N", at_least=0)] = 0.05

    def force(self, motion: Motion):
        return where(motion.v * motion.into_wall > 0, self.force_N * -motion.into_wall, 0.0)
'''


def haploop(*arguments: str):
    """Run a command in this process."""
    return CliRunner().invoke(app, list(arguments))


@pytest.fixture(scope="module")
def done(tmp_path_factory) -> Path:
    """A finished run of figure 6(c), shortened."""
    out = tmp_path_factory.mktemp("run") / "out"
    result = haploop("run", FIG6C, "--set", "duration=1.2", "--in-process", "--out", str(out))
    assert result.exit_code == 0, result.output
    return out


def test_json_is_one_object_on_stdout_and_nothing_else_is(tmp_path):
    result = haploop("run", FIG6C, "--set", "duration=0.1", "--json", "--out", str(tmp_path / "o"))
    summary = json.loads(result.stdout)
    assert (result.exit_code, summary["ticks"], summary["ended"]) == (0, 100, "done")
    assert summary["directory"] == str(tmp_path / "o")


def test_the_report_of_a_run_is_on_stdout_with_its_directory_last_and_notes_line_by_line_on_stderr(tmp_path):
    out = str(tmp_path / "o")
    result = haploop("run", FIG6C, "--set", "duration=0.1", "--set", "wall.position=-60", "--in-process", "--out", out)
    assert "no-contact" in result.stdout
    assert result.stdout.splitlines()[-1] == out
    assert result.stderr.startswith("Note: ")
    assert result.stderr.count("\n") == 1


def test_a_run_leaves_scene_log_and_summary_and_its_scene_runs_by_itself(done, tmp_path):
    assert {path.name for path in done.iterdir()} == {"scene.toml", "log.mcap", "summary.json"}
    again = haploop("run", str(done / "scene.toml"), "--in-process", "--json", "--out", str(tmp_path / "again"))
    before = json.loads((done / "summary.json").read_text(encoding="utf-8"))
    assert json.loads(again.stdout)["trajectory_sha256"] == before["trajectory_sha256"]


def test_every_mistake_is_told_at_once_with_exit_status_2_and_nothing_is_written(tmp_path):
    settings = ("wall.stifness=3", "device.mass=-1", "clock.round_trip_delay='2 N'", "dissipation.0.kind=dampin")
    arguments = [word for setting in settings for word in ("--set", setting)]
    result = haploop("run", FIG6C, *arguments, "--out", str(tmp_path / "out"))
    assert result.exit_code == 2
    for words in ("did you mean stiffness", "device.mass", "round_trip_delay", "did you mean damping", "4 mistakes"):
        assert words in result.stderr, words
    assert not (tmp_path / "out").exists()


def test_a_directory_that_holds_a_run_is_refused_and_left_as_it_is(done):
    before = {path: path.read_bytes() for path in done.iterdir()}
    result = haploop("run", FIG6C, "--in-process", "--out", str(done))
    assert result.exit_code == 2
    assert "must be new or empty" in result.stderr
    assert {path: path.read_bytes() for path in done.iterdir()} == before


def test_check_prints_the_resolved_scene_or_the_schema_and_starts_nothing():
    result = haploop("check", FIG6C)
    assert result.exit_code == 0
    assert "stiffness = 150.0" in result.stdout
    schema = json.loads(haploop("check", "--schema").stdout)
    assert schema["$schema"].endswith("2020-12/schema")
    assert haploop("check").exit_code == 2


def test_an_element_that_takes_the_name_of_an_installed_one_is_noted_where_it_is_listed_and_where_it_runs(tmp_path):
    plugin = tmp_path / "brake.py"
    plugin.write_text(BRAKE.replace('"brake"', '"damping"'), encoding="utf-8")
    note = "The element damping comes from a plugin, in place of the installed one."
    assert note in haploop("plugins", "--plugin", str(plugin)).stderr
    changes = ("--set", "dissipation.0.kind=damping", "--set", "duration=0.1", "--plugin", str(plugin))
    run = haploop("run", FIG6C, *changes, "--in-process", "--json", "--out", str(tmp_path / "o"))
    assert note in run.stderr
    assert json.loads(run.stdout)["notes"] == [note]


def test_check_refuses_an_element_that_run_refuses(tmp_path):
    plugin = tmp_path / "brake.py"
    plugin.write_text(BRAKE.replace("return where(", 'raise ValueError("oh dear")\n        return where('))
    done = haploop("check", FIG6C, "--set", "dissipation.0.kind=brake", "--plugin", str(plugin))
    assert done.exit_code == 2
    assert "gave no force when it was tried at rest: ValueError: oh dear" in done.stderr


def test_a_parameter_in_what_is_no_unit_is_refused_where_elements_are_listed_as_where_they_run(tmp_path):
    plugin = tmp_path / "brake.py"
    plugin.write_text(BRAKE.replace('"N"', '"N q/m"'), encoding="utf-8")
    listing = haploop("plugins", "--plugin", str(plugin))
    assert listing.exit_code == 2
    assert "is declared in 'N q/m', which is not a unit" in listing.stderr


def test_a_plugin_of_ten_lines_is_listed_checked_run_and_replayed(tmp_path):
    plugin = tmp_path / "brake.py"
    plugin.write_text(BRAKE, encoding="utf-8")
    listing = json.loads(haploop("plugins", "--plugin", str(plugin), "--json").stdout)
    assert listing["brake"]["force_N"]["unit"] == "N"
    assert listing["brake"]["force_N"]["default"] == 0.05
    assert {"damping", "unidirectional-damping", "bidirectional-inertia", "unidirectional-inertia"} < set(listing)
    run = ("run", FIG6C, "--set", "dissipation.0.kind=brake", "--set", "duration=1.2", "--json")
    assert haploop(*run, "--out", str(tmp_path / "without")).exit_code == 2
    result = haploop(*run, "--plugin", str(plugin), "--out", str(tmp_path / "with"))
    elements = json.loads(result.stdout)["energy"]["elements"]
    assert [element["kind"] for element in elements] == ["brake"]
    words = haploop(*run[:-1], "--plugin", str(plugin), "--in-process", "--out", str(tmp_path / "words")).stdout
    assert "brake (force_N 0.05 N)" in words
    assert elements[0]["true_J"] > 0
    plugin.unlink()
    assert haploop("replay", str(tmp_path / "with")).exit_code == 0


def test_replay_says_whether_every_bit_agreed(done, tmp_path):
    good = haploop("replay", str(done))
    assert good.exit_code == 0
    assert "Every bit of 12000 steps agreed" in good.stdout
    other = tmp_path / "other"
    other.mkdir()
    for path in done.iterdir():
        (other / path.name).write_bytes(path.read_bytes())
    scene = (other / "scene.toml").read_text(encoding="utf-8")
    (other / "scene.toml").write_text(
        scene.replace("stiffness = 150.0", "stiffness = 150.00000000001"), encoding="utf-8"
    )
    bad = haploop("replay", str(other))
    assert bad.exit_code == 1
    assert "scene.toml differs from the scene in the log" in bad.stdout


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("run", "nowhere.toml"), "nowhere.toml"),
        (("run", FIG6C, "--pace", "quick"), "A pace is a number from 1e-06 to 1e+06, or free"),
        (("run", FIG6C, "--pace", "0"), "A pace is a number from"),
        (("run", FIG6C, "--tcp", "0.0.0.0"), "directory of keys"),
        (("run", FIG6C, "--plugin", "nono.py"), "The plugin nono.py does not load: there is no such file."),
        (("compare", "premium15", "runs/b"), "listed by haploop diff premium15 runs/b, and drawn by haploop plot"),
        (("replay", "nowhere"), "nowhere"),
        (("plot", "nowhere"), "nowhere"),
        (("attach", "scope"), "logger, print or plotjuggler"),
        (("swap", "damping", "0.8"), "KEY=VALUE was expected"),
        (("swap", "damping", "damping=0.8", "--at", "soon"), "--at must be a time"),
        (("pause", "--run", "zzzzzz"), "live"),
    ],
)
def test_wrong_use_is_answered_with_a_sentence_and_exit_status_2(arguments, words):
    result = haploop(*arguments)
    assert result.exit_code == 2
    assert words in result.stderr
    assert "Traceback" not in result.output


def test_help_imports_none_of_the_heavy_packages():
    """It has to answer at once: no NumPy, pydantic, ZeroMQ or matplotlib for a list of commands."""
    code = "import sys, haploop.tools.cli.app; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout.split()
    assert not {"numpy", "scipy", "pydantic", "pint", "zmq", "msgpack", "matplotlib", "mcap"} & set(loaded)


def test_the_launcher_of_a_run_waits_for_no_numpy():
    """Its processes wait for it: what only the verdict after the run needs is imported then."""
    code = "import sys, haploop.launch.processes.supervisor, haploop.launch.runs.start; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout.split()
    assert "haploop.launch.scene.models" in loaded
    assert not {"numpy", "scipy", "pint", "mcap"} & set(loaded)


def test_version_and_both_forms_of_help_are_answered():
    assert haploop("--version").stdout == f"haploop {version('haploop')}\n"
    assert haploop("run", "-h").stdout == haploop("run", "--help").stdout


def test_the_list_of_commands_says_of_each_a_whole_sentence():
    told = haploop("--help").stdout.partition("Commands:")[2]
    assert "..." not in told
    assert all(len(line) <= 80 for line in told.splitlines())


@pytest.mark.parametrize("words", [("step", "1.5"), ("step", "1e18"), ("step", "-x"), ("pace", "-1"), ("pace", "-x")])
def test_a_number_that_cannot_be_one_is_refused_in_the_words_of_the_program(words):
    result = haploop(*words)
    assert result.exit_code == 2
    assert f"{words[1].replace('-1', '-1.0')}" in result.stderr
    assert result.stderr.startswith(f"A {words[0]} ")


def test_the_help_of_run_is_all_that_a_process_of_it_writes() -> None:
    """Not only within this process: what is started early must not be taken for something else at the end."""
    done = subprocess.run([sys.executable, "-m", "haploop.tools.cli", "run", "--help"], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("Usage:")


def test_mistakes_are_told_as_json_too(tmp_path):
    (tmp_path / "bad.toml").write_text("[wall]\nstifness = 3\n", encoding="utf-8")
    told = haploop("check", str(tmp_path / "bad.toml"), "--json")
    mistakes = json.loads(told.stdout)["mistakes"]
    assert told.exit_code == 2
    assert any("did you mean stiffness?" in mistake for mistake in mistakes)
    assert all(mistake in told.stderr for mistake in mistakes)


@pytest.mark.slow
@pytest.mark.parametrize("encoding", ["latin-1", "cp1252", "ascii"])
def test_a_terminal_that_has_not_every_letter_gets_the_report_all_the_same(encoding: str, tmp_path: Path) -> None:
    words = ["run", "fig6c", "--set", "duration=0.1", "--in-process", "--out", str(tmp_path / "out")]
    done = subprocess.run(
        [*HAPLOOP, *words], capture_output=True, env={**os.environ, "PYTHONIOENCODING": encoding}, check=False
    )
    assert (done.returncode, b"Traceback" in done.stderr) == (0, False), done.stderr
    assert done.stdout.decode(encoding).splitlines()[-1] == str(tmp_path / "out")


def test_a_name_that_would_steer_the_terminal_is_refused() -> None:
    done = CliRunner().invoke(app, ["check", "fig6c", "--set", "title=a\x1b[31mred"])
    assert done.exit_code == 2
    assert "title is" in done.stderr
    assert "It must be one line of letters that can be printed." in done.stderr
    assert "\x1b" not in done.stderr


def test_without_numba_many_runs_begin_with_a_note_and_with_it_without(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "numba", None)
    note_without_numba()
    assert "pip install 'haploop[numba]'" in capsys.readouterr().err
    monkeypatch.setattr("importlib.util.find_spec", lambda name: name)
    note_without_numba()
    assert capsys.readouterr().err == ""


@pytest.mark.slow
def test_a_command_leaves_the_signals_of_the_program_that_called_it_as_they_were(tmp_path: Path) -> None:
    before = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    for words in (["run", "fig6c", "--set", "duration=0.01", "--out", str(tmp_path / "out")], ["run", "nowhere"]):
        assert not ask(*words).fault
        assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)] == before
