"""Events take effect at their tick, and leave estimates and commands in flight as they were."""

from __future__ import annotations

import numpy as np
import pytest

from helpers.runs.captured import run
from helpers.scenes.least import scene

DAMPING = {"kind": "damping", "damping": 0.3}
INERTIA = {"kind": "bidirectional-inertia", "mass": 0.005}
CLOSE = {"position": -1e-4, "stiffness": 100.0}


def pressed(*events, delay: int = 0, control_rate: int = 1_000, **tables):
    """A run deep in a wall with one damping element and these events."""
    base = {
        "duration": 0.4,
        "clock": {"control_rate": control_rate, "round_trip_delay": delay / 10_000},
        "device": {"mass": 0.01, "damping": 0.1, "position": -0.002},
        "hand": {"mass": 0.01, "damping": 0.5, "stiffness": 10.0, "force": {"kind": "constant", "value": -0.8}},
        "wall": CLOSE,
        "dissipation": [DAMPING],
    }
    return run(scene(**base | tables, event=list(events)))


@pytest.mark.parametrize(
    ("at", "control_rate", "tick"),
    [(0.15, 1_000, 150), (0.1501, 1_000, 151), (0.1509, 1_000, 151), (0.0, 1_000, 0), (0.15, 500, 75), (0.151, 500, 76)]
    + [(k / 1_000, 1_000, k) for k in (1, 7, 57, 113, 201, 283)],
)
def test_an_event_acts_from_the_first_tick_at_or_after_its_time(at, control_rate, tick):
    """Decimal times fall on their tick, though k / 1000 * 1000 may come out above k."""
    ran = pressed({"at": at, "set": {"wall.stiffness": 120.0}}, control_rate=control_rate)
    stiffness = ran.controller["wall"] / (CLOSE["position"] - ran.controller["x"])
    assert ran.controller["in_contact"].all()
    assert stiffness[:tick] == pytest.approx(100.0)
    assert stiffness[tick:] == pytest.approx(120.0)


@pytest.mark.parametrize("delay", [0, 3, 10, 25, 50])
def test_a_swap_leaves_the_past_the_estimates_and_the_commands_in_flight_untouched(delay):
    plain, swapped = pressed(delay=delay), pressed({"at": 0.2, "swap": INERTIA}, delay=delay)
    tick = 200
    first_new_step = tick * 10 + delay
    for name in ("x", "v"):
        assert np.array_equal(plain.plant[name][: first_new_step + 1], swapped.plant[name][: first_new_step + 1])
    assert np.array_equal(plain.plant["force"][:first_new_step], swapped.plant["force"][:first_new_step])
    assert plain.plant["force"][first_new_step] != swapped.plant["force"][first_new_step]
    for name in ("x", "v", "a", "wall"):
        assert np.array_equal(plain.controller[name][: tick + 1], swapped.controller[name][: tick + 1])
    assert not swapped.forces[0][tick:].any()
    assert np.array_equal(swapped.forces[1][tick:], -0.005 * swapped.controller["a"][tick:])
    assert not swapped.forces[1][:tick].any()


@pytest.mark.parametrize("delay", [0, 13, 50])
def test_the_old_book_takes_the_commands_in_flight_and_then_stands_still(delay):
    swapped = pressed({"at": 0.2, "swap": INERTIA}, delay=delay)
    old, new = swapped.energy["elements"]
    assert (old["kind"], old["from_tick"], old["to_tick"]) == ("damping", 0, 200)
    assert (new["kind"], new["from_tick"], new["to_tick"]) == ("bidirectional-inertia", 200, 400)
    dx, command = np.diff(swapped.plant["x"]), swapped.plant["command"][:-1].astype(int)
    for book, entry in enumerate((old, new)):
        applied = np.where(command >= 0, swapped.forces[book][command], 0.0)
        assert entry["true_J"] == pytest.approx(-np.sum(applied * dx), rel=1e-9, abs=1e-18)
    assert swapped.relative_residual < 1e-14


def test_an_element_added_and_removed_acts_from_its_tick_to_its_tick():
    events = [{"at": 0.1, "element": 1, "swap": INERTIA}, {"at": 0.3, "element": 0, "swap": {"kind": "none"}}]
    ran = pressed(*events)
    acting = [np.flatnonzero(ran.forces[book]) for book in (0, 1)]
    assert (acting[0].min(), acting[0].max()) == (1, 299)
    assert (acting[1].min(), acting[1].max()) == (100, 399)
    assert [(e["from_tick"], e["to_tick"]) for e in ran.energy["elements"]] == [(0, 300), (100, 400)]


def test_a_swap_to_the_same_element_changes_no_bit_of_the_motion():
    plain, swapped = pressed(delay=13), pressed({"at": 0.2, "swap": DAMPING}, delay=13)
    assert plain.summary["trajectory_sha256"] == swapped.summary["trajectory_sha256"]
    whole, parts = plain.energy["elements"], swapped.energy["elements"]
    for side in ("sampled_J", "true_J"):
        assert sum(part[side] for part in parts) == pytest.approx(whole[0][side], rel=1e-13)


def test_events_of_one_tick_act_in_the_order_of_the_file_and_a_stop_ends_the_run_there():
    events = [{"at": 0.2, "set": {"wall.stiffness": k}} for k in (300.0, 150.0)]
    ran = pressed(*events, {"at": 0.3, "stop": True})
    assert ran.summary["ticks"] == 300
    assert ran.summary["ended"] == "stopped"
    assert (ran.controller["wall"] / (CLOSE["position"] - ran.controller["x"]))[200:] == pytest.approx(150.0)
    assert len(ran.plant["x"]) == 3001
