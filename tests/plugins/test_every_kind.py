"""Files with walls, estimators and hand forces: those of docs/plugins.md as they stand, kept, repeated, and refused."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from shutil import rmtree
from typing import Any

import numpy as np
import pytest

from haploop.api import load, run
from haploop.launch.runs.replay import replay
from haploop.launch.runs.run_files import recorded_scene
from haploop.launch.runs.start import prepare
from haploop.launch.runs.start import run as start
from haploop.launch.scene.mistakes import SceneError
from haploop.logger import read
from haploop.protocol.installed import all_brought, take_back
from haploop.protocol.plugin_file import PluginError
from haploop.protocol.register import UnknownKind
from haploop.protocol.scene.hand_force import HandForce
from haploop.protocol.scene.scene import Scene
from haploop.protocol.walls.registry import make_wall, wall_class
from haploop.tools.advise.walls.cases import hold_N, make_loop
from haploop.tools.command.given import kinds_with
from haploop.tools.executor.pool import Pool, read_sources
from haploop.tools.figure.data import RunData
from haploop.tools.figure.run_figure import draw, make_figure
from helpers.runs.batches import together

PAGE = (Path(__file__).parents[2] / "docs/plugins.md").read_text(encoding="utf-8")
_, *FILES = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
TABLES = [text for text in re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL) if "[project]" not in text]
ELEMENT = """
class Brake(Element):
    kind = "brake"
    def force(self, motion): return -0.3 * motion.v
"""
ALL = "from haploop.controller.dissipation import Element\n" + "\n".join(FILES) + ELEMENT
SCENE = """
duration = 0.3
[device]
mass = 0.1
damping = 0.2
position = 0.001
[hand]
force = { kind = "constant", value = -0.5 }
[wall]
position = 0.0
stiffness = 500.0
[run]
verdict = "window"
[[dissipation]]
kind = "damping"
damping = 0.3
"""


@pytest.fixture(autouse=True)
def nothing_stays() -> Iterator[None]:
    """What files have brought is known to a process for good."""
    known = all_brought()
    yield
    take_back(known)


def written(directory: Path, tables: list[str], code: str) -> tuple[Path, Path]:
    """A scene with some tables in place of its own, and a plugin file."""
    scene, plugin = directory / "scene.toml", directory / "own.py"
    text, named = SCENE, "\n".join(tables)
    for heading in re.findall(r"^\[([\w.]+)\]", named, re.MULTILINE):
        of = "hand" if heading == "hand.force" else heading
        text = re.sub(rf"^\[{of}\]\n(?:[^\[\n].*\n)*", "", text, flags=re.MULTILINE)
    scene.write_text(text + "\n" + named, encoding="utf-8")
    plugin.write_text(code, encoding="utf-8")
    return scene, plugin


def with_all(directory: Path, code: str = ALL) -> tuple[Path, Path]:
    return written(directory, [*TABLES, '[[dissipation]]\nkind = "brake"\n'], code)


PULSE = """
import numpy as np
from typing import Annotated
from haploop.protocol.quantity import si
from haploop.protocol.scene.hand_force import HandForce
class Pulse(HandForce):
    kind = "pulse"
    peak: Annotated[float, si("N", "least and last force")]
    def force_at(self, t): return np.where(t < 0.1, 0.2 * self.peak, self.peak)
    def constant_from_s(self): return 0.1
