"""A measurement of ``haploop cost`` that is stopped and taken up again, and what is timed; never how long it took."""

import json
import math
from typing import Any

import numpy as np
import pytest

from haploop.launch.scene.file import load as load_scene
from haploop.plant.friction import motion
from haploop.tools.cost import grid as grid_module
from haploop.tools.cost import measure, times
from haploop.tools.cost.data import CostFileError, Spread, load, save
from haploop.tools.cost.grid import grid
from haploop.tools.cost.measure import Measurement
from haploop.tools.cost.times import Job, Store
from helpers.data.costs import fake_cost
from helpers.scenes.cost_scene import SMOOTH, count_stages, exact_reference


@pytest.mark.slow
def test_a_finished_measurement_is_not_made_again(smooth, tmp_path, monkeypatch):
    grids = [grid(smooth, ["exact", "rk4"], [5_000, 10_000])]
    first, again = {}, {}
    for counts in (first, again):
        measurement = Measurement(grids, tmp_path, 2, 0, exact_reference)
        measurement.errors(count_stages(counts))
        measurement.times(count_stages(counts))
        costs = measurement.cost(1e-6)
        monkeypatch.setattr(measure, "outcome", None)
        monkeypatch.setattr(times, "loop_us", None)
    assert [stage["made"] for stage in first.values()] == [5, 10, 1]
    assert again == {}
    assert len(costs.scenes[0].points) == 5
    assert all(point.time for point in costs.scenes[0].points)
    assert costs.scenes[0].advice.startswith("Cheapest within 1.00 µm of the reference: ")


@pytest.mark.slow
def test_what_was_stopped_goes_on_where_it_was_and_gives_a_cost_meanwhile(smooth, tmp_path, monkeypatch):
    grids = [grid(smooth, ["exact", "rk4"], [5_000])]
    timed = []
    plain = times.yardstick()

    def interrupted(scene):
        if scene == plain:
            return 1.0
        if len(timed) == 4:
            raise KeyboardInterrupt
        timed.append(scene.clock)
        return 1.0

    # Nothing is timed here, so that each call stands for one measurement.
    monkeypatch.setattr(times, "loop_us", interrupted)
    monkeypatch.setattr(times, "_warm", lambda *_: None)
    measurement = Measurement(grids, tmp_path, 3, 0, exact_reference)
    measurement.errors(count_stages({}))
    with pytest.raises(KeyboardInterrupt):
        measurement.times(count_stages({}))
    partial = measurement.cost(1e-6)
    assert len(partial.scenes[0].points) == 3
    assert partial.scenes[0].advice == ""
    monkeypatch.setattr(times, "loop_us", lambda scene: ((scene == plain or timed.append(scene.clock)) and 1.0) or 1.0)
    measurement = Measurement(grids, tmp_path, 3, 0, exact_reference)
    measurement.times(count_stages({}))
    assert measurement.cost(1e-6).scenes[0].advice
    assert [timed.count(clock) for clock in set(timed)] == [3, 3, 3]


@pytest.mark.slow
def test_every_round_times_every_candidate_once_in_an_order_of_its_own(smooth, tmp_path, monkeypatch):
    order = []
    plain = times.yardstick()
    monkeypatch.setattr(times, "loop_us", lambda scene: ((scene == plain or order.append(scene.clock)) and 1.0) or 1.0)
    monkeypatch.setattr(times, "_warm", lambda *_: None)
    made = Measurement([grid(smooth, ["euler"], [1_000, 2_000, 5_000, 10_000])], tmp_path, 5, 0, exact_reference)
    made.errors(count_stages({}))
    made.times(count_stages({}))
    rounds = [tuple(order[i : i + 4]) for i in range(0, 20, 4)]
    assert all(len(set(keys)) == 4 for keys in rounds)
    assert len(set(rounds)) > 1


def test_another_scene_or_another_source_is_measured_anew(smooth, tmp_path, monkeypatch):
    def made():
        counts = {}
        measurement = Measurement([grid(smooth, ["euler"], [5_000])], tmp_path, 1, 0, exact_reference)
        measurement.errors(count_stages(counts))
        return sum(stage["made"] for stage in counts.values())

    assert [made(), made()] == [1, 0]
    smooth.write_text(SMOOTH.replace("damping = 0.4", "damping = 0.5"))
    assert [made(), made()] == [1, 0]
    monkeypatch.setattr(measure, "errors_made_with", lambda: ["edited"])
    assert [made(), made()] == [1, 0]


def test_a_line_cut_off_by_a_kill_is_measured_again(smooth, tmp_path):
    grids = [grid(smooth, ["euler"], [5_000, 10_000])]

    def made():
        counts = {}
        measurement = Measurement(grids, tmp_path, 1, 0, exact_reference)
        measurement.errors(count_stages(counts))
        return sum(stage["made"] for stage in counts.values())

    assert made() == 2
    file = tmp_path / "points.jsonl"
    file.write_text(file.read_text()[:-20])
    assert [made(), made()] == [1, 0]
    assert json.loads(file.read_text().splitlines()[-1])["what"] == "outcome"


