"""docs/books.md: its example closes the balance of a run from what `haploop export` wrote, and prints what it says."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from haploop.api import load, run
from haploop.tools.cli.app import app

PAGE = (Path(__file__).parents[3] / "docs/books.md").read_text(encoding="utf-8")
RUN, EXPORT = re.findall(r"^haploop (.*)$", PAGE, re.MULTILINE)
[CODE] = re.findall(r"^```python\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
[PRINTED] = re.findall(r"^```text\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)


def added_up(code: str, scene: Any, folder: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """The names of the example after it went over a run of this scene."""
    monkeypatch.chdir(folder)
    run(scene, "runs/books")
    assert CliRunner().invoke(app, shlex.split(EXPORT)).exit_code == 0
    names: dict[str, Any] = {}
    exec(compile(code, "books.md", "exec"), names)
    return names


def left_over(names: dict[str, Any]) -> float:
    """The largest residual, as a share of the energy that moved."""
    return float(abs(names["residual"]).max() / names["books"]["moved"][-1])


def loaded(name: str, duration: float, **values: Any) -> Any:
    """A scene that is not pushed at its end, which its books know nothing of."""
    return load(name, {"duration": duration, "run.verdict": "window", **values})


DISSIPATES = {"wall.kind": "kelvin-voigt", "wall.damping": 0.1}
SCENES = {
    "plain": lambda: loaded("fig6b", 1.0),
    "every effect": lambda: loaded("all_effects", 0.6),
    "every effect and a swap": lambda: loaded("all_effects", 0.6).swap("damping", at=0.3, damping=1.0),
    "a wall that dissipates": lambda: loaded("fig6a", 0.5, **DISSIPATES),
}


@pytest.mark.parametrize("name", SCENES)
def test_what_the_example_of_the_page_adds_up_leaves_nothing_but_rounding(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    names = added_up(CODE, SCENES[name](), tmp_path, monkeypatch)
    assert left_over(names) < 1e-12
    assert np.allclose(
        names["residual"], names["books"]["residual"], rtol=0.0, atol=1e-12 * names["books"]["moved"][-1]
    )
    assert len(names["parts"]) >= 5


@pytest.mark.parametrize(
    ("right", "wrong"),
    [('"actuator": -1', '"actuator": 1'), ('"_heat": -1', '"_heat": 1'), ('".true": -1', '".sampled": -1')],
)
def test_an_example_with_a_wrong_sign_or_the_wrong_book_leaves_much(
    right: str, wrong: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert CODE.count(right) == 1
    names = added_up(CODE.replace(right, wrong), SCENES["every effect"](), tmp_path, monkeypatch)
    assert left_over(names) > 1e-3


@pytest.mark.slow
def test_the_example_prints_what_the_page_shows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert CliRunner().invoke(app, [*shlex.split(RUN), "--in-process"]).exit_code == 0
    assert CliRunner().invoke(app, shlex.split(EXPORT)).exit_code == 0
    exec(compile(CODE, "books.md", "exec"), {})
    # The residual is rounding, which another processor may do otherwise.
    printed = [re.sub(r"(residual +)\S+", r"\1", text) for text in (capsys.readouterr().out, PRINTED)]
    assert printed[0] == printed[1]