"""


def test_a_hand_force_that_is_constant_from_a_time_on_needs_no_value_to_be_checked_and_advised_on(
    tmp_path: Path,
) -> None:
    scene, plugin = written(tmp_path, ['[hand.force]\nkind = "pulse"\npeak = -0.7\n'], PULSE)
    loaded = load(scene, plugins=[plugin])
    assert loaded.notes == load(written(tmp_path, [], PULSE)[0]).notes
    assert hold_N(make_loop(loaded.scene, has_task=True)) == pytest.approx(0.7)


@pytest.mark.parametrize("text", ["utf-8", "utf-8-sig"])
def test_a_plugin_file_may_begin_with_a_byte_order_mark(tmp_path: Path, text: str) -> None:
    scene, plugin = written(tmp_path, ['[[dissipation]]\nkind = "brake"\n'], "")
    plugin.write_text("from haploop.controller.dissipation import Element\n" + ELEMENT, encoding=text)
    prepared = prepare(scene, plugins=[plugin], out=tmp_path / text)
    assert start(prepared)["ended"] == "done"
    assert len(read_sources([plugin])) == 1


def test_the_page_has_a_wall_an_estimator_and_a_hand_force() -> None:
    assert [re.findall(r"\((\w+)\):$", code, re.MULTILINE) for code in FILES] == [
        ["Wall"],
        ["Estimator"],
        ["HandForce"],
    ]
    assert [next(iter(tomllib.loads(table))) for table in TABLES] == ["wall", "velocity", "hand"]


@pytest.mark.parametrize("place", range(3))
def test_a_file_of_the_page_runs_with_its_table_replays_and_has_the_same_bits_in_a_batch(
    place: int, tmp_path: Path
) -> None:
    scene, plugin = written(tmp_path, [TABLES[place]], FILES[place])
    loaded = load(scene, plugins=[plugin])
    result = run(loaded, out=tmp_path / "run")
    plain = run(load(written(tmp_path, [], FILES[place])[0]))
    assert result.summary["trajectory_sha256"] != plain.summary["trajectory_sha256"]
    assert abs(result.summary["energy"]["residual_J"]) < 1e-12 * result.summary["energy"]["moved_J"]
    assert replay(tmp_path / "run").differences == []
    other = loaded.set({"device.mass": 0.11})
    digests = [each["trajectory_sha256"] for each in together([loaded.scene, other.scene], dict(loaded.kinds)) if each]
    assert digests == [result.summary["trajectory_sha256"], run(other).summary["trajectory_sha256"]]


def test_the_pages_skin_stores_the_integral_of_its_force(tmp_path: Path) -> None:
    scene, plugin = written(tmp_path, [TABLES[0]], FILES[0])
    wall, depths = make_wall(load(scene, plugins=[plugin]).scene.wall), np.linspace(0.0, 1e-3, 1_000_001)
    force = wall.push(depths, 0.0)
    assert wall.stored(1e-3) == pytest.approx(1e-9 * float((force[1:] + force[:-1]).sum()) / 2.0, rel=1e-9)


@pytest.mark.slow
def test_one_file_brings_all_kinds_to_the_processes_of_a_run_with_the_bits_of_one_process(tmp_path: Path) -> None:
    scene, plugin = with_all(tmp_path)
    sets = ["run.verdict=pushed"]
    summaries = [start(prepare(scene, sets, [plugin], tmp_path / f"{way}"), in_process=way) for way in (True, False)]
    for key in ("trajectory_sha256", "verdict", "stability", "energy"):
        assert summaries[0][key] == summaries[1][key]
    assert replay(tmp_path / "False").differences == []


@pytest.mark.slow
def test_workers_that_are_started_anew_know_what_a_file_brings(tmp_path: Path) -> None:
    scene, plugin = with_all(tmp_path)
    loaded = load(scene, plugins=[plugin])
    with Pool(workers=2) as pool:
        results = dict(pool.results([loaded.scene] * 2, [plugin], trajectories=True))
    assert {each["trajectory_sha256"] for each in results.values()} == {run(loaded).summary["trajectory_sha256"]}


def test_a_scene_keeps_the_code_it_was_loaded_with_where_another_file_takes_its_names(tmp_path: Path) -> None:
    scene, plugin = with_all(tmp_path)
    first = load(scene, plugins=[plugin])
    plugin.write_text(ALL.replace("0.5 * depth, depth", "0.6 * depth, depth"), encoding="utf-8")
    second = load(scene, plugins=[plugin])
    before, other, after = (run(each).summary["trajectory_sha256"] for each in (first, second, first))
    assert before == after != other


def gone(tmp_path: Path) -> Path:
    """A run of all kinds whose files are gone, in a process that knows none of them."""
    scene, plugin = with_all(tmp_path)
    run(load(scene, plugins=[plugin]), out=tmp_path / "run")
    rmtree(tmp_path / "run/plugins")
    take_back({})
    return tmp_path / "run"


@pytest.mark.slow
def test_a_run_is_drawn_without_its_kinds_and_no_later_scene_may_name_them(tmp_path: Path) -> None:
    out = gone(tmp_path)
    assert draw(out, tmp_path / "figure.png").stat().st_size > 10_000
    scene = recorded_scene(out, read(out).attachments)
    assert scene is not None
    assert scene.wall is not None
    assert (scene.wall.kind, scene.wall.others) == ("skin", {"thickness": 4e-4})
    assert Scene.from_dict(scene.as_dict()).as_dict() == scene.as_dict()
    with pytest.raises(SceneError, match=r'wall.kind is "skin"\. .* A wall of your own needs --plugin FILE, in'):
        load(tmp_path / "scene.toml")


@pytest.mark.slow
def test_the_ideal_wall_of_a_run_is_drawn_where_its_file_is_given_again(tmp_path: Path) -> None:
    out = gone(tmp_path)

    def is_drawn() -> bool:
        figure = make_figure(RunData.from_directory(out))
        return bool(figure.findobj(lambda artist: artist.get_gid() == "spring"))

    before = is_drawn()
    kinds_with([tmp_path / "own.py"])
    assert (before, is_drawn()) == (False, True)


def test_a_kind_that_is_not_at_hand_is_told_in_a_sentence() -> None:
    with pytest.raises(UnknownKind) as told:
        wall_class("skin")
    assert str(told.value).startswith('There is no wall of the kind "skin" here. It comes from a plugin file')
    force = HandForce.of_kind("pulses").from_dict({"kind": "pulses", "value": 1.0})
    with pytest.raises(UnknownKind, match="no hand force of the kind"):
        force.force_at(np.zeros(1))


def line_of(code: str, text: str) -> int:
    return code[: code.index(text)].count("\n") + 1


@pytest.mark.parametrize(
    ("was", "becomes", "at", "says"),
    [
        ("def push(", "def pushes(", "class Skin", "The class Skin in {}, line {} has no method push"),
        ("    thickness: Any = 1e-3\n", "", "class Skin", "line {1} has the key thickness, but no field of that name"),
        ('    kind = "pulses"\n', "", "class Pulses", "The class Pulses in {}, line {} has no kind; write kind = "),
        ("def force_at(", "def force(", "class Pulses", "The class Pulses in {}, line {} has no method force_at"),
        ('("alpha", "beta")', '("alpha",)', "class AlphaBeta", "line {1} has the key beta; name it in needs"),
        ("    does: ClassVar", "    done: ClassVar", "class AlphaBeta", "line {1} does not say what its estimate is"),
        ("x, v = memory", "x, v, a = memory", "x, v, a =", "alpha-beta could not estimate .*own.py, line {1}"),
        ("t % self.every", "t / 0 * self.evry", "t / 0", "The hand force pulses could not give .*own.py, line {1}"),
        ("self.value, 0.0)", "self.value, 0.0)[0]", "[0]", r"The hand force pulses gave an array of shape \(\)"),
        ("        d = self.thickness", "        d = 1 / 0", "1 / 0", "not give its stored energy .*own.py, line {1}"),
        ("0.25 * depth * depth, beneath)", "float('inf'), 1.0)", "inf", "skin gave inf, which is not a finite number"),
    ],
)  # fmt: skip
def test_what_is_missing_or_raises_is_told_with_file_and_line(
    was: str, becomes: str, at: str, says: str, tmp_path: Path
) -> None:
    code = ALL.replace(was, becomes)
    scene, plugin = with_all(tmp_path, code)
    with pytest.raises(PluginError, match=says.format(re.escape(str(plugin)), line_of(code, at))):
        load(scene, plugins=[plugin])


@pytest.mark.slow
def test_what_does_not_come_to_an_end_is_told_with_file_and_line(tmp_path: Path) -> None:
    scene, plugin = with_all(
        tmp_path, ALL.replace("        d = self.thickness", "        while True:\n            d = 1")
    )
    with pytest.raises(PluginError, match=r"it did not finish within 2 s \(own.py, line \d+\)"):
        load(scene, plugins=[plugin])


def test_a_file_with_nothing_that_a_scene_can_name_says_what_was_expected(tmp_path: Path) -> None:
    scene, plugin = written(tmp_path, [], "class Brake: pass\n")
    with pytest.raises(PluginError, match="a class derived from Element, Wall, Estimator or HandForce was expected"):
        load(scene, plugins=[plugin])


def failing(text: str, tmp_path: Path, in_process: bool) -> Any:
    scene, plugin = with_all(tmp_path, ALL.replace("        x, v = memory\n", text + "        x, v = memory\n"))
    return start(prepare(scene, [], [plugin], tmp_path / "out"), in_process=in_process)


@pytest.mark.parametrize("in_process", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_what_raises_in_a_run_ends_it_with_file_and_line(in_process: bool, tmp_path: Path) -> None:
    from haploop.launch.spec import RunFailed

    text = "        if u < -1e-7:\n            raise ValueError('too low')\n"
    with pytest.raises(RunFailed, match=r"ValueError: too low \(own.py, line \d+\)"):
        failing(text, tmp_path, in_process)
    assert len(read(tmp_path / "out")["/controller"]["x"]) > 10
