"""Effects of a scene in the log, on the terminal and in the figure; of a scene without, nothing is there."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.text import Text

import haploop.logger
from haploop.launch.runs.start import prepare, run
from haploop.logger.log.channels import motion_columns
from haploop.protocol.amounts import amount
from haploop.tools.figure import style
from haploop.tools.figure.data import RunData
from haploop.tools.figure.run_figure import book_rows, make_figure
from haploop.tools.render.report import summary_table
from helpers.shown import artists, row, shown

SCENES = Path(__file__).parents[2] / "launch/scenes"
OF_THE_MACHINE = ("wall_s", "real_time_factor", "versions")
POOR_LOOP = """
duration = 0.5
device = { mass = 0.05, damping = 0.1 }
transmission = { motor_mass = 0.05, stiffness = 1e3, damping = 0.5, motor_damping = 0.1 }
friction = { kinetic = 0.2, breakaway = 0.3 }
actuator = { saturation = 1.5, bandwidth = 50.0 }
accelerometer = { range = 1.0, bandwidth = 200.0 }
acceleration = { source = "accelerometer" }
jitter = { kind = "uniform", most = 0.002 }
loss = { probability = 0.2 }
wall = { position = -5e-3, stiffness = 400.0 }
[hand]
mass = 0.1
damping = 0.5
stiffness = 20.0
grip = { stiffness = 500.0, damping = 3.0 }
force = { kind = "sine", amplitude = -1.0, frequency = 1.5 }
"""
EXTRA = ["tip_x", "tip_v", "hand_x", "hand_v", "actuator", "friction"]


def made(directory: Path, text: str, *overrides: str, in_process: bool = True) -> dict[str, Any]:
    scene = directory.parent / f"{directory.name}.toml"
    scene.write_text(text, encoding="utf-8")
    return run(prepare(scene, ("run.verdict=window", *overrides), out=directory), in_process=in_process)


@pytest.fixture(scope="module")
def poor(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    directory = tmp_path_factory.mktemp("runs") / "poor"
    return directory, made(directory, POOR_LOOP)


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    directory = tmp_path_factory.mktemp("runs") / "plain"
    return directory, made(directory, f'extends = "{SCENES.as_posix()}/fig6c.toml"\nduration = 1.1\n')


def test_the_log_has_every_body_against_ground_and_the_plants_own_forces_with_their_units(poor):
    plant = haploop.logger.read(poor[0])["/plant"]
    assert list(plant) == ["timestamp", "t", "x", "v", "force", *EXTRA]
    assert [plant.units[name] for name in EXTRA] == ["m", "m/s", "m", "m/s", "N", "N"]
    assert not np.isnan(np.stack(list(plant.values()))).any()
    rate = 1.0 / (plant["t"][1] - plant["t"][0])
    for body in ("tip", "hand"):  # the velocities are those of the positions: midpoint rule, second order
        v = plant[f"{body}_v"]
        assert np.diff(plant[f"{body}_x"]) * rate == pytest.approx((v[1:] + v[:-1]) / 2, abs=1e-4 * np.abs(v).max())
    assert np.abs(plant["tip_x"] - plant["x"]).max() > 1e-4
    assert set(np.abs(plant["friction"])) == {0.0, 0.2}
    assert np.abs(plant["force"]).max() == 1.5 > np.abs(plant["actuator"]).max() > 1.0


def test_positions_against_ground_add_up_along_the_row_of_bodies():
    one = np.ones(1)
    telemetry = {"x": one, "v": one, "force": one, "cable.stretch": 2 * one, "cable.rate": 3 * one}
    telemetry |= {"grip.stretch": 4 * one, "grip.rate": 5 * one, "pieces.x": one, "stuck": one}
    columns = motion_columns(telemetry)
    assert {name: float(column[0]) for name, column in columns.items() if "_" in name} == {
        "tip_x": 3.0, "tip_v": 4.0, "hand_x": 7.0, "hand_v": 9.0,
    }  # fmt: skip
    without_cable = {name: column for name, column in telemetry.items() if not name.startswith("cable")}
    assert list(motion_columns(without_cable)) == ["x", "v", "force", "hand_x", "hand_v"]


def test_the_log_of_a_plain_scene_has_the_columns_it_always_had(plain):
    assert list(haploop.logger.read(plain[0])["/plant"]) == ["timestamp", "t", "x", "v", "force"]


def test_the_summary_has_a_heat_for_every_damper_and_friction_and_what_the_actuator_kept_back(poor, plain):
    energy = poor[1]["energy"]
    heats = [f"{name}_heat_J" for name in ("motor", "device", "hand", "cable", "grip", "friction")]
    assert [name for name in energy if name.endswith("_heat_J")] == heats
    assert all(energy[name] > 0.0 for name in heats)
    assert energy["actuator_J"] != 0.0
    assert energy["residual_J"] < 1e-12 * energy["moved_J"]
    plain_keys = [
        "hand_work_J",
        "device_heat_J",
        "hand_heat_J",
        "stored_at_start_J",
        "stored_J",
        "moved_J",
        "residual_J",
    ]
    assert [name for name in plain[1]["energy"] if name not in ("elements", "wall")] == plain_keys


def test_the_terminal_shows_heats_what_the_actuator_kept_back_and_what_was_lost(poor, plain):
    text, energy = shown(summary_table(poor[1]), 200), poor[1]["energy"]
    assert row(text, "heat of friction") == [amount(energy["friction_heat_J"], "J")]
    assert row(text, "heat in the cable") == [amount(energy["cable_heat_J"], "J")]
    assert row(text, "kept back by the actuator's limits") == [amount(energy["actuator_J"], "J")]
    lost = poor[1]["lost"]
    (counted,) = [line for line in text.splitlines() if "commands lost" in line]
    assert f"{lost['commands_dropped']} commands dropped, {lost['commands_lost']} commands lost" in counted
    assert f"{poor[1]['actuator']['saturated_commands']} commands saturated" in text
    assert f"{poor[1]['accelerometer']['clipped_ticks']} readings clipped" in text
    assert not any(word in shown(summary_table(plain[1])) for word in ("friction", "actuator", "lost", "saturated"))


@pytest.mark.slow
def test_the_figure_draws_all_bodies_and_forces_of_the_plant_and_counts_what_was_lost(poor, plain):
    data = RunData.from_directory(poor[0])
    figure = make_figure(data)
    (position, _), (friction, _) = artists(figure, "hand"), artists(figure, "friction")
    assert position.get_ydata()[-1] == data.bodies_m["hand"][-1] * 1e3
    assert set(np.abs(friction.get_ydata())) == {0.0, 0.2}
    assert len(artists(figure, "saturation")) == 4
    marked = {entry.name: entry for entry in book_rows(data, data.books())}
    assert marked["heat of friction"].book == "friction"
    assert marked["kept back by the actuator's limits"].true == amount(poor[1]["energy"]["actuator_J"], "J")
    assert marked["commands lost"].true == str(poor[1]["lost"]["commands_lost"])
    none = make_figure(RunData.from_directory(plain[0]))
    assert not any(artists(none, name) for name in ("tip", "hand", "friction", "actuator", "saturation"))


def covered(directory: Path) -> tuple[list[str], dict[str, Any]]:
    """The titles that a legend covers in the figure of a run, and its panels."""
    figure = make_figure(RunData.from_directory(directory))
    figure.draw_without_rendering()
    panels, found = {ax.get_title(loc="left"): ax for ax in figure.get_axes()}, []
    for title, ax in panels.items():
        boxes = [text.get_window_extent() for text in ax.findobj(Text) if title and text.get_text() == title]
        legend = ax.get_legend()
        if legend and legend.get_window_extent().count_overlaps(boxes):
            found.append(title)
    return found, panels


@pytest.mark.slow
def test_every_force_stands_in_the_legend_and_no_legend_covers_a_title(poor):
    titles, panels = covered(poor[0])
    assert titles == []
    assert {"wall", "friction", "actuator"} <= {text.get_text() for text in panels["Force by part"].get_legend().texts}


@pytest.mark.slow
def test_no_legend_covers_a_title_where_a_run_of_three_ticks_has_long_numbers_at_its_axes(tmp_path, monkeypatch):
    made(tmp_path / "few", f'extends = "{SCENES.as_posix()}/fig6c.toml"\nduration = 3e-3\n')
    titles, panels = covered(tmp_path / "few")
    assert titles == []
    assert "Energy out of the device (below 0: into it)" in panels
    dress = style.dress
    monkeypatch.setattr(style, "dress", lambda ax, title, *labels: dress(ax, title + 8 * "x", *labels))
    assert any(title.startswith("Energy") for title in covered(tmp_path / "few")[0]), "of a longer title it would"


def test_a_log_without_plant_steps_draws_and_its_books_are_the_same(poor, tmp_path):
    summary = made(tmp_path / "ticks", POOR_LOOP, 'run.log="ticks"')
    assert summary["energy"] == poor[1]["energy"]
    make_figure(RunData.from_directory(tmp_path / "ticks"))


@pytest.mark.slow
def test_as_processes_in_small_blocks_the_books_have_the_same_bits(poor, tmp_path):
    cut = ["run.block_ticks=7", "run.window_blocks=1", "run.log=none"]
    summary = made(tmp_path / "processes", POOR_LOOP, *cut, in_process=False)
    alike = [name for name in poor[1] if name not in (*OF_THE_MACHINE, "title")]
    assert {name: summary[name] for name in alike} == {name: poor[1][name] for name in alike}
