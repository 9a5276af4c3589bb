"""The other prices: what is measured, counted, kept, put into words and drawn.

No test looks at how long anything took.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from haploop.controller.controller import Controller
from haploop.launch.plan.effects import effects_of
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.file import load
from haploop.protocol.scene.paths import value_at
from haploop.tools.cost import prices, prices_figure, times
from haploop.tools.cost.data import Price, PriceGroup, Spread, save
from haploop.tools.cost.data import load as load_cost
from haploop.tools.cost.findings import AGAIN, effects_sentence
from haploop.tools.cost.times import IN_PROCESS, PROCESSES, Store
from haploop.tools.figure.data import FigureError
from haploop.tools.linear.one_tick import OneTickMap
from haploop.tools.linear.stiffness_limit import StiffnessLimit
from haploop.tools.operations import AGAIN as ABLATED_AGAIN
from haploop.tools.operations import NONE, WHOLE, Operations, ablations
from haploop.tools.trajectory import trajectory
from helpers.data.costs import fake_cost
from helpers.scenes.least import KINDS, scene
from helpers.shown import artists

SCENES = Path(__file__).parents[2] / "launch/scenes"


def price(what: str, time: float, adds: float | None = None, doubt: float = 0.5, **more: Any) -> Price:
    """A price whose intervals reach as far as this to either side."""
    added = None if adds is None else Spread(adds, adds - doubt, adds + doubt)
    return Price(what, Spread(time, time - doubt, time + doubt), added, "something", **more)


def test_an_ablation_leaves_out_each_effect_once_and_in_the_end_all() -> None:
    everything = load(SCENES / "all_effects.toml")
    named = [effect.name for effect in effects_of(everything)]
    parts = ablations(everything)
    assert list(parts) == [WHOLE, ABLATED_AGAIN, *named, NONE]
    assert parts[WHOLE] == parts[ABLATED_AGAIN] == everything
    for name in named:
        assert name not in {effect.name for effect in effects_of(parts[name])}
    assert not effects_of(parts[NONE])


def test_each_effect_stands_alone_but_for_what_it_is_read_through_with_its_own_values() -> None:
    everything = load(SCENES / "all_effects.toml")
    read = "acceleration.source = accelerometer"
    for effect in effects_of(everything):
        scene = prices.alone(everything, effect.name)
        through = {read} if effect.key.startswith("accelerometer") else set()
        # The table of the accelerometer is there for its bandwidth, delay or range, and ideal otherwise.
        assert {each.name for each in effects_of(scene)} - {"accelerometer"} == {effect.name} - {
            "accelerometer"
        } | through
        for key in effect.left_out or (effect.key,):
            assert value_at(scene, key) == value_at(everything, key)
    assert not effects_of(prices.alone(everything))


@pytest.mark.slow
def test_an_effect_alone_moves_the_led_device_by_little_of_its_way(jobs: prices.Jobs) -> None:
    """30 mm, in and out of the wall; what the controller only reads moves it not at all."""
    runs = {name: trajectory(job.scene).x_m for name, job in jobs["effects"].items()}
    plain = runs[NONE]
    assert np.ptp(plain) == pytest.approx(0.03, rel=0.02)
    assert -0.018 < plain.min() < -0.015
    moved = {name: np.abs(x - plain).max() for name, x in runs.items()}
    assert max(moved.values()) < 1e-3
    assert all(way < 1e-12 for name, way in moved.items() if name.startswith("acceler"))
    assert moved["friction"] > 1e-5


def test_groups_survive_cost_json(tmp_path: Path) -> None:
    limit = StiffnessLimit(220.0, "steady", "limit-cycle")
    group = PriceGroup("delay", "Delay", "a tick", 3, "how", [price("0 ms", 1.0, stiffness=limit)])
    made = fake_cost()
    made.prices.append(group)
    save(made, tmp_path)
    assert load_cost(tmp_path).prices == [group]


@pytest.fixture(scope="module")
def jobs() -> prices.Jobs:
    return prices.price_jobs([])


def test_each_group_has_its_jobs_baseline_first(jobs: prices.Jobs) -> None:
    effects = [effect.name for effect in effects_of(load(SCENES / "all_effects.toml"))]
    assert {group: list(members) for group, members in jobs.items()} == {
        "books": ["without", "with"],
        "log": ["none", "ticks", "steps"],
        "effects": [NONE, AGAIN, *sorted(effects, key=lambda name: "=" not in name), WHOLE],
        "processes": ["one process", "three processes"],
        "delay": ["0 ms", "1 ms", "2 ms", "5 ms", "10 ms"],
        "control rate": ["1 kHz", "0.5 kHz", "2 kHz", "5 kHz", "10 kHz"],
    }


def test_what_is_the_same_run_is_timed_once_and_nothing_else_is(jobs: prices.Jobs) -> None:
    assert jobs["books"]["with"].key == jobs["processes"]["one process"].key == jobs["control rate"]["1 kHz"].key
    assert jobs["log"]["none"].key == jobs["processes"]["three processes"].key
    assert jobs["log"]["steps"].key == jobs["delay"]["0 ms"].key
    every = [job.key for members in jobs.values() for job in members.values()]
    assert len(every) - len(set(every)) == 4


def test_stiffness_falls_with_delay_and_grows_with_control_rate(jobs: prices.Jobs) -> None:
    def limits(group: str) -> list[float]:
        return [OneTickMap.from_scene(job.scene).stiffness_limit() for job in jobs[group].values()]

    delays = limits("delay")
    assert delays == sorted(delays, reverse=True)
    one, half, two, five, ten = limits("control rate")
    assert half < one < two < five < ten
    assert ten / one == pytest.approx(10.0, rel=0.01)


@pytest.mark.slow
def test_without_books_plant_and_controller_do_just_what_they_do_in_a_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same samples are answered by the same commands, every one of them."""
    made = scene(
        duration=0.3,
        device={"mass": 0.02, "damping": 0.1, "velocity": -0.3},
        wall={"position": -0.01, "stiffness": 300.0},
    )
    answered: dict[str, list[Any]] = {}

    def spy(where: str) -> type:
        class Spy(Controller):
            def answer(self, samples: Any) -> list[float]:
                forces = super().answer(samples)
                answered.setdefault(where, []).extend(zip(samples, forces, strict=True))
                return forces

        return Spy

    monkeypatch.setattr(prices, "Controller", spy("bare"))
    monkeypatch.setattr("haploop.launch.runs.in_process.Controller", spy("run"))
    prices.bare_us(made)
    run_in_process(made, KINDS)
    assert answered["bare"] == answered["run"]
    assert len(answered["run"]) == 300


