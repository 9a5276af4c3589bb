"""The demo: its words follow from its run, and its last line names the figure."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from matplotlib.text import Text
from rich.console import Console
from typer.testing import CliRunner

from haploop.launch.runs.in_process import run_in_process
from haploop.launch.runs.loaded_scene import load
from haploop.launch.runs.result import Result
from haploop.launch.scene.bundled import bundled
from haploop.launch.spec import write_scene
from haploop.tools.cli.app import app
from haploop.tools.demo.figure import make_figure
from haploop.tools.demo.report import report
from haploop.tools.demo.story import Part, Story
from haploop.tools.figure import style
from haploop.tools.figure.data import RunData
from helpers.scenes.least import KINDS
from helpers.shown import artists

SCENE = load(bundled("scenes")["demo"]).scene


def part(verdict: str, swing_m: float = 2e-3, **leak: float) -> Part:
    causes = dict.fromkeys(("delay_J", "sampling_and_hold_J", "quantisation_J"), 0.0) | leak
    energy: dict[str, Any] = {"elements": [], "wall": {"leak": {"total_J": sum(causes.values()), **causes}}}
    summary: dict[str, Any] = {"verdict": verdict, "verdict_rule": f"It is {verdict}.", "energy": energy}
    summary["stability"] = {"width_m": swing_m, "frequency_Hz": 31.0}
    return Part(summary, swing_m, 3.5)


def story(before: Part, after: Part) -> Story:
    data: Any = SimpleNamespace(scene=SCENE)
    return Story(data, 1.0, "damping of 5 N s/m", before, after)


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> RunData:
    out = tmp_path_factory.mktemp("demo")
    run_in_process(replace(SCENE, duration=1.5), KINDS, out=out)
    write_scene(SCENE, out)
    return RunData.from_directory(out)


def words(told: Story, columns: int = 80) -> str:
    console = Console(width=columns)
    with console.capture() as captured:
        console.print(report(told))
    return captured.get()


def test_the_demo_says_steady_of_the_element_only_where_the_verdict_does() -> None:
    for before in ("steady", "limit-cycle", "growing", "undecided"):
        for after in ("steady", "limit-cycle", "diverged", "undecided"):
            said = story(part(before), part(after)).outcome()
            assert ("not steady" in said or "it is not with it" in said) == (after != "steady"), said
            assert ("was steady before" in said) == (before == "steady"), said


def test_what_a_steady_loop_rests_on_stands_in_the_demo_s_sentence_in_its_colour_and_in_a_result_s_repr() -> None:
    held, free = part("steady"), part("steady")
    held.summary["stability"]["provisos"] = ["only friction holds it"]
    told = story(part("limit-cycle"), held).outcome()
    assert told == "With damping of 5 N s/m the same wall is steady. Condition: only friction holds it."
    assert "Yet" not in story(part("limit-cycle"), free).outcome()
    assert style.verdict_colour(held.summary) != style.verdict_colour(free.summary) == style.VERDICTS["steady"]
    about = {"title": "mine", "duration_s": 1.0, "window": {"oscillation_m": 0.0}}
    scene: Any = SCENE
    results = [Result(scene, of.summary | about, None) for of in (held, free)]
    assert [result.provisos for result in results] == [("only friction holds it",), ()]
    assert [repr(result).partition(": ")[0] for result in results] == ["<steady, only friction holds it", "<steady"]


def test_the_demo_says_why_of_the_time_before_the_swap() -> None:
    told = story(part("limit-cycle", delay_J=-2e-3), part("steady", delay_J=3e-3)).why()
    assert told.startswith("Up to 1 s, the wall gave the device 2.00 mJ more than an ideal one would have, 100 % of it")


def test_the_demo_fits_into_80_columns_and_shows_hertz_and_newtons_of_either_side() -> None:
    told = words(story(part("limit-cycle", delay_J=-2e-3), part("steady", 0.0)))
    assert max(map(len, told.splitlines())) <= 80
    assert [line.split()[1:] for line in told.splitlines() if line.startswith(" at ")] == [["31.0", "Hz", "–"]]
    assert "3.50 N" in told


@pytest.mark.parametrize("parts", [0, 1, 8, 40])
def test_no_word_above_the_demo_s_charts_covers_another_or_leaves_the_figure_however_much_there_is_to_tell(
    parts: int, data: RunData
) -> None:
    before = part("limit-cycle", delay_J=-2e-3)
    if parts:
        before.summary["stability"]["without"] = {f"element {n} (passivity-controller)": "rests" for n in range(parts)}
    figure = make_figure(replace(story(before, part("steady")), data=data))
    figure.draw_without_rendering()
    texts = [text for text in figure.findobj(Text) if text.get_text().strip() and text.get_visible()]
    boxes = {text: text.get_window_extent() for text in texts}
    (title,), (told,) = artists(figure, "title"), artists(figure, "words")
    assert boxes[title].y0 > boxes[told].y1
    assert all(box.y1 < boxes[told].y0 for text, box in boxes.items() if text not in (title, told))
    assert boxes[told].x1 < figure.bbox.x1
    assert boxes[title].y1 < figure.bbox.y1


@pytest.mark.slow
def test_the_demo_buzzes_until_its_element_comes_and_names_its_figure_last_into_a_folder_that_exists(
    tmp_path: Path,
) -> None:
    (tmp_path / "mine.txt").touch()
    result = CliRunner().invoke(app, ["demo", "--out", str(tmp_path)])
    assert result.exit_code == 0, result.output
    assert "limit-cycle" in result.stdout
    assert "With damping of 5 N s/m the same wall is steady." in " ".join(result.stdout.split())
    assert Path(result.stdout.splitlines()[-1]).read_bytes().startswith(b"\x89PNG")
