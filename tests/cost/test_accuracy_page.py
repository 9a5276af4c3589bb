"""docs/accuracy.md: tables of findings whose numbers all come from cost.json, and all that was measured."""

from __future__ import annotations

import ast
import dataclasses
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from haploop.tools.cost import findings as findings_module
from haploop.tools.cost.data import Cost, CostFileError, Point, PriceGroup, Spread, price, save
from haploop.tools.cost.findings import FindingTable, findings, length
from haploop.tools.cost.page import page, write
from haploop.tools.linear.stiffness_limit import StiffnessLimit
from haploop.tools.operations import AGAIN, NONE, WHOLE
from helpers.data.costs import METHODS, RATES, fake_cost

HOUSE = Path(__file__).parents[2]


def group(
    name: str, times: dict[str, float], limits: dict[str, float] | None = None, confirmed: bool = True
) -> PriceGroup:
    prices = []
    for what, us in times.items():
        above = "limit-cycle" if confirmed else "steady"
        limit = StiffnessLimit(limits[what], "steady", above) if limits else None
        base = prices[0].time if prices else None
        prices.append(price(what, [us], base, f"what {what} buys", is_left_out=name == "effects", stiffness=limit))
    return PriceGroup(name, f"About {name}", "µs per tick", 7, f"how {name} was measured", prices)


def priced(delay_us: float = 20.0, confirmed: bool = True) -> list[PriceGroup]:
    limits = {"1 kHz": 220.0, "5 kHz": 1100.0}
    return [
        group("books", {"without": 4.0, "with": 6.0}),
        group("log", {"none": 40.0, "ticks": 44.0, "steps": 50.0}),
        group("effects", {WHOLE: 400.0, AGAIN: 404.0, "friction": 150.0, "noise": 398.0, NONE: 8.0}),
        group("processes", {"one process": 6.0, "three processes": 42.0}),
        group("delay", {"0 ms": 50.0, "10 ms": delay_us}, {"0 ms": 220.0, "10 ms": 11.0}),
        group("control rate", {"1 kHz": 6.0, "5 kHz": 24.0}, limits, confirmed),
    ]


@pytest.fixture
def cost() -> Cost:
    return dataclasses.replace(fake_cost(), prices=priced())


def changed(cost: Cost, change: Callable[[Point], Point]) -> Cost:
    scenes = [dataclasses.replace(scene, points=[change(point) for point in scene.points]) for scene in cost.scenes]
    return dataclasses.replace(cost, scenes=scenes)


def tables(cost: Cost) -> dict[str, FindingTable]:
    """The tables of findings by what they are about."""
    names = ("The cheapest setting", "Methods", "The other prices")
    return {name: table for table in findings(cost) for name in names if table.title.startswith(name)}


def rows(cost: Cost, table: str) -> dict[str, list[str]]:
    """The rows of a table of findings by their first cell."""
    return {cells[0]: cells[1:] for cells in tables(cost)[table].rows}


def test_the_page_holds_every_table_of_findings_with_and_without_prices(cost: Cost) -> None:
    assert len(findings(cost)) == len(tables(cost)) == 3
    assert list(tables(fake_cost())) == ["The cheapest setting", "Methods"]
    for made in (cost, fake_cost()):
        text = page(made)
        for table in findings(made):
            assert f"### {table.title}" in text
            assert all(f"| {' | '.join(cells)} |" in text for cells in table.rows)
            assert all(note in text for note in table.notes)


def test_no_number_of_a_finding_is_typed() -> None:
    """None of the sentences' own words has a digit, so that each digit on the page is the data's."""
    for module in (findings_module,):
        tree = ast.parse(Path(str(module.__file__)).read_text(encoding="utf-8"))
        documentation = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
        formats = {
            id(part)
            for node in ast.walk(tree)
            if isinstance(node, ast.FormattedValue) and node.format_spec
            for part in ast.walk(node.format_spec)
        }
        words = [
            node.value
            for node in ast.walk(tree)
            if isinstance(node, ast.Constant) and isinstance(node.value, str)
            if id(node) not in documentation and id(node) not in formats
        ]
        assert words
        assert [word for word in words if re.search(r"\d", word)] == []


def test_numbers_are_those_of_the_data(cost: Cost) -> None:
    settings = rows(cost, "The cheapest setting")
    assert {cells[0] for cells in settings.values()} == {"exact at 1 kHz"}
    steady = next(scene for scene in cost.scenes if scene.title == "A wall that steadies")
    times = {p.plant_rate: p.us_per_tick.median for p in steady.points if p.method == "exact" and p.us_per_tick}
    own_us, best_us = times[10_000], times[1_000]
    assert settings[steady.title][1:] == [
        f"{best_us:.1f}",
        "exact at 10 kHz",
        f"{own_us:.1f}",
        f"{own_us / best_us:.2f}",
    ]
    assert "A wall in a limit cycle" not in settings
    (note,) = tables(cost)["The cheapest setting"].notes
    assert note == "Left out, since the reference itself is not known that well: A wall in a limit cycle."
    methods = rows(cost, "Methods")
    assert methods["exact"][:3] == ["4 of 4", "1 kHz", "1.0"]
    # rk4 needs 5 kHz everywhere (55 us against 26): its error at 2 kHz is 1.25 um even in the easiest scene.
    assert methods["rk4"][2].startswith("2.1")
    for place, count in ((-2, lambda p: p.error is None), (-1, lambda p: p.error and not p.error.verdict_right)):
        counted = [sum(bool(count(p)) for s in cost.scenes for p in s.points if p.method == m) for m in methods]
        assert [cells[place] for cells in methods.values()] == [f"{number} of 35" for number in counted]
        assert any(counted)
    errors = [
        p.error.size_m
        for s in cost.scenes
        if s.reference.pointwise
        for p in s.points
        if p.method == "euler" and p.error
    ]
    assert methods["euler"][3] == length(max(errors))
    prices = rows(cost, "The other prices")
    assert [(cells[0].split()[0], cells[2]) for cells in tables(cost)["The other prices"].rows] == [
        ("all", "50.0"), ("three", "7.00"), ("the", "1.50"), ("every", "1.25"),
    ]  # fmt: skip
    assert prices["all effects at once"][0] == "the same scene without any"
    (note,) = tables(cost)["The other prices"].notes
    assert note == "The dearest effect is friction: without it a tick with all effects would save 250 of 400 µs."