class Measuring:
    """Prices in a directory, with clocks that are counted and not read."""

    def __init__(self, directory: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.directory, self.runs, self.stop_after = directory, 0, math.inf
        limit = StiffnessLimit(100.0, "steady", "limit-cycle")
        monkeypatch.setattr(prices, "stiffness_limit", lambda scene, kinds: limit)
        monkeypatch.setattr(prices, "operations", lambda scene, kinds: Operations(400, 100, 1))
        monkeypatch.setattr(prices, "loop_us", lambda scene: self.clock(5.0))
        monkeypatch.setattr(prices, "bare_us", lambda scene: self.clock(4.0))
        monkeypatch.setattr(prices, "run_us", lambda path, overrides, ticks: self.clock(40.0))
        monkeypatch.setattr(prices, "trajectory", lambda scene: SimpleNamespace(x_m=np.zeros(3)))
        monkeypatch.setattr(times, "loop_us", lambda scene: 2.0)  # the yardstick

    def clock(self, us: float) -> float | None:
        if self.runs >= self.stop_after:
            raise KeyboardInterrupt
        self.runs += 1
        return us

    def measure(self, processes_repeats: int = 2) -> list[PriceGroup]:
        store = Store(self.directory)
        measured = prices.Prices(store, {IN_PROCESS: 3, PROCESSES: processes_repeats})
        measured.measure(lambda name, count: lambda: None)
        return measured.groups()


@pytest.fixture
def measuring(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Measuring:
    return Measuring(tmp_path, monkeypatch)


@pytest.mark.slow
def test_all_groups_are_measured_and_a_second_time_nothing_is(measuring: Measuring) -> None:
    groups = measuring.measure()
    assert [group.name for group in groups] == ["books", "log", "effects", "processes", "delay", "control rate"]
    books = groups[0]
    assert [p.time.median for p in books.prices] == [2.0, 2.5]
    assert [p.adds for p in books.prices] == [None, Spread(0.5, 0.5, 0.5)]
    assert [group.repeats for group in groups] == [3, 2, 3, 2, 2, 3]
    assert all(p.buys for group in groups for p in group.prices)
    counted = {g.name for g in groups if all(p.instructions_per_tick for p in g.prices)}
    assert counted == {"effects"}
    assert {g.name for g in groups if all(p.moves_m == 0.0 for p in g.prices)} == {"effects"}
    limited = {group.name for group in groups if all(p.stiffness for p in group.prices)}
    assert limited == {"delay", "control rate"}
    five_kHz = next(p for p in groups[5].prices if p.what == "5 kHz")
    assert five_kHz.time.median == 12.5  # of 5 ticks in a ms
    runs = measuring.runs
    assert measuring.measure() == groups
    assert measuring.runs == runs


@pytest.mark.slow
def test_stiffness_that_runs_do_not_confirm_is_told_as_theory(
    measuring: Measuring, monkeypatch: pytest.MonkeyPatch
) -> None:
    def words() -> set[str]:
        return {price.buys for group in measuring.measure(0) if group.name == "control rate" for price in group.prices}

    assert words() == {"a wall of up to 100 N/m stays steady"}
    odd = StiffnessLimit(100.0, "steady", "steady")
    monkeypatch.setattr(prices, "stiffness_limit", lambda scene, kinds: odd)
    measuring.directory = measuring.directory / "odd"
    measuring.directory.mkdir()
    assert all(text.startswith("in theory a wall of up to 100 N/m stays steady") for text in words())


@pytest.mark.slow
def test_a_measurement_that_was_stopped_goes_on_where_it_was(measuring: Measuring, tmp_path: Path) -> None:
    """In the end every record is there once, as if it had not been stopped."""
    measuring.stop_after = 30
    with pytest.raises(KeyboardInterrupt):
        measuring.measure()
    assert 0 < len(records(tmp_path)) < 80
    measuring.stop_after = math.inf
    groups = measuring.measure()
    measuring.directory = tmp_path / "at once"
    measuring.directory.mkdir()
    assert measuring.measure() == groups
    stopped, at_once = records(tmp_path), records(tmp_path / "at once")
    assert len(stopped) == len(set(stopped))
    assert set(stopped) == set(at_once)


def records(directory: Path) -> list[tuple[str, str, int]]:
    """What is kept, without what says how quiet the machine was."""
    lines = map(json.loads, (directory / "points.jsonl").read_text().splitlines())
    return [(line["what"], line["key"], line["repeat"]) for line in lines if line["what"] != "quiet"]


@pytest.mark.slow
def test_without_processes_their_prices_are_left_out(measuring: Measuring) -> None:
    assert [group.name for group in measuring.measure(0)] == ["books", "effects", "control rate"]


def drawn() -> tuple[Any, list[PriceGroup]]:
    steady, odd = StiffnessLimit(200.0, "steady", "limit-cycle"), StiffnessLimit(90.0, "limit-cycle", "limit-cycle")
    rates = [price("1 kHz", 6.0, stiffness=steady), price("0.5 kHz", 3.0, -3.0, stiffness=odd)]
    adds = {AGAIN: -0.2, "loss": 0.3, "friction": 20.0, WHOLE: 40.0}
    effects = [price(NONE, 2.0), *(price(what, 2.0 + added, added) for what, added in adds.items())]
    groups = [
        PriceGroup("log", "What is logged", "a tick", 3, "how", [price("none", 40.0), price("steps", 80.0, 40.0)]),
        PriceGroup("effects", "Each effect", "a tick", 3, "how", effects),
        PriceGroup("control rate", "Control rate", "a simulated ms", 3, "how", rates),
    ]
    return prices_figure.figure_of(groups), groups


def test_the_figure_has_a_bar_for_each_price_the_dearest_effect_first_and_what_may_be_nothing_in_grey() -> None:
    figure, groups = drawn()
    log, effects, _ = figure.axes
    assert [bar.get_width() for bar in log.patches] == [40.0, 80.0]
    assert [text.get_text() for text in artists(log, "value")] == ["40 (40–40)", "80 (80–80)"]
    assert [label.get_text() for label in effects.get_yticklabels()] == ["friction", "loss", AGAIN]
    bars = effects.patches
    assert [bar.get_width() for bar in bars] == [20.0, 0.3, -0.2]
    assert bars[0].get_facecolor() != bars[1].get_facecolor() == bars[2].get_facecolor()
    assert all(text.get_position()[0] > 0.0 for text in artists(effects, "value"))
    assert figure.get_suptitle() == effects_sentence(groups[1])


def test_the_figure_draws_stiffness_against_time_and_what_runs_did_not_confirm_hollow() -> None:
    figure, _ = drawn()
    curve = figure.axes[2]
    (confirmed,), (hollow,) = artists(curve, "confirmed"), artists(curve, "not confirmed")
    assert (confirmed.get_xdata()[0], confirmed.get_ydata()[0]) == (6.0, 200.0)
    assert (hollow.get_xdata()[0], hollow.get_ydata()[0]) == (3.0, 90.0)
    assert hollow.get_markerfacecolor() == "white"
    assert {label.get_text() for label in artists(curve, "rate")} == {"1 kHz", "0.5 kHz"}


def test_without_prices_there_is_nothing_to_draw() -> None:
    with pytest.raises(FigureError, match="nothing to draw"):
        prices_figure.figure_of(fake_cost().prices)
