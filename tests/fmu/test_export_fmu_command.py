"""haploop export-fmu as its users meet it: where the file goes, what is refused in which words, nothing half done."""

from __future__ import annotations

import os
import re
import stat
import zipfile
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from haploop.controller.dissipation.damping import Damping
from haploop.controller.estimators.base import Unchanged
from haploop.controller.estimators.choose import ESTIMATORS as NAMES_OF_ESTIMATORS
from haploop.controller.estimators.choose import estimator_class
from haploop.tools.cli.app import app
from haploop.tools.fmu import package
from haploop.tools.fmu.variables import ELEMENTS, ESTIMATORS, NotExportable, controller_of
from helpers.runs.fmus import compiler
from helpers.scenes.least import KINDS, LEAST_TOML, scene

WALL_TOML = LEAST_TOML + "[wall]\nposition = -0.06\nstiffness = 150\n"


def export(*words: str | Path) -> Result:
    return CliRunner().invoke(app, ["export-fmu", *map(str, words)])


def refused(result: Result, status: int, *words: str) -> None:
    assert result.exit_code == status, result.output
    assert result.stdout == ""
    assert "Traceback" not in result.output
    assert [word for word in words if word not in result.stderr] == [], result.stderr


@pytest.fixture
def wall(tmp_path: Path) -> Path:
    path = tmp_path / "a 'wall' of \"mine\" & you.toml"
    path.write_text(WALL_TOML, encoding="utf-8")
    return path


@pytest.fixture(name="compiler")
def there_is_a_compiler() -> str:
    return compiler()


@pytest.mark.slow
@pytest.mark.usefixtures("compiler")
def test_the_file_has_the_scene_s_name_where_it_was_asked_or_the_name_it_was_given(
    wall: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    result = export(wall)
    assert (result.exit_code, result.stdout) == (0, f"{wall.stem}.fmu\n")
    assert "Communication step: 0.001 s, or whole plant steps of 0.0001 s" in result.stderr
    assert export(wall, "--out", tmp_path / "deep" / "mine.fmu").exit_code == 0
    assert export(wall, "--out", tmp_path / "deep").exit_code == 0
    assert [path.name for path in here.iterdir()] == [f"{wall.stem}.fmu"]
    assert {path.name for path in (tmp_path / "deep").iterdir()} == {"mine.fmu", f"{wall.stem}.fmu"}
    [library] = [name for name in zipfile.ZipFile(f"{wall.stem}.fmu").namelist() if name.startswith("binaries/")]
    assert re.fullmatch(r"binaries/(x86_64|aarch64)-(linux|darwin)/a__wall__of__mine____you\.(so|dylib)", library)


@pytest.mark.usefixtures("compiler")
def test_a_file_that_exists_is_left_as_it_is_unless_that_is_forced(wall: Path, tmp_path: Path) -> None:
    mine = tmp_path / "mine.fmu"
    mine.write_text("mine", encoding="utf-8")
    refused(export(wall, "--out", mine), 2, f"{mine} exists already", "--force")
    assert mine.read_text(encoding="utf-8") == "mine"
    assert export(wall, "--out", mine, "--force").exit_code == 0
    assert zipfile.is_zipfile(mine)


def test_a_name_that_is_no_fmu_s_and_a_place_that_cannot_be_written_are_refused(wall: Path, tmp_path: Path) -> None:
    refused(export(wall, "--out", tmp_path / "mine.zip"), 2, "must end in .fmu", "mine.zip")
    (tmp_path / "file").write_text("", encoding="utf-8")
    refused(export(wall, "--out", tmp_path / "file" / "mine.fmu"), 2, "cannot be made", "--out")
    refused(export(tmp_path / "none.toml"), 2, "none.toml")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_directory_that_is_read_only_is_refused(wall: Path, tmp_path: Path) -> None:
    locked = tmp_path / "locked"
    locked.mkdir(mode=0o500)
    refused(export(wall, "--out", locked / "mine.fmu"), 2, "cannot be made", "--out")


def test_where_there_is_no_compiler_it_says_what_to_install(
    wall: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    refused(export(wall, "--out", tmp_path / "mine.fmu"), 1, "A C compiler was expected", "apt install gcc", "CC=")
    monkeypatch.setenv("CC", "no-such-compiler -O0")
    refused(export(wall, "--out", tmp_path / "mine.fmu"), 1, "no-such-compiler cannot be started")
    monkeypatch.setenv("CC", "'gcc")
    refused(export(wall, "--out", tmp_path / "mine.fmu"), 1, "CC must be a command, but 'gcc was given")
    assert list(tmp_path.glob("*.fmu*")) == []


@pytest.mark.parametrize(
    ("script", "words"), [("printf 'broken \\377' >&2; exit 3", "broken \ufffd"), ("exit 0", "it printed nothing")]
)
def test_a_compiler_that_fails_is_quoted_and_leaves_nothing(
    script: str, words: str, wall: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fake = tmp_path / "my cc"
    fake.write_text(f"#!/bin/sh\n{script}\n", encoding="utf-8")
    fake.chmod(fake.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("CC", f"'{fake}'")
    refused(export(wall, "--out", tmp_path / "mine.fmu"), 1, "produced no library", words, "CC=gcc")
    assert list(tmp_path.glob("*.fmu*")) == []


def test_all_that_stands_in_the_way_is_told_by_name_at_once(tmp_path: Path) -> None:
    path = tmp_path / "hard.toml"
    rest = '[jitter]\nkind = "uniform"\nmost = 0.001\n[loss]\nprobability = 0.1\n[[event]]\nat = 0.5\n'
    path.write_text(WALL_TOML + rest + 'set = {"wall.stiffness" = 7}\n', encoding="utf-8")
    words = "[jitter] draws random numbers", "[loss] draws", "event.0 changes the loop at 0.5 s"
    refused(export(path, "--out", tmp_path / "mine.fmu"), 2, "No FMU can be made of this scene", *words)
    assert list(tmp_path.glob("*.fmu*")) == []


def test_an_element_of_a_plugin_is_refused_though_it_has_the_name_of_one_that_is_known(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    class Mine(Damping):
        kind = "damping"

    one = scene(wall={"position": -0.06, "stiffness": 150}, dissipation=[{"kind": "damping", "damping": 0.5}])
    controller_of(one)
    monkeypatch.setattr("haploop.tools.fmu.variables.registry", lambda: {"damping": Mine})
    with pytest.raises(
        NotExportable, match=r"dissipation\.0 is damping, which is Python code; an FMU supports only damping, "
    ):
        controller_of(one)


def test_every_estimator_and_element_that_comes_with_haploop_and_asks_for_nothing_has_its_words_in_c() -> None:
    assert {kind for kind in KINDS.values() if not kind.asks} <= ELEMENTS.keys()
    named = {estimator_class(name) for name in NAMES_OF_ESTIMATORS}
    assert named | {Unchanged} | {made for kind in named for made in kind.__subclasses__()} == ESTIMATORS.keys()
    written = Path(package.__file__).with_name("controller.h").read_text(encoding="utf-8")
    assert [word for word in (*ELEMENTS.values(), *ESTIMATORS.values()) if f"case {word}:" not in written] == []


def test_a_stabilizer_is_refused_by_its_name() -> None:
    one = scene(wall={"position": -0.06, "stiffness": 150}, dissipation=[{"kind": "force-bounding"}])
    with pytest.raises(
        NotExportable, match=r"dissipation\.0 is force-bounding, which is Python code; an FMU supports only"
    ):
        controller_of(one)
