"""The end of a run that fails: plant and controller hand over what they hold, and all of it is logged and drawn."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from haploop.controller.controller import Controller
from haploop.controller.dissipation import registry
from haploop.launch.runs.start import prepare, run
from haploop.launch.scene.file import load
from haploop.launch.spec import RunFailed, write_scene
from haploop.logger import read
from haploop.logger.session import open_session
from haploop.plant.plant import Plant
from haploop.protocol.ticks import Timebase
from haploop.tools.figure.data import FigureError, RunData
from haploop.tools.figure.run_figure import book_rows, key_numbers, make_figure
from helpers.live.launched import SCENES
from helpers.scenes.brake import source
from helpers.shown import artists
from helpers.slowly import first_and_slowly

SCENE = SCENES / "fig6c.toml"
STEPS = 10


def settings(delay_ms: int) -> list[str]:
    return [
        f"clock.round_trip_delay={delay_ms} ms", "device.position=0.001", "run.verdict=window",
        'dissipation=[{kind="brake",acts="always"}]',
    ]  # fmt: skip


def plugin(tmp_path: Path, at_force: str) -> Path:
    (file := tmp_path / "brake.py").write_text(source(at_force=at_force))
    return file


def failing(tick: int) -> str:
    return f"if self.tick == {tick} and motion.x != 0.0: raise ValueError('enough')"


@pytest.mark.slow
@pytest.mark.parametrize("delay_ms", [0, 10])
@pytest.mark.parametrize("tick", first_and_slowly(99, 1, 4))
def test_a_run_of_processes_that_fails_is_logged_and_drawn_up_to_there_as_in_one_process(
    tick: int, delay_ms: int, launched: Callable[..., Any], tmp_path: Path
) -> None:
    file, sets = plugin(tmp_path, failing(tick)), settings(delay_ms)
    given = [word for each in sets for word in ("--set", each)]
    launched("run", str(SCENE), "--plugin", str(file), *given, out=tmp_path / "run").end(1)
    with pytest.raises(RunFailed):
        run(prepare(SCENE, sets, [file], tmp_path / "alone"), in_process=True)
    log, alone = read(tmp_path / "run"), read(tmp_path / "alone")
    assert {topic: len(log[topic]["timestamp"]) for topic in ("/controller", "/plant", "/energy")} == {
        "/controller": tick, "/plant": tick * STEPS + 1, "/energy": tick,
    }  # fmt: skip
    assert np.array_equal(log["/plant"]["x"], alone["/plant"]["x"])
    data = RunData.from_directory(tmp_path / "run")
    assert data.span_s == (0.0, tick / 1000)
    [line, _] = artists(make_figure(data), "position")
    assert line.get_xdata()[-1] == pytest.approx(tick / 1000)


@pytest.mark.slow
def test_one_that_fails_at_its_first_tick_has_nothing_to_draw_and_says_so(
    launched: Callable[..., Any], tmp_path: Path
) -> None:
    file = plugin(tmp_path, failing(0))
    given = [word for each in settings(0) for word in ("--set", each)]
    launched("run", str(SCENE), "--plugin", str(file), *given, out=tmp_path / "run").end(1)
    with pytest.raises(FigureError, match="holds no tick, so there is nothing to draw"):
        RunData.from_directory(tmp_path / "run")


def test_where_nothing_came_of_the_plant_what_the_controller_logged_is_drawn(tmp_path: Path) -> None:
    scene = load(SCENE, [], registry())
    time = Timebase.from_scene(scene)
    session = open_session(scene, time, tmp_path, {"scene.toml": write_scene(scene, tmp_path)})
    plant, controller = Plant(scene, time), Controller(scene, time, registry())
    session.logger.start(plant.state(), [])
    plant.run_until(100, lambda _, samples: controller.answer(samples))
    for block in controller.recorder.take():
        session.logger.controller_block(block)
    session.close("The plant was killed by SIGKILL.", None, None, 0)
    data = RunData.from_directory(tmp_path)
    figure, rows = make_figure(data), read(tmp_path)["/controller"]
    [line, _] = artists(figure, "position")
    assert np.array_equal(line.get_ydata(), rows["x"] * 1e3)
    assert (data.as_measured, len(rows["x"]), book_rows(data, data.books())) == (" as measured", 100, [])
    assert key_numbers(data) == ["nothing came from the plant: 0.1 s as the controller measured and commanded it"]
