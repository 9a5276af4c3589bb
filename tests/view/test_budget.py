"""The budget of the page by cause: it closes, and is that of the summary."""

import numpy as np
import pytest

from haploop.api import load, run
from haploop.protocol.ticks import Timebase
from haploop.view.look.book_names import book_names
from haploop.view.look.budget import budget
from haploop.view.receive.ingest import Backfill
from haploop.view.store.history import History
from helpers.runs.seen import TIME


def recorded(tmp_path, **values):
    """The history of a run of 3 s, and its summary."""
    loaded = load("fig6c").set({"duration": 3.0, **values})
    result = run(loaded, out=tmp_path / "run")
    time = Timebase.from_scene(loaded.scene)
    backfill = Backfill(tmp_path / "run", loaded.scene, time, [])
    backfill.read()
    return backfill.history, result.summary


def test_the_budget_closes_and_its_causes_are_those_of_the_summary(tmp_path):
    history, summary = recorded(tmp_path)
    found = budget(history, 0, history.end_tick)
    assert found
    total = {row["name"]: row["total_J"] for row in found["rows"]}
    energy = summary["energy"]
    leak = energy["wall"]["leak"]
    assert abs(sum(total.values())) < 1e-15 * energy["moved_J"] + 1e-17
    for name, value in {
        "hand": -energy["hand_work_J"], "sampling and hold": leak["sampling_and_hold_J"], "delay": leak["delay_J"],
        "heat in device": energy["device_heat_J"], "unidirectional-inertia": energy["elements"][0]["true_J"],
    }.items():  # fmt: skip
        # The books on the page are those of the last tick, the summary's of the end: one tick apart.
        assert total[name] == pytest.approx(value, rel=0.02), name
    last = budget(history, 1500, history.end_tick)
    early = budget(history, 0, 1501)
    assert last
    assert early
    for late, soon, whole in zip(last["rows"], early["rows"], found["rows"], strict=True):
        assert late["window_J"] + soon["total_J"] == pytest.approx(whole["total_J"], abs=1e-15)
    assert abs(sum(row["window_J"] for row in last["rows"])) < 1e-17


def test_an_element_that_was_changed_is_told_by_kind_and_by_when_each_of_its_numbers_came(tmp_path):
    def names(name, events):
        damped = {"duration": 0.5, "dissipation": [{"kind": "damping", "damping": 1.0}]}
        history, _ = recorded(tmp_path / name, **damped, event=events)
        found = budget(history, 0, history.end_tick)
        assert found
        return [row["name"] for row in found["rows"] if "damping" in row["name"]]

    faster = [{"at": at, "set": {"dissipation.0.damping": size}} for at, size in ((0.12, 2.0), (0.2345, 3.0))]
    assert names("as it was", []) == ["damping"]
    assert names("changed", faster) == ["damping, from 0 s", "damping, from 0.12 s", "damping, from 0.235 s"]


def test_of_a_run_joined_on_its_way_nobody_is_told_since_when_what_was_there_is_at_work():
    history, row = History(TIME, 1000), np.arange(100.0)
    history.append_energy(1000, {"wall.true": row, "damping-2.true": row, "damping-3.true": row})
    history.append_energy(1100, {"wall.true": row, "damping-2.true": row, "damping-3.true": row, "damping-4.true": row})
    told = {"damping-2": "damping, earlier", "damping-3": "damping, earlier (2)", "damping-4": "damping, from 1.1 s"}
    assert book_names(history) == told


def test_what_the_law_of_a_wall_takes_is_a_cause_of_its_own_and_no_leak(tmp_path):
    damped = {"duration": 0.3, "wall.position": 0.001, "wall.kind": "kelvin-voigt", "wall.damping": 1.0}
    history, summary = recorded(tmp_path, **damped)
    found = budget(history, 0, history.end_tick)
    assert found
    total, of_wall = {row["name"]: row["total_J"] for row in found["rows"]}, summary["energy"]["wall"]
    assert total["law of the wall"] == pytest.approx(of_wall["dissipated_J"], rel=0.02)
    assert total["sampling and hold"] == pytest.approx(of_wall["leak"]["sampling_and_hold_J"], rel=0.02)
    assert abs(sum(total.values())) < 1e-12 * summary["energy"]["moved_J"]


def test_what_the_actuators_limits_kept_back_is_not_said_to_be_in_store(tmp_path):
    """It was said of 19.7 J that no spring and no mass ever held."""
    history, summary = recorded(tmp_path, **{"actuator.saturation": 0.3})
    found = budget(history, 0, history.end_tick)
    assert found
    total = {row["name"]: row["total_J"] for row in found["rows"]}
    assert total["kept back by the actuator's limits"] == pytest.approx(summary["energy"]["actuator_J"], rel=0.02)
    assert total["kept back by the actuator's limits"] > 0.0
    no_flow = {row["name"]: row["is"] for row in found["rows"] if row["is"] != "flow"}
    assert no_flow == {"kept back by the actuator's limits": "kept", "put into store": "store"}
    assert abs(sum(total.values())) < 1e-12 * summary["energy"]["moved_J"]
