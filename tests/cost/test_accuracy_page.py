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
from haploop.tools.cost.data import Cost, CostFileError, Point, Price, PriceGroup, Spread, save
from haploop.tools.cost.findings import AGAIN, alike_sentence, effects_sentence, findings, sum_sentence, takes_away
from haploop.tools.cost.page import page, write
from haploop.tools.linear.stiffness_limit import StiffnessLimit
from haploop.tools.operations import NONE, WHOLE
from helpers.data.costs import METHODS, fake_cost

HOUSE = Path(__file__).parents[2]


def price(what: str, time: float, adds: Spread | None, limit: StiffnessLimit | None = None) -> Price:
    return Price(what, Spread(time, 0.9 * time, 1.1 * time), adds, f"what {what} buys", 1e-4, stiffness=limit)


def group(name: str, times: dict[str, float], limits: dict[str, float] | None = None) -> PriceGroup:
    """Prices whose intervals are 1 to either side of what they add to the first."""
    base = next(iter(times.values()))
    prices = []
    for what, time in times.items():
        limit = StiffnessLimit(limits[what], "steady", "limit-cycle") if limits else None
        adds = Spread(time - base, time - base - 1.0, time - base + 1.0) if prices else None
        prices.append(price(what, time, adds, limit))
    return PriceGroup(name, f"About {name}", "a tick", 7, f"how {name} was measured", prices)


def priced(friction: float = 16.0) -> list[PriceGroup]:
    limits = {"1 kHz": 220.0, "5 kHz": 1100.0}
    return [
        group("books", {"without": 4.0, "with": 6.0}),
        group("log", {"none": 40.0, "ticks": 44.0, "steps": 50.0}),
        group("effects", {NONE: 1.0, AGAIN: 1.1, "friction": friction, "noise": 1.2, WHOLE: 41.0}),
        group("processes", {"one process": 6.0, "three processes": 42.0}),
        group("delay", {"0 ms": 50.0, "10 ms": 20.0}, {"0 ms": 220.0, "10 ms": 11.0}),
        group("control rate", {"1 kHz": 6.0, "5 kHz": 24.0}, limits),
    ]


@pytest.fixture
def cost() -> Cost:
    return dataclasses.replace(fake_cost(), prices=priced())


def changed(cost: Cost, change: Callable[[Point], Point]) -> Cost:
    scenes = [dataclasses.replace(scene, points=[change(point) for point in scene.points]) for scene in cost.scenes]
    return dataclasses.replace(cost, scenes=scenes)


def rows(cost: Cost, title: str) -> dict[str, list[str]]:
    """The rows of the one table of findings whose title holds these words, by their first cell."""
    (table,) = [table for table in findings(cost) if title in table.title]
    return {cells[0]: cells[1:] for cells in table.rows}


def test_the_page_holds_every_table_of_findings_with_and_without_prices(cost: Cost) -> None:
    assert [table.title.split()[0] for table in findings(cost)] == ["What", "A", "A"]
    for made in (cost, fake_cost()):
        text = page(made)
        for table in findings(made):
            assert f"## {table.title}" in text
            assert all(f"| {' | '.join(cells)} |" in text for cells in table.rows)


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


def test_the_next_digit_costs_what_the_cheapest_setting_within_it_takes(cost: Cost) -> None:
    """rk4 reaches 2e-5 (n)^-4 m in 25 + 6 n, exact any error in 26: nothing is cheaper than that at any error."""
    steady = rows(cost, "next digit")["A wall that steadies"]
    assert steady == ["exact at 1 kHz, 26 (25–28)", "same", "same", "same", "same", "any error"]

    def rk4_at_half_the_time(point: Point) -> Point:
        time = point.time
        assert time
        half = Spread(0.5 * time.median, 0.5 * time.low, 0.5 * time.high)
        return dataclasses.replace(point, time=half) if point.method == "rk4" else point

    steady = rows(changed(cost, rk4_at_half_the_time), "next digit")["A wall that steadies"]
    # 2e-5, 1.25e-6, 3.2e-8 m at 1, 2, 5 kHz in 15.5, 18.5, 27.5: the last is dearer than exact.
    either = "exact at 1 kHz or rk4 at 5 kHz"
    settings = [cell.split(",")[0] for cell in steady]
    assert settings == ["rk4 at 1 kHz", "rk4 at 2 kHz", "same", either, "same", "1.3 µm"]


