"""Sweeps run to their tables: every cell once, with the bits of its scene alone, whatever interrupts it."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
import pyarrow.parquet
import pytest

from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.file import load as load_scene
from haploop.protocol.scene.paths import value_at
from haploop.protocol.scene.scene import Scene
from haploop.tools.sweep.command import Request, sweep
from haploop.tools.sweep.engine import SweepProgress
from haploop.tools.sweep.table import TableError, read
from helpers.runs.sweep_runs import engine_run, rows
from helpers.scenes.least import KINDS
from helpers.scenes.sweep_files import GRID, loaded, sweep_file, swept

RECORD = 'record = ["trajectory_sha256", "energy.residual_J", "window.oscillation_m", "ticks", "final.x_m"]\n'


def test_every_row_has_the_bits_of_its_scene_run_alone(tmp_path: Path) -> None:
    table = swept(tmp_path, RECORD + "repeat = 2\n" + GRID + '"encoder.rounding" = ["nearest", "floor"]\n')
    assert len(table) == 4 * 5 * 2 * 2
    assert table["cell"].tolist() == list(range(80))
    for index in range(0, 80, 7):
        scene = Scene.from_dict(tomllib.loads(table["scene"][index]))
        alone = run_in_process(scene, KINDS)
        assert table["trajectory_sha256"][index] == alone["trajectory_sha256"]
        assert table["energy.residual_J"][index] == alone["energy"]["residual_J"]
        assert table["final.x_m"][index] == alone["final"]["x_m"]
        assert (table["verdict"][index], table["ticks"][index]) == (alone["verdict"], alone["ticks"])
        for key in ("wall.stiffness", "dissipation.0.damping", "seed", "encoder.rounding"):
            assert value_at(scene, key) == table[key][index]
    assert len(set(table["trajectory_sha256"])) == 40  # the seed changes nothing without noise


def test_the_scene_of_a_row_runs_by_itself(tmp_path: Path) -> None:
    table = swept(tmp_path, RECORD + GRID)
    (tmp_path / "one.toml").write_text(table["scene"][11])
    again = run_in_process(load_scene(tmp_path / "one.toml"), KINDS)
    assert again["trajectory_sha256"] == table["trajectory_sha256"][11]


def test_the_table_names_units_sweep_and_versions(tmp_path: Path) -> None:
    swept(tmp_path)
    schema = pyarrow.parquet.read_schema(tmp_path / "out" / "table.parquet")
    assert schema.field("wall.stiffness").metadata == {b"unit": b"N/m"}
    assert schema.field("window.oscillation_m").metadata == {b"unit": b"m"}
    assert str(schema.field("cell").type) == "int64"
    assert tomllib.loads(schema.metadata[b"sweep"].decode())["base"]["title"] == "press"
    assert json.loads(schema.metadata[b"versions"])["haploop"]


def test_the_columns_are_the_same_whatever_the_number_of_workers(tmp_path: Path) -> None:
    swept(tmp_path, RECORD + GRID, out=tmp_path / "one")
    swept(tmp_path, RECORD + GRID, out=tmp_path / "two", workers=2)
    assert rows(tmp_path / "one") == rows(tmp_path / "two")


@pytest.mark.parametrize("stop_after", [17, pytest.param(1, marks=pytest.mark.slow)])
def test_a_sweep_that_was_stopped_goes_on_without_running_a_cell_twice(stop_after: int, tmp_path: Path) -> None:
    made = loaded(tmp_path, RECORD + "repeat = 12\n" + GRID)
    whole, _ = engine_run(made, tmp_path / "whole")
    first, _ = engine_run(made, tmp_path / "cut", stop_after)
    assert stop_after <= len(first.cells) < made.count
    assert not (tmp_path / "cut" / "table.parquet").exists()
    assert len(read(tmp_path / "cut")) == len(first.cells)
    second, _ = engine_run(made, tmp_path / "cut")
    assert second.stored == len(first.cells)
    assert sorted(first.cells + second.cells) == sorted(whole.cells) == list(range(made.count))
    assert rows(tmp_path / "cut") == rows(tmp_path / "whole")
    assert not (tmp_path / "cut" / "parts").exists()


def test_a_part_that_was_half_written_is_run_again(tmp_path: Path) -> None:
    made = loaded(tmp_path, "repeat = 10\n" + GRID)
    engine_run(made, tmp_path / "whole")
    engine_run(made, tmp_path / "cut", 1)
    (part,) = (tmp_path / "cut" / "parts").iterdir()
    part.write_bytes(part.read_bytes()[:100])
    (tmp_path / "cut" / "parts" / "000000000064.parquet.part").write_bytes(b"PAR1")
    told, _ = engine_run(made, tmp_path / "cut")
    assert sorted(told.cells) == list(range(200))
    assert rows(tmp_path / "cut") == rows(tmp_path / "whole")


def test_a_finished_sweep_is_not_run_again_and_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    swept(tmp_path)
    stamp = (tmp_path / "out" / "table.parquet").stat().st_mtime_ns
    swept(tmp_path)
    assert "Every cell of this sweep is already there" in capsys.readouterr().err
    assert (tmp_path / "out" / "table.parquet").stat().st_mtime_ns == stamp


def test_a_directory_of_another_sweep_is_refused_and_its_difference_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    swept(tmp_path)
    before = {path: path.read_bytes() for path in (tmp_path / "out").iterdir() if path.is_file()}
    with pytest.raises(SystemExit) as left:
        swept(tmp_path, GRID.replace("400", "500"))
    assert left.value.code == 2
    said = capsys.readouterr().err
    assert "out holds another sweep (there" in said
    assert "500.0" in said
    assert {path: path.read_bytes() for path in before} == before


def test_the_resolved_sweep_of_a_directory_goes_on_in_it(tmp_path: Path) -> None:
    made = loaded(tmp_path, "repeat = 10\n" + GRID)
    engine_run(made, tmp_path / "out", 1)
    assert len(read(tmp_path / "out")) < made.count
    sweep(Request(tmp_path / "out" / "sweep.toml", out=tmp_path / "out", workers=1), as_json=False)
    assert len(read(tmp_path / "out")) == made.count


def test_a_cell_that_the_scene_check_refuses_is_a_row_with_its_reason(tmp_path: Path) -> None:
    table = swept(tmp_path, '[axes]\n"clock.round_trip_delay" = [0, 0.00015, 0.001]\n"wall.stiffness" = [100, 200]\n')
    refused = table["ended"] == "refused"
    assert table["clock.round_trip_delay"][refused].tolist() == [0.00015] * 2
    assert set(table["why"][refused]) == {table["why"][refused][0]}
    assert "clock.round_trip_delay is 0.00015" in table["why"][refused][0]
    assert table["verdict"][refused].tolist() == [None, None]
    assert np.isnan(table["window.oscillation_m"][refused]).all()
    assert set(table["why"][~refused]) == {""}


RAISING = """
from typing import Annotated
from haploop.controller.dissipation import Element, Motion, Quantity


