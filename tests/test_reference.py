"""The references of log and summary: no column and no entry of any run lacks a meaning."""

from __future__ import annotations

import importlib.util
import json
import shlex
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from haploop.api import load, read, run
from haploop.controller.dissipation import Element, Motion
from haploop.launch.foreign import read_programs
from haploop.launch.runs import start
from haploop.launch.spec import RunFailed
from haploop.logger.log.recording import Table

HOUSE = Path(__file__).parents[1]
ORACLES = HOUSE / "tests/oracles"
WINDOW = {"run.verdict": "window"}


def module(name: str) -> Any:
    """A module of docs/site, which is no package."""
    place = importlib.util.spec_from_file_location(f"site_{name}", HOUSE / f"docs/site/{name}.py")
    assert place
    assert place.loader
    made = importlib.util.module_from_spec(place)
    place.loader.exec_module(made)
    return made


meanings = module("meanings")


def keys_of(entry: Any, key: str = "") -> list[str]:
    """The dotted keys of all that a summary holds; an empty list is its own entry."""
    inner = entry.items() if isinstance(entry, dict) else enumerate(entry) if isinstance(entry, list) else None
    if inner is None:
        return [key]
    return [one for name, value in inner for one in keys_of(value, f"{key}.{name}".lstrip("."))]


def untold(summary: Mapping[str, Any]) -> list[str]:
    """The entries of a summary that the reference does not explain."""
    return [key for key in keys_of(dict(summary)) if not meanings.summary().get(meanings.pattern(key))]


def untold_columns(log: Mapping[str, Any]) -> list[str]:
    """The columns of a log that the reference does not explain, or tells another unit of."""
    tables = {topic: rows for topic, rows in log.items() if isinstance(rows, Table)}
    found = []
    for topic, rows in tables.items():
        for name, unit in rows.units.items():
            column = meanings.column(topic, name)
            has_own_unit = column is meanings.OWN
            if column is None or not column.meaning or not (has_own_unit or column.unit == unit):
                found.append(f"{topic} {name}")
    return found


class Kept(dict[str, Any]):
    """The files of a run, read as they are: the summary, checksum included, and the log."""

    def __init__(self, out: Path) -> None:
        super().__init__(json.loads((out / "summary.json").read_text(encoding="utf-8")))
        self.log = read(out)


class Fails(Element):
    """Fails after some ticks."""

    kind = "fails"

    def force(self, motion: Motion) -> Any:
        return 1.0 if motion.x > -1e9 and motion.period_s < 0.0 else [][0]


STOPS = {"event": [{"at": 0.1, "stop": True}]}
SHORT = {"duration": 0.3, **WINDOW}
SCENES: dict[str, Any] = {
    "every effect, swapped": lambda: load("all_effects", SHORT).swap("damping", at=0.2, damping=1.0),
    "pushed": lambda: load("fig6c", {"duration": 1.2}),
    "not pushed": lambda: load("fig6c", SHORT),
    "stopped": lambda: load("fig6c", {**SHORT, **STOPS}),
    "diverged": lambda: load("fig6c", {**SHORT, "diverged_beyond": 0.001}),
    "refused": lambda: load("fig6c", SHORT, elements=[Fails]).swap("fails", at=0.1),
    "a wall that dissipates": lambda: load("fig6c", {**SHORT, "wall.kind": "kelvin-voigt", "wall.damping": 0.1}),
    "one tick": lambda: load("tap", {**SHORT, "duration": 0.001}),
}


@pytest.mark.parametrize("name", SCENES)
def test_no_entry_of_a_summary_and_no_column_of_its_log_lacks_a_meaning(name: str, tmp_path: Path) -> None:
    run(SCENES[name](), tmp_path / "run")
    kept = Kept(tmp_path / "run")
    assert untold(kept) == []
    assert untold_columns(kept.log) == []
    assert {"/energy", "/controller", "/plant"} <= kept.log.keys()


def test_no_entry_of_a_run_that_failed_lacks_a_meaning(tmp_path: Path) -> None:
    scene = load("fig6c", {**SHORT, "dissipation": [{"kind": "fails"}]}, elements=[Fails])
    with pytest.raises(RunFailed):
        run(scene, tmp_path / "run")
    kept = Kept(tmp_path / "run")
    assert kept["ended"] == "failed"
    assert untold(kept) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("program", "overrides", "entry"),
    [
        ("plant=own_plant.py gain 1e-3", ["duration=1"], "balance"),
        (
            "plant=own_plant.py gain 0",
            ["hand.kind=unmodelled", "device.position=-0.055", "duration=0.3"],
            "unmodelled_work_J",
        ),
        ("controller=plain_controller.py", ["duration=0.3"], "residual_J"),
    ],
)
def test_no_entry_of_a_run_with_a_program_of_somebody_elses_lacks_a_meaning(
    program: str, overrides: list[str], entry: str, tmp_path: Path
) -> None:
    role, _, words = program.partition("=")
    script, *options = words.split()
    node = f"{role}={shlex.join([sys.executable, str(ORACLES / script), *options])}"
    file = HOUSE / f"launch/scenes/fig6{'b' if role == 'plant' else 'c'}.toml"
    spec = start.prepare(file, overrides, out=tmp_path / "run", any_hand=True)
    start.run(spec, programs=read_programs([node], []))
    kept = Kept(tmp_path / "run")
    assert entry in kept["energy"]
    assert "programs" in kept
    assert untold(kept) == []
    assert untold_columns(kept.log) == []


@pytest.mark.slow
def test_no_entry_of_a_run_at_a_pace_lacks_a_meaning(tmp_path: Path) -> None:
    run(load("fig6c", SHORT), tmp_path / "run", processes=True, pace=5.0)
    kept = Kept(tmp_path / "run")
    assert kept["lateness"]["ticks"] > 0
    assert untold(kept) == []


def test_an_entry_or_a_column_that_is_added_is_found() -> None:
    done = run(load("fig6c", SHORT))
    summary = {**done.summary, "grade": 1, "window": {**done.summary["window"], "area_m": 0.0}}
    assert untold(summary) == ["window.area_m", "grade"]
    element = {**summary["energy"]["wall"], "spilled_J": 0.0}
    assert untold({"energy": {"elements": [element], "gravity_work_J": 1.0}})[-2:] == [
        "energy.elements.0.spilled_J",
        "energy.gravity_work_J",
    ]
    plant = done["/plant"]
    more = Table([*plant.items(), ("tilt", plant["x"]), ("v", plant["v"])], {**plant.units, "tilt": "", "v": "mm/s"})
    assert untold_columns({"/plant": more}) == ["/plant v", "/plant tilt"]
    assert untold_columns({"/energy": Table([("gravity_work", plant["x"])], {"gravity_work": "J"})})


def test_every_part_of_a_summary_that_has_a_type_says_what_each_of_its_entries_means() -> None:
    for kind in (meanings.Figures, meanings.Extremes, meanings.Finding):
        assert set(kind.__annotations__) == set(meanings.attributes(kind))


def test_the_pages_of_the_references_have_every_meaning() -> None:
    reference = module("reference")
    reference.run = lambda scene: run(scene.set(WINDOW))  # as the page's own, which takes long to be judged
    summary, log = reference.summary(), reference.log()
    told = [*meanings.summary().values(), *(one.meaning for of in meanings.columns().values() for one in of.values())]
    assert all(text and (text in summary or text in log) for text in told)
