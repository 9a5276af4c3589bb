"""docs/accuracy.md: five findings whose sentences and numbers all come from cost.json, and all that was measured."""

from __future__ import annotations

import ast
import dataclasses
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from haploop.tools.ablation import AGAIN, NONE, WHOLE
from haploop.tools.cost import finding_words
from haploop.tools.cost import findings as accuracy_findings
from haploop.tools.cost.data import Cost, CostFileError, Point, Spread, save
from haploop.tools.cost.draw.page import page, write
from haploop.tools.cost.findings import findings
from haploop.tools.cost.prices import findings as price_findings
from haploop.tools.cost.prices.data import PriceGroup, as_data, price
from haploop.tools.linear.stiffness_limit import StiffnessLimit
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
    return dataclasses.replace(fake_cost(), prices=as_data(priced()))


def changed(cost: Cost, change: Callable[[Point], Point]) -> Cost:
    scenes = [dataclasses.replace(scene, points=[change(point) for point in scene.points]) for scene in cost.scenes]
    return dataclasses.replace(cost, scenes=scenes)


def texts(cost: Cost) -> list[str]:
    return [finding.text for finding in findings(cost)]


def test_the_page_holds_five_findings_with_and_without_prices(cost: Cost) -> None:
    for made in (cost, fake_cost()):
        found = re.findall(r"^(\d)\. \*\*.+?\.\*\* .+\.$", page(made), re.MULTILINE)
        assert found == ["1", "2", "3", "4", "5"]
    assert len({finding.about for finding in findings(cost)}) == 5


def test_no_number_of_a_finding_is_typed() -> None:
    """None of the sentences' own words has a digit, so that each digit on the page is the data's."""
    for module in (accuracy_findings, price_findings, finding_words):
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
    cheapest, others, failures, prices, stiffness = texts(cost)
    assert "exact is the cheapest method within 1.00 µm of the reference in 4 of 4 scenes" in cheapest
    assert "at a plant rate of 1 kHz" in cheapest
    assert (
        "Left out, since the reference itself is not known that well: A wall in a limit cycle (to 3.00 µm)" in cheapest
    )
    # rk4 needs 5 kHz everywhere (55 us against 26): its error at 2 kHz is 1.25 um even in the easiest scene.
    assert "rk4 2.1 times the time" in others
    failed = sum(point.error is None for scene in cost.scenes for point in scene.points)
    wrong = sum(bool(p.error and not p.error.verdict_right) for scene in cost.scenes for p in scene.points)
    assert failures.startswith(f"{failed} of 210 settings did not get to the end; {wrong} of 210")
    assert failures.endswith("exact and dop853 never did.")
    order = [
        "all effects at once 50.0 times",
        "three processes without delay 7.00 times",
        "energy books",
        "logged 1.25",
    ]
    places = [prices.index(words) for words in order]
    assert places == sorted(places)
    assert "friction it would save 250 of 400 µs a tick" in prices
    assert "from 220 N/m to 1100 N/m (5.0 times), and a simulated second takes 4.0 times as long" in stiffness
    assert "from 220 N/m to 11.0 N/m, while a tick as processes takes 0.40 times as long, since delay is" in stiffness


def test_on_a_machine_twice_as_slow_the_findings_about_methods_are_the_same(cost: Cost) -> None:
    def slower(point: Point) -> Point:
        time = point.us_per_tick
        assert time is not None
        return dataclasses.replace(point, us_per_tick=Spread(2 * time.median, 2 * time.q1, 2 * time.q3))

    assert texts(changed(cost, slower)) == texts(cost)


def test_where_another_method_is_cheaper_it_is_named(cost: Cost) -> None:
    def rk4_for_nothing(point: Point) -> Point:
        return dataclasses.replace(point, us_per_tick=Spread(1.0, 1.0, 1.0)) if point.method == "rk4" else point

    first, second, *_ = texts(changed(cost, rk4_for_nothing))
    assert first.startswith("rk4 is the cheapest method")
    assert second.startswith("Against rk4")
    assert "exact 26 times the time" in second


def test_where_nothing_failed_that_is_said(cost: Cost) -> None:
    good = cost.scenes[0].points[0].error

    def right(point: Point) -> Point:
        return dataclasses.replace(point, error=good, failure=None)

    assert "None of 210 settings failed, and every verdict was right." in texts(changed(cost, right))


def test_where_no_setting_meets_the_tolerance_that_is_said(cost: Cost) -> None:
    first = texts(dataclasses.replace(cost, tolerance_m=1e-12, scenes=cost.scenes[:1]))[0]
    assert first.startswith("exact")
    coarse = dataclasses.replace(cost.scenes[0], points=[p for p in cost.scenes[0].points if p.method == "euler"])
    none = texts(dataclasses.replace(cost, scenes=[coarse]))[0]
    assert none == "No setting came within 1.00 µm of the reference in 1 of 1 scene."


def test_delay_that_saves_nothing_is_not_praised_and_unconfirmed_limits_are_theory(cost: Cost) -> None:
    made = dataclasses.replace(cost, prices=as_data(priced(delay_us=60.0, confirmed=False)))
    stiffness = texts(made)[-1]
    assert "takes 1.2 times as long." in stiffness
    assert "lookahead" not in stiffness
    assert "from 220 N/m in theory to 1100 N/m in theory" in stiffness


def test_an_effect_that_chance_could_explain_is_not_called_dear(cost: Cost) -> None:
    groups = priced()
    groups[2] = group("effects", {WHOLE: 400.0, AGAIN: 380.0, "friction": 395.0, NONE: 8.0})
    prices = texts(dataclasses.replace(cost, prices=as_data(groups)))[3]
    assert "all effects at once 50.0 times" in prices
    assert "friction" not in prices


def test_the_page_shows_every_scene_point_price_and_what_it_was_measured_on(cost: Cost) -> None:
    text = page(cost)
    for scene in cost.scenes:
        for words in (f"### {scene.title}", scene.reference.how, scene.advice):
            assert words in text
    rows = [line for line in text.splitlines() if line.startswith(tuple(f"| {method} |" for method in METHODS))]
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
    command = [sys.executable, "-m", "haploop.tools.cost.draw.page", str(tmp_path), str(tmp_path)]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ended.returncode == 2
    assert "Run haploop cost" in ended.stderr
    assert "Traceback" not in ended.stderr


def test_the_readme_links_to_the_page_on_its_first_screen_once_make_accuracy_has_written_it() -> None:
    first_screen = (HOUSE / "README.md").read_text(encoding="utf-8").splitlines()[:20]
    assert sum("](docs/accuracy.md)" in line for line in first_screen) == (HOUSE / "docs/accuracy.md").exists()
    assert "cost.draw.page runs/accuracy docs" in (HOUSE / "Makefile").read_text(encoding="utf-8")
