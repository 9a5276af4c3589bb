"""The sides of a change, before and after it, as the page keeps them, also where it did not receive all of it."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from haploop.protocol.changes import Change, restoration
from haploop.view.look.compare import Changes
from haploop.view.store.history import History
from helpers.runs.seen import COUNT_M, TIME, history_of, sine


def test_the_two_sides_of_a_change_are_kept_also_when_the_history_has_forgotten_the_first():
    def calms(t):
        return np.where(t < 2.0, sine(40.0, 1e-3)(t), -5e-3)

    history, changes = history_of(calms, lambda t: 0.1), Changes(COUNT_M)
    events: list[Any] = [(1, {"pause": True}), (2000, {"swap": {"kind": "damping"}})]
    assert changes.pair(history) is None
    changes.note(history, events)
    pair = changes.pair(history)
    assert pair
    tick, before, after = pair
    assert before
    assert after
    assert (tick, before.sight.word, after.sight.word) == (2000, "swinging", "no swing seen")
    assert before.traces.shape == (2, 500)
    assert np.array_equal(before.traces[0], calms(np.arange(1500, 2000) / 1e3))
    forgot: Any = SimpleNamespace(**{name: getattr(history, name) for name in ("end_tick", "steps", "ticks", "time")})
    changes.note(forgot, events)
    pair = changes.pair(history)
    assert pair
    assert pair[1] is before


def test_a_swap_that_was_taken_back_is_not_credited_with_what_came_after_it():
    """For half a minute the page named an element that had been at work for 16 ticks."""
    history, changes = history_of(sine(40.0, 1e-3), lambda t: 0.1), Changes(COUNT_M)
    swap = {"swap": {"kind": "damping", "damping": 1.0}, "element": 0}
    changes.note(history, [(2000, swap), (2016, restoration(Change.from_dict(2016, swap), "It failed."))])
    pair = changes.pair(history)
    assert pair
    assert pair[0] == 2016


@pytest.mark.parametrize(("first", "lacking"), [(0, (950, 1050)), (0, (999, 1050)), (1200, None)])
def test_a_side_of_a_change_that_was_not_received_is_not_held_and_no_number_that_is_not_finite(first, lacking):
    """A page that joins late, or skipped ticks of a fast run just before the change."""
    full, held = history_of(sine(40.0, 1e-3), lambda t: 0.1), History(TIME, 0)
    for begin, end in ((first, lacking[0]), (lacking[1], 3000)) if lacking else ((first, 3000),):
        for own, its in zip(held.all_series[:2], full.all_series[:2], strict=True):
            own.append(begin, dict(zip(its.names, its.rows(its.names, begin, end), strict=True)))
    held.at_work = full.at_work
    held.ticks.begin(0)
    changes = Changes(COUNT_M)
    changes.note(held, [(1000, {"swap": {"kind": "damping"}})])
    pair = changes.pair(held)
    assert pair
    tick, before, after = pair
    assert after
    assert (tick, before, after.sight.word) == (1000, None, "swinging")


@pytest.mark.parametrize("f", [17.3, 30.5, 41.7])
def test_energy_that_goes_to_and_fro_in_a_swing_gives_neither_side_of_a_change_a_power(f):
    """Kinetic energy of a sine, cos²: over a part of a period more it gives up to 2 mW."""
    history, changes = history_of(sine(f, 1e-3), lambda t: 0.1), Changes(COUNT_M)
    t = np.arange(3000) / 1e3
    history.append_energy(0, {"kinetic": 1e-3 * np.cos(2 * np.pi * f * t) ** 2, "hand_work": 2e-3 * t})
    changes.note(history, [(1000, {"swap": {"kind": "damping"}})])
    pair = changes.pair(history)
    assert pair
    for side in pair[1:]:
        assert side
        assert side.budget
        lasts_s = side.budget["to_s"] - side.budget["from_s"]
        power_W = {row["name"]: row["window_J"] / lasts_s for row in side.budget["rows"]}
        assert 0.5 - 1.0 / f < lasts_s <= 0.5
        assert abs(power_W["put into store"]) < 2e-4
        assert power_W["hand"] == pytest.approx(-2e-3, rel=1e-9)
