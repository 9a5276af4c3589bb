"""haploop.api: the bits of the command line, a live loop steered from Python, arrays, and names that are none."""

from __future__ import annotations

import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import haploop.api
from haploop.api import attach, dissipate, load, plot, read, run, start, sweep
from haploop.launch.processes.run_directory import CommandRefused, RunNotFound
from haploop.launch.scene.mistakes import SceneError
from haploop.launch.spec import RunFailed
from haploop.logger.summary import read as read_summary
from haploop.tools.cli.app import app
from haploop.tools.figure.data import FigureError
from helpers.live.launched import SCENES
from helpers.live.waiting import PATIENCE_S, wait_for
from helpers.scenes.brake import source

# Begins inside the wall.
SHORT = {"duration": 0.3, "device.position": -0.0605}


def test_the_front_door_imports_nothing_before_it_is_used_and_tells_the_nearest_of_a_wrong_name() -> None:
    code = "import sys, haploop.api; print({'numpy', 'pydantic', 'zmq', 'mcap', 'pint', 'difflib'} & set(sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "set()\n"
    assert sorted(haploop.api.__all__) == dir(haploop.api)
    assert all(getattr(haploop.api, name) for name in haploop.api.__all__)
    with pytest.raises(AttributeError, match=r"no dissipat \(did you mean dissipate\?\)"):
        _ = haploop.api.dissipat


def test_every_bit_is_that_of_the_command_line(tmp_path: Path) -> None:
    words = [word for key, value in SHORT.items() for word in ("--set", f"{key}={value}")]
    CliRunner().invoke(app, ["run", "fig6c", *words, "--in-process", "--out", str(tmp_path / "there")])
    here = run(load("fig6c", SHORT), tmp_path / "here")
    there = read_summary(tmp_path / "there" / "summary.json")
    assert here.summary["trajectory_sha256"] == there["trajectory_sha256"]
    assert np.array_equal(here["/plant"]["x"], read(tmp_path / "there")["/plant"]["x"])


def test_a_wrong_quantity_is_told_with_the_nearest() -> None:
    result = run(load("fig6c", SHORT))
    with pytest.raises(KeyError, match=r"window.oscilation_m in the summary \(did you mean window.oscillation_m\?\)"):
        result.quantity("window.oscilation_m")
    with pytest.raises(KeyError, match="no number xyz in the summary; it has seed, "):
        result.quantity("xyz")
    with pytest.raises(KeyError, match=r"no channel /plnt in this log \(did you mean /plant\?\)"):
        result["/plnt"]
    with pytest.raises(KeyError, match=r"no column forse \(did you mean force\?\)"):
        result["/plant"]["forse"]
    with pytest.raises(SceneError, match=r"^values: wall.stifness is not a key of \[wall\]; did you mean stiffness\?"):
        load("fig6c", {"wall.stifness": 1})
    with pytest.raises(SceneError, match=r"^values: duration is -1\."):
        result.scene.set({"duration": -1})
    with pytest.raises(ValueError, match="kept in memory only"):
        plot(result)


def test_elements_on_a_recorded_motion_take_what_the_formula_says(tmp_path: Path) -> None:
    """Damping at constant speed takes b v times the way, but for its first sample, of which no speed is known."""
    recording = tmp_path / "way.csv"
    recording.write_text("t,x\n" + "".join(f"{k * 1e-3:.3f},{k * 1e-4:.4f}\n" for k in range(1001)), encoding="utf-8")
    [damping] = dissipate(recording, damping=[2.0]).elements
    assert damping.true_J == pytest.approx(2.0 * 0.1 * 0.1, rel=2e-3)
    assert dissipate(recording, damping=["0.002 N s/mm"]).elements[0].true_J == damping.true_J

    assert dissipate(recording, damping=2.0).elements[0].true_J == damping.true_J
    assert dissipate(recording, damping="2 N s/m").elements[0].true_J == damping.true_J
    assert len(dissipate(recording, damping=np.array([1.0, 2.0])).elements) == 2
    for values in ({"velocity.cutoff": "50 Hz"}, ["velocity.cutoff=50"]):
        assert dissipate(recording, damping=2.0, values=values).scene.estimate("velocity").cutoff == 50.0