class Raising(Element):
    \"\"\"Cannot go on where it is strong.\"\"\"

    kind = "raising"
    force_N: Annotated[float, Quantity("N", at_least=0)] = 0.1

    def force(self, motion: Motion):
        if self.force_N > 0.25:
            raise RuntimeError("out of order")
        return -self.force_N * motion.v
"""


def test_a_plugin_that_fails_in_one_cell_costs_no_other_its_row(tmp_path: Path) -> None:
    (tmp_path / "raising.py").write_text(RAISING)
    text = '[set]\ndissipation = [{ kind = "raising" }]\n[axes]\n"dissipation.0.force_N" = [0.1, 0.2, 0.3]\n'
    table = swept(tmp_path, text, plugins=[tmp_path / "raising.py"])
    assert table["ended"].tolist() == ["done", "done", "failed"]
    assert "out of order" in table["why"][2]
    assert table["verdict"][2] is None
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["counts"]["failed"] == 1


def test_a_run_that_fails_is_no_far_side_of_a_boundary(tmp_path: Path) -> None:
    (tmp_path / "raising.py").write_text(RAISING)
    text = '[set]\ndissipation = [{ kind = "raising" }]\n[axes]\n"dissipation.0.force_N" = [0.1, 0.3]\n'
    search = '[bisect]\naxis = "dissipation.0.force_N"\ntolerance = "0.01 N"\nholds = "steady"\n'
    table = swept(tmp_path, text + search, plugins=[tmp_path / "raising.py"])
    assert table["verdict"].tolist() == ["no-swing-seen", None]
    assert "the run at 0.3 failed: " in table.boundary["why"][0]
    assert np.isnan(table.boundary["boundary"][0])


def test_other_plugin_files_are_refused_for_a_sweep_that_goes_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    plugin = tmp_path / "raising.py"
    plugin.write_text(RAISING)
    text = '[set]\ndissipation = [{ kind = "raising" }]\n[axes]\n"dissipation.0.force_N" = [0.1, 0.2]\n'
    swept(tmp_path, text, plugins=[plugin])
    (kept,) = (tmp_path / "out" / "plugins").iterdir()
    swept(tmp_path, text, plugins=[kept])
    plugin.write_text(RAISING.replace("0.25", "0.15"))
    with pytest.raises(SystemExit):
        swept(tmp_path, text, plugins=[plugin])
    assert "other --plugin files" in capsys.readouterr().err


def test_a_sweep_of_nothing_that_can_run_ends_with_rows_that_say_so(tmp_path: Path) -> None:
    table = swept(tmp_path, '[axes]\n"clock.round_trip_delay" = [0.00015]\n')
    assert table["ended"].tolist() == ["refused"]


def test_a_directory_without_a_sweep_is_said_to_have_none(tmp_path: Path) -> None:
    with pytest.raises(TableError, match="holds no sweep that can be read"):
        read(tmp_path)
    made = loaded(tmp_path)
    (tmp_path / "sweep.toml").write_text(made.toml())
    with pytest.raises(TableError, match="has no finished cell yet"):
        read(tmp_path)


def test_json_is_one_object_that_counts_the_verdicts(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sweep(Request(sweep_file(tmp_path), out=tmp_path / "out", workers=1), as_json=True)
    told = json.loads(capsys.readouterr().out)
    assert told["cells"] == 20 == sum(told["counts"].values())
    assert told["ended"] == "done"
    assert told["directory"] == str(tmp_path / "out")
    assert told["axes"]["wall.stiffness"] == [100.0, 400.0, 4]


def test_progress_shows_cells_rate_and_verdicts_on_a_terminal_and_nothing_elsewhere() -> None:
    from io import StringIO

    from rich.console import Console

    for terminal in (True, False):
        screen = Console(file=StringIO(), force_terminal=terminal, width=140)
        with SweepProgress("a sweep", screen) as progress:
            progress.expect(4)
            progress.add_rows([{"cell": 0, "verdict": "steady", "ended": "done"}] * 2)
            progress.add_rows([{"cell": 0, "verdict": None, "ended": "failed", "why": "broken"}])
            progress._bars.refresh()
        shown = screen.file.getvalue()  # type: ignore[attr-defined]
        if terminal:
            assert "3/4" in shown
            assert "cells/s" in shown
            assert "2 steady, 1 failed" in shown
        else:
            assert shown == ""
        assert progress.reason == "broken"