def test_on_a_machine_twice_as_slow_the_findings_about_methods_are_the_same(cost: Cost) -> None:
    def slower(point: Point) -> Point:
        time = point.us_per_tick
        assert time is not None
        return dataclasses.replace(point, us_per_tick=Spread(2 * time.median, 2 * time.q1, 2 * time.q3))

    assert tables(changed(cost, slower))["Methods"] == tables(cost)["Methods"]


def test_where_another_method_is_cheaper_it_is_named(cost: Cost) -> None:
    def rk4_for_nothing(point: Point) -> Point:
        return dataclasses.replace(point, us_per_tick=Spread(1.0, 1.0, 1.0)) if point.method == "rk4" else point

    made = changed(cost, rk4_for_nothing)
    assert all(cells[0].startswith("rk4 at") for cells in rows(made, "The cheapest setting").values())
    assert rows(made, "Methods")["exact"][2] == "26"


def test_where_nothing_failed_no_failure_is_counted(cost: Cost) -> None:
    good = cost.scenes[0].points[0].error

    def right(point: Point) -> Point:
        return dataclasses.replace(point, error=good, failure=None)

    assert all(cells[-2:] == ["0 of 35", "0 of 35"] for cells in rows(changed(cost, right), "Methods").values())


def test_where_no_setting_meets_the_tolerance_that_is_said(cost: Cost) -> None:
    strict = dataclasses.replace(cost, tolerance_m=1e-12, scenes=cost.scenes[:1])
    assert next(iter(rows(strict, "The cheapest setting").values()))[0].startswith("exact")
    coarse = dataclasses.replace(cost.scenes[0], points=[p for p in cost.scenes[0].points if p.method == "euler"])
    none = dataclasses.replace(cost, scenes=[coarse])
    assert next(iter(rows(none, "The cheapest setting").values()))[0] == "none"
    assert rows(none, "Methods")["euler"][:3] == ["0 of 1", "–", "–"]


def test_an_effect_that_chance_could_explain_is_not_called_dear(cost: Cost) -> None:
    groups = priced()
    groups[2] = group("effects", {WHOLE: 400.0, AGAIN: 380.0, "friction": 395.0, NONE: 8.0})
    prices = tables(dataclasses.replace(cost, prices=groups))["The other prices"]
    assert prices.rows[0][0] == "all effects at once"
    assert prices.notes == ()


def test_the_page_shows_every_scene_point_price_and_what_it_was_measured_on(cost: Cost) -> None:
    text = page(cost)
    for scene in cost.scenes:
        for words in (f"### {scene.title}", scene.reference.how, scene.advice):
            assert words in text
    points = text.partition("## Error against time")[2]
    rows = [line for line in points.splitlines() if line.startswith(tuple(f"| {method} |" for method in METHODS))]
    assert len(rows) == len(METHODS) * len(cost.scenes)
    assert all(row.count("|") == len(RATES) + 2 and ", " in row for row in rows)
    assert sum(row.count("failed") for row in rows) == sum(p.error is None for s in cost.scenes for p in s.points)
    assert sum(row.count("**") for row in rows) == 2 * len(cost.scenes)
    for one in priced():
        assert f"### {one.title}" in text
        assert all(one.how in text and p.buys in text for p in one.prices)
    assert all(words in text for words in (cost.machine, cost.commit, "numpy 2.1.0", "The machine was quiet"))
    assert re.findall(r"\]\((\w+\.png)\)", text) == ["accuracy.png", "accuracy_prices.png"]


@pytest.mark.slow
def test_page_and_figures_are_written_side_by_side(cost: Cost, tmp_path: Path) -> None:
    save(cost, tmp_path)
    target = write(tmp_path, tmp_path / "docs")
    linked = re.findall(r"\]\((\w+\.png)\)", target.read_text(encoding="utf-8"))
    assert all((target.parent / name).read_bytes().startswith(b"\x89PNG") for name in linked)
    assert {path.name for path in target.parent.iterdir()} == {"accuracy.md", *linked}


def test_without_measurements_the_command_says_what_to_run(tmp_path: Path) -> None:
    with pytest.raises(CostFileError, match="Run haploop cost"):
        write(tmp_path, tmp_path / "docs")
    command = [sys.executable, "-m", "haploop.tools.cost.page", str(tmp_path), str(tmp_path)]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ended.returncode == 2
    assert "Run haploop cost" in ended.stderr
    assert "Traceback" not in ended.stderr


def test_the_readme_links_to_the_page_on_its_first_screen_once_make_accuracy_has_written_it() -> None:
    first_screen = (HOUSE / "README.md").read_text(encoding="utf-8").splitlines()[:20]
    assert sum("](docs/accuracy.md)" in line for line in first_screen) == (HOUSE / "docs/accuracy.md").exists()
    assert "cost.page runs/accuracy docs" in (HOUSE / "Makefile").read_text(encoding="utf-8")