def test_a_store_passes_over_what_was_cut_off_and_what_is_no_record(tmp_path):
    file = tmp_path / "points.jsonl"
    store = Store(tmp_path)
    store.add("us", "a", 1.0)
    store.add("us", "a", 2.0, repeat=2)
    file.write_text(file.read_text() + '{"what": "us"}\n[1]\n{"what": "us", "key": "b", "rep')
    store = Store(tmp_path)
    assert not store.has("us", "b")
    store.add("us", "b", None)
    store = Store(tmp_path)
    assert store.has("us", "b")
    assert store.all("us", "a", 5) == [1.0, 2.0]
    assert store.all("us", "a", 2) == [1.0]


@pytest.mark.slow
def test_a_failure_has_a_time_and_a_refusal_has_none(smooth, tmp_path):
    """It is let go on far beyond where it failed; one that the check refuses has no time."""
    smooth.write_text(SMOOTH.replace("stiffness = 400.0", "stiffness = 400000.0"))
    measurement = Measurement([grid(smooth, ["euler"], [1_000, 1_500])], tmp_path, 1, 1, exact_reference)
    measurement.errors(count_stages({}))
    measurement.times(count_stages({}))
    points: dict[int, Any] = {p.plant_rate: p for p in measurement.cost(1e-6).scenes[0].points}
    assert points[1_000].failure
    assert points[1_000].time.median > 0
    assert points[1_500].time is None


def test_errors_do_not_depend_on_the_machine_and_times_do(monkeypatch):
    before = grid_module.errors_made_with(), grid_module.times_made_with()
    monkeypatch.setattr(grid_module, "machine", lambda: "another")
    assert grid_module.errors_made_with() == before[0]
    assert grid_module.times_made_with() != before[1]


@pytest.mark.slow
def test_each_time_is_over_the_yardstick_before_and_after_it(smooth, tmp_path, monkeypatch):
    """On a machine that gets slower all the time, a loop that takes thrice the yardstick still takes thrice."""
    clock = iter(range(10, 10_000))
    monkeypatch.setattr(times, "_warm", lambda *_: None)
    plain = times.yardstick()
    monkeypatch.setattr(times, "loop_us", lambda scene: next(clock) * (1.0 if scene == plain else 3.0))
    made = Measurement([grid(smooth, ["euler"], [1_000, 5_000])], tmp_path, 3, 0, exact_reference)
    made.errors(count_stages({}))
    made.times(count_stages({}))
    seen: list[Any] = [point.time for point in made.cost(1e-6).scenes[0].points]
    assert all((time.low, time.median, time.high) == pytest.approx((3.0, 3.0, 3.0), rel=1e-12) for time in seen)


@pytest.mark.parametrize(("ticks", "beyond_m", "timed"), [(300, 1.0, 200), (80, 1.0, 80), (300, 1e-6, 2)])
def test_the_first_block_of_a_longer_run_is_not_timed(smooth, ticks, beyond_m, timed, monkeypatch):
    """With a clock that says one second each time, the time of a tick tells how many ticks were counted.

    At rest under 50 N/s, 20 g are 0.4 um away after 1 ms and 3.3 um after 2 ms: a limit of 1 um leaves two ticks.
    """
    monkeypatch.setattr(times, "timed", lambda work: (1.0, work()))
    scene = load_scene(smooth, [f"duration={ticks / 1000}", f"diverged_beyond={beyond_m}", "clock.integrator=exact"])
    us: Any = times.loop_us(scene)
    assert 1e6 / us == pytest.approx(timed)


def test_cost_json_is_read_back_as_it_was_and_another_file_is_refused(tmp_path):
    save(fake_cost(), tmp_path)
    assert load(tmp_path) == fake_cost()
    (tmp_path / "cost.json").write_text('{"machine": 1}')
    with pytest.raises(CostFileError, match=r"is not a cost\.json of this version"):
        load(tmp_path)
    with pytest.raises(CostFileError, match="haploop cost --out"):
        load(tmp_path / "nowhere")


def test_an_interval_leaves_out_as_many_values_as_it_may():
    """Of 9 values one on either side: 2 (1 + 9) / 2^9 = 3.9 % is below 5 %; of 6 to 8 none, and of fewer neither."""
    assert Spread.from_values([3.0]) == Spread(3.0, 3.0, 3.0)
    assert Spread.from_values([1.0, 2.0, 3.0, 4.0, 100.0]) == Spread(3.0, 1.0, 100.0)
    assert Spread.from_values([float(i) for i in range(8)]) == Spread(3.5, 0.0, 7.0)
    assert Spread.from_values([float(i) for i in range(9)]) == Spread(4.0, 1.0, 7.0)


@pytest.mark.parametrize("count", [6, 7, 9, 15, 30])
def test_an_interval_holds_the_median_of_endless_repeats_at_least_19_times_in_20(count):
    rng = np.random.default_rng(count)
    spreads = [Spread.from_values(values) for values in rng.exponential(size=(2000, count)).tolist()]
    held = sum(spread.low <= math.log(2.0) <= spread.high for spread in spreads) / len(spreads)
    assert held > 0.94


@pytest.mark.parametrize("is_compiled", [False, True])
def test_a_run_is_timed_with_machine_code_from_its_start_or_without_any(is_compiled):
    used = []
    loops = motion.LOOPS
    loops.asked = 7

    def clock():
        used.append(loops.asked + 1 >= loops.pays)

    Job(times.IN_PROCESS, "", "", load_scene("all_effects.toml"), clock, is_compiled).timed()
    assert used == [is_compiled]
    assert loops.asked == 0