def test_machine_code_has_a_row_and_a_half_sentence_of_its_own_and_leaves_the_others_as_they_were(cost: Cost) -> None:
    def rk4_at_half_the_time(point: Point) -> Point:
        return dataclasses.replace(point, time=times_of(point, 0.5)) if point.method == "rk4" else point

    plain = changed(cost, rk4_at_half_the_time)
    quick = [
        dataclasses.replace(
            scene, compiled=[dataclasses.replace(p, time=times_of(p, 0.1)) for p in scene.points if p.method == "exact"]
        )
        for scene in plain.scenes
    ]
    compiled = dataclasses.replace(plain, scenes=quick)
    before, after = rows(plain, "next digit"), rows(compiled, "next digit")
    assert {title: after[title] for title in before} == before
    assert after["A wall that steadies, machine code"][-1] == "any error"
    assert takes_away(compiled) == f"{takes_away(plain)} With friction as machine code, one is in none of them."


def times_of(point: Point, share: float) -> Spread:
    assert point.time
    return Spread(share * point.time.median, share * point.time.low, share * point.time.high)


def test_where_the_reference_is_not_known_well_enough_no_setting_is_named(cost: Cost) -> None:
    swings = rows(cost, "next digit")["A wall in a limit cycle"]
    assert swings[3:5] == ["reference not known", "same"]


def test_operations_a_tick_are_those_of_a_step_times_the_steps_that_a_tolerance_asks_for(cost: Cost) -> None:
    """In the steady wall rk4 is within 1 um from 5 kHz on: 5 steps of 50; the exact flow in one step of 17."""
    alike = rows(cost, "written alike")
    assert alike["exact"][-2] == "17"
    assert alike["rk4"][-2] == "250"
    assert alike["euler"][-2] == "–"
    assert alike["rk4"][:2] == ["50", "100"]


def test_a_sentence_tells_what_comes_of_how_a_method_is_written(cost: Cost) -> None:
    said = alike_sentence(cost)
    assert said
    assert "euler takes 1.0 times as long as the exact flow" in said
    assert "takes 0.59 (0.58–0.61) times as long" in said
    assert alike_sentence(dataclasses.replace(cost, alike=[])) is None


def test_a_swing_is_off_by_a_number_with_its_interval_or_by_some_at_most(cost: Cost) -> None:
    swings = rows(cost, "error of the mean swing")
    assert swings["euler"][0] == "3.0 mm ± 100 µm"
    assert swings["exact"][0] == "at most 109 µm"
    assert set(swings) == set(METHODS)


def test_on_a_machine_twice_as_slow_the_page_is_the_same_but_for_the_yardstick(cost: Cost) -> None:
    """Times are over the yardstick's, so another machine shows in its one sentence alone."""
    load = cost.load
    assert load
    slower = dataclasses.replace(cost, load=dataclasses.replace(load, yardstick_us=2.0 * load.yardstick_us))
    one, other = page(cost).splitlines(), page(slower).splitlines()
    assert [(a, b) for a, b in zip(one, other, strict=True) if a != b] == [(one[-1], other[-1])]


def test_the_dearest_effect_and_those_that_cost_nothing_are_told(cost: Cost) -> None:
    (effects,) = [group for group in cost.prices if group.name == "effects"]
    assert effects_sentence(effects) == (
        "Alone, friction costs most, 15 (14–16) yardsticks a tick; 1 of 2 effects cannot be told apart from nothing."
    )
    assert sum_sentence(effects) == "Added up they cost 15, all at once 40 (39–41)."


def test_the_one_sentence_says_where_nothing_beats_the_exact_flow(cost: Cost) -> None:
    assert takes_away(cost).startswith("In all 5 scenes no method was found cheaper than the exact flow")

    def rk4_for_nothing(point: Point) -> Point:
        return dataclasses.replace(point, time=Spread(1.0, 1.0, 1.0)) if point.method == "rk4" else point

    freed = dataclasses.replace(cost, scenes=changed(cost, rk4_for_nothing).scenes[:1] + cost.scenes[1:])
    assert takes_away(freed).startswith(
        "In 4 of 5 scenes no method was found cheaper than the exact flow at any error;"
    )


def test_the_page_is_short_and_shows_what_it_was_measured_on(cost: Cost) -> None:
    text = page(cost)
    for one in priced():
        shown = [p.what in text for p in one.prices]
        assert all(shown) or one.name in ("delay", "control rate")
    assert all(words in text for words in (cost.machine, cost.commit, "numpy 2.1.0", cost.yardstick))
    assert re.findall(r"\]\((\w+\.png)\)", text) == ["accuracy.png", "accuracy_prices.png"]
    assert len(text.split()) < 1700


@pytest.mark.slow
def test_page_and_figures_are_written_side_by_side(cost: Cost, tmp_path: Path) -> None:
    save(cost, tmp_path)
    target = write(tmp_path, tmp_path / "docs")
    linked = re.findall(r"\]\((\w+\.png)\)", target.read_text(encoding="utf-8"))
    assert all((target.parent / name).read_bytes().startswith(b"\x89PNG") for name in linked)
    assert {path.name for path in target.parent.iterdir()} == {"accuracy.md", *linked}


@pytest.mark.slow
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