@pytest.mark.slow
def test_one_run_or_several_are_drawn_and_a_sweep_is_drawn_by_itself(tmp_path: Path) -> None:
    scene = load("fig6c", SHORT)
    one, other = (run(scene.set({"wall.stiffness": k}), tmp_path / str(k)) for k in (150, 200))
    assert plot(one) == tmp_path / "150" / "figure.png"
    assert plot([one, other], tmp_path / "both.svg").stat().st_size > 1000
    with pytest.raises(FigureError, match="There is no run to draw"):
        plot([])
    with pytest.raises(ValueError, match="kept in memory only"):
        plot([one, run(scene)])


def test_arrays_of_numpy_are_a_recorded_force() -> None:
    times, forces = np.linspace(0.0, 0.2, 5), -np.ones(5)
    scene = load("fig6c", {**SHORT, "hand.force": {"kind": "trace", "time": times, "force": forces}})
    assert scene["hand.force.time"] == times.tolist()
    assert scene.set({"hand.force.force": 2 * forces})["hand.force.force"] == [-2.0] * 5


@pytest.mark.slow
def test_a_live_loop_is_steered_to_the_bits_of_the_same_change_written_in_the_scene(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = load("fig6b", SHORT)
    monkeypatch.chdir(tmp_path)
    with start(scene, "out", paused=True) as loop:
        other = attach(loop.id[:4])
        assert other.id == loop.id
        monkeypatch.chdir("/")  # a relative directory stays where it was
        for timeout_s in (0.01, None):
            with pytest.raises(CommandRefused, match=r"paused at tick 0 and does not end by itself: resume\(\)"):
                loop.wait(timeout_s)
        for wrong in ("wall.stiffness", ["wall.stiffness=2 N/mm"]):
            with pytest.raises(TypeError, match=r'set by key: set\(\{"wall.stiffness": 200\}\)'):
                loop.set(wrong, 3)  # pyright: ignore[reportArgumentType]
        with pytest.raises(ValueError, match=r"N is a force; a time was expected, such as s\."):
            loop.swap("damping", at="2 N", damping=1.0)
        assert loop.step(100) == 100
        seen = loop.status()["status"]
        assert seen.get("verdict", "undecided") == "undecided"  # less than half a second of it
        with pytest.raises(CommandRefused, match="did you mean damping"):
            loop.swap("dampin", damping=1.0)
        tick = loop.swap("unidirectional-inertia", mass="10 g")
        changed = loop.set({"wall.stiffness": 500})
        assert loop.undo() == changed
        loop.set({"wall.stiffness": 500}, at="250 ms")
        assert loop.undo() is None
        loop.set({"wall.stiffness": "0.2 N/mm"}, at="200 ms")
        live = loop.finish()
        assert loop.wait() is live
        assert other.wait(PATIENCE_S).summary == live.summary
        with pytest.raises(RunNotFound):
            loop.pause()
    with start("fig6b", pace=0.01) as left:
        pass
    with pytest.raises(RunNotFound, match=r"was ended with its with block .* start\(scene, out=\.\.\.\)"):
        left.wait()
    with start("fig6b", pace=0.01) as slow, pytest.raises(TimeoutError, match=r"is still running after 0\.01 s"):
        slow.wait(0.01)
    written = scene.swap("unidirectional-inertia", at=tick * 1e-3, mass=0.01).set({"wall.stiffness": 200}, at=0.2)
    assert live.summary["trajectory_sha256"] == run(written).summary["trajectory_sha256"]
    assert live.directory == tmp_path / "out"
    assert live["/plant"]["x"].dtype == np.float64


@pytest.mark.slow
def test_a_plugin_that_was_edited_is_loaded_anew_from_python(tmp_path: Path) -> None:
    plugin, scene = tmp_path / "brake.py", tmp_path / "scene.toml"
    plugin.write_text(source())
    scene.write_text(
        f'extends = "{SCENES / "fig6a.toml"}"\nduration = 0.4\n[[dissipation]]\nkind = "brake"\nacts = "always"\n'
    )
    with start(load(scene, plugins=[plugin]), paused=True) as loop:
        plugin.write_text(source().replace("-self", "-2 * self"))
        tick = loop.swap("brake", acts="always", damping=0.05, reload=True)
        rows = loop.finish()["/controller"]
    assert np.array_equal(rows["dissipation.0"][tick:], -0.1 * rows["v"][tick:])


@pytest.mark.slow
def test_watching_a_live_loop_shows_what_its_log_will_hold_and_leaving_it_ends_it(tmp_path: Path) -> None:
    with start(load("fig6b", SHORT), paused=True) as loop, ThreadPoolExecutor() as threads:
        seen = []
        watching = threads.submit(lambda: [seen.append(block) for block in loop.watch()])
        wait_for("who watches", lambda: "observer" in {node["role"] for node in loop.status()["nodes"]})
        wait_for("a block", lambda: seen or not loop.step(1))
        result = loop.finish()
        watching.result()
    assert result.directory is None
    logged = result["/controller"]
    for block in seen:
        first = round(block["t"][0] * 1000)
        assert np.array_equal(block["x"], logged["x"][first : first + len(block["x"])])
    assert sum(len(block["t"]) for block in seen) > 100
    (tmp_path / "mine.txt").touch()
    with pytest.raises(RunFailed, match="must be new or empty"):
        start("fig6b", tmp_path)


@pytest.mark.parametrize(
    ("asked", "sentence"),
    [
        ({"axes": {"wall.stifness": [100.0]}}, "axes.wall.stifness is not a key of [wall]; did you mean stiffness?"),
        ({"record": ["window.frequncy_Hz"]}, 'record.0 is "window.frequncy_Hz"; did you mean window.frequency_Hz?'),
        ({"values": {"device.mass": -1.0}}, "values: device.mass is -1.0."),
    ],
)
def test_a_mistake_in_an_argument_of_a_sweep_names_the_argument_and_no_file(
    asked: dict[str, Any], sentence: str
) -> None:
    with pytest.raises(SceneError) as refused:
        sweep("fig6c", **{"axes": {"wall.stiffness": [100.0]}, **asked}, workers=1)
    assert str(refused.value).startswith(sentence)


def test_a_sweep_records_what_is_asked_for_and_otherwise_the_width_and_frequency_of_what_lasts() -> None:
    of, axes = load("fig6c", {"duration": 0.1}), {"wall.stiffness": [100.0]}
    assert {"stability.width_m", "stability.frequency_Hz"} < set(sweep(of, axes, workers=1).columns)
    asked = sweep(of, axes, record=["window.frequency_Hz"], workers=1)
    assert "window.frequency_Hz" in asked.columns
    assert "stability.width_m" not in asked.columns
    with pytest.raises(TypeError, match="a sweep file names it itself"):
        sweep("damping_stiffness", record=["window.frequency_Hz"])


@pytest.mark.slow
def test_a_sweep_over_an_array_has_a_row_for_every_value_each_as_its_own_run() -> None:
    scene = load("fig6b", {"duration": 0.5})
    table = sweep(scene, {"wall.stiffness": np.array([100.0, 150.0])}, workers=1)
    assert table["wall.stiffness"].tolist() == [100.0, 150.0]
    assert table["verdict"].tolist() == [run(scene.set({"wall.stiffness": k})).verdict for k in (100, 150)]
    with pytest.raises(KeyError, match=r"did you mean wall.stiffness\?"):
        table["wall.stifness"]
    with pytest.raises(TypeError, match="swept over axes"):
        sweep(scene)


@pytest.mark.parametrize(
    ("text", "columns", "says"),
    [
        ("a,x\n0,0\n1,1\n", {}, "Name it with time or rate_Hz."),
        ("t,x\n0,0\n1,5\n", {"time_unit": "s"}, "Give length m, mm or metres per count"),
        ("t,x\n0,0\n0.001,1\n", {"time": "t", "rate_Hz": 100.0}, "not both"),
    ],
)
def test_a_mistake_in_a_recording_names_the_argument_not_the_option_of_the_command(tmp_path, text, columns, says):
    (tmp_path / "r.csv").write_text(text)
    with pytest.raises(ValueError, match=re.escape(says)) as wrong:
        dissipate(tmp_path / "r.csv", damping=1.0, **columns)
    assert "--" not in str(wrong.value)


def test_an_unknown_column_of_a_recording_is_answered_with_the_nearest():
    with pytest.raises(TypeError, match=r"takes no rate \(did you mean rate_Hz\?\); of a text file, position"):
        dissipate("r.csv", damping=1.0, rate=100.0)
