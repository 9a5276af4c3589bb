"""Energy that elements take out of a recorded motion: closed forms, a run's own books, any cut of the recording."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from haploop.controller.dissipation import ElementError
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.reading.delimited import RecordingError
from haploop.launch.scene.toml_writer import to_toml
from haploop.logger import read
from haploop.tools.dissipate.booking import Booking
from haploop.tools.dissipate.recording.text_recording import Layout
from helpers.data.recordings import PERIOD_S, booking, outcome, samples, write
from helpers.scenes.least import KINDS, scene

A, B, M = 2e-3, 2.7, 0.0018


def sine(per_cycle: int, cycles: int) -> np.ndarray:
    return A * np.sin(2.0 * np.pi / per_cycle * np.arange(per_cycle * cycles))


def a_sample(account: Booking, per_cycle: int) -> np.ndarray:
    """True energy a sample of the swinging state, over ten whole cycles of x = A sin(k theta)."""
    x, settled = sine(per_cycle, 12), 2 * per_cycle + 1
    account.add(samples(x[:settled]))
    before = account.true_J.copy()
    account.add(samples(x[settled:], begins=False))
    account.finish(0.0)
    return (account.true_J - before) / (10 * per_cycle)


@pytest.mark.parametrize("per_cycle", [6, 20, 125])
@pytest.mark.parametrize("late", [0, 1, 2, 5])
def test_on_a_sine_damping_takes_what_its_closed_form_says_and_feeds_when_late_or_fast(
    per_cycle: int, late: int
) -> None:
    """(2 B A^2 / T) sin^2(theta/2) cos((d + 1) theta) a sample."""
    theta = 2.0 * np.pi / per_cycle
    true = a_sample(booking(late * PERIOD_S, dampings=[str(B)]), per_cycle)
    expected = 2.0 * B * A**2 / PERIOD_S * np.sin(theta / 2.0) ** 2 * np.cos((late + 1) * theta)
    assert true[0] == pytest.approx(expected, rel=1e-9, abs=1e-20)


@pytest.mark.parametrize("per_cycle", [6, 20, 125])
@pytest.mark.parametrize("late", [0, 1, 2])
def test_on_a_sine_inertia_takes_what_its_closed_form_says(per_cycle: int, late: int) -> None:
    """(4 m A^2 / T^2) sin^3(theta/2) sin((d + 3/2) theta) a sample: a[k] = -(4 / T^2) sin^2(theta/2) x[k-1]."""
    theta = 2.0 * np.pi / per_cycle
    true = a_sample(booking(late * PERIOD_S, masses=[str(M)]), per_cycle)
    expected = 4.0 * M * A**2 / PERIOD_S**2 * np.sin(theta / 2.0) ** 3 * np.sin((late + 1.5) * theta)
    assert true[0] == pytest.approx(expected, rel=1e-8, abs=1e-18)


def test_unidirectional_inertia_takes_the_kinetic_energy_of_every_speeding_up() -> None:
    """Twice m v^2 / 2 a cycle for slow motion, v the greatest speed; a bidirectional one keeps next to none of it."""
    per_cycle = 2000
    true = a_sample(booking(0.0, masses=[str(M)]), per_cycle)
    greatest = A * 2.0 * np.pi / per_cycle / PERIOD_S
    assert true[1] * per_cycle == pytest.approx(M * greatest**2, rel=0.01)
    assert abs(true[0]) < 0.02 * true[1]


def test_without_delay_the_sampled_books_are_the_true_ones_but_for_the_last_period() -> None:
    account = booking(0.0, dampings=["1.0"], masses=["0.01"])
    account.add(samples(sine(40, 5)))
    assert account.sampled_J == pytest.approx(account.true_J, rel=1e-14)
    account.finish(A)
    assert (account.sampled_J != account.true_J).all()


@pytest.mark.parametrize("share", [0.25, 0.5, 0.9])
def test_between_whole_delays_straight_lines_weigh_them_by_their_shares(share: float) -> None:
    x = np.random.default_rng(1).normal(size=300) * 1e-4
    accounts = [booking(delay * PERIOD_S, dampings=["1.0"], masses=["0.01"]) for delay in (2, 2 + share, 3)]
    for account in accounts:
        account.add(samples(x))
    two, some, three = (account.true_J for account in accounts)
    assert some == pytest.approx((1.0 - share) * two + share * three, rel=1e-9)


@given(
    cuts=st.lists(st.integers(1, 119), max_size=8),
    delay=st.sampled_from([0.0, 1e-3, 2.3e-3]),
    bent=st.booleans(),
)
@settings(max_examples=25, deadline=None)
def test_how_the_recording_is_cut_changes_no_bit(cuts: list[int], delay: float, bent: bool) -> None:
    rng = np.random.default_rng(2)
    x = rng.normal(size=120) * 1e-4
    between = x + rng.normal(size=120) * 1e-5
    account, whole = (booking(delay, dampings=["0.5"], masses=["0.01"]) for _ in range(2))
    whole_rows = whole.add(samples(x, between_x_m=between if bent else None))
    edges = [0, *sorted(set(cuts)), 120]
    rows = [
        account.add(samples(x[i:j], not i, i, between_x_m=between[i:j] if bent else None)) for i, j in pairwise(edges)
    ]
    for account_of in (account, whole):
        account_of.finish(0.0)
    assert np.hstack([row.true_J for row in rows]).tolist() == whole_rows.true_J.tolist()
    assert np.hstack([row.sampled_J for row in rows]).tolist() == whole_rows.sampled_J.tolist()
    assert account.true_J.tolist() == whole.true_J.tolist()


def test_a_gap_begins_anew_and_what_is_missing_is_not_booked() -> None:
    x = sine(50, 6)
    parts = [booking(1e-3, dampings=["1.0"], masses=["0.01"]) for _ in range(2)]
    both = booking(1e-3, dampings=["1.0"], masses=["0.01"])
    for account, piece in zip(parts, (x[:120], x[150:]), strict=True):
        account.add(samples(piece))
        both.add(samples(piece))
    assert both.true_J == pytest.approx(sum(account.true_J for account in parts), rel=1e-13)
    assert both.sampled_J == pytest.approx(sum(account.sampled_J for account in parts), rel=1e-13)


def test_what_an_element_takes_and_gives_back_makes_up_its_book() -> None:
    account = booking(0.0, masses=["0.01"])
    account.add(samples(sine(30, 8)))
    assert account.taken_J - account.given_J == pytest.approx(account.true_J, rel=1e-12)
    assert (account.given_J > 0.0).all()


def test_recorded_velocities_and_accelerations_are_taken_as_they_are() -> None:
    rng = np.random.default_rng(3)
    x, v, a = rng.normal(size=(3, 50))
    account = booking(0.0, recorded=frozenset({"velocity", "acceleration"}), dampings=["2.0"], masses=["0.5"])
    account.add(samples(x, v_m_s=v, a_m_s2=a))
    dx = np.diff(x)
    assert account.true_J[0] == pytest.approx(float(2.0 * v[:-1] @ dx), rel=1e-12)
    assert account.true_J[1] == pytest.approx(float(0.5 * a[:-1] @ dx), rel=1e-12)
    assert account.strongest_N == pytest.approx([2.0 * np.abs(v).max(), 0.5 * np.abs(a).max(), account.strongest_N[2]])


def test_an_acceleration_is_differenced_from_a_recorded_velocity() -> None:
    rng = np.random.default_rng(4)
    x, v = rng.normal(size=(2, 50))
    account = booking(0.0, recorded=frozenset({"velocity"}), masses=["0.5"])
    account.add(samples(x, v_m_s=v))
    a = np.diff(v, prepend=0.0) / PERIOD_S
    assert account.true_J[0] == pytest.approx(float(0.5 * a[:-1] @ np.diff(x)), rel=1e-12)


def test_beyond_a_wall_only() -> None:
    x = np.linspace(1e-3, -1e-3, 101)
    everywhere, inside = booking(0.0, dampings=["1.0"]), booking(0.0, dampings=["1.0"], wall="0 mm")
    for account in (everywhere, inside):
        account.add(samples(x))
    speed, way = 2e-5 / PERIOD_S, 2e-5
    # No velocity at the first sample; in contact from x < 0 on.
    assert everywhere.true_J[0] == pytest.approx(99 * speed * way, rel=1e-9)
    assert inside.true_J[0] == pytest.approx(np.count_nonzero(x[:-1] < -1e-12) * speed * way, rel=1e-9)


def test_a_force_that_is_no_number_is_blamed_on_its_element() -> None:
    account = booking(0.0, recorded=frozenset({"velocity"}), dampings=["1e9"])
    with pytest.raises(ElementError, match="damping"):
        account.add(samples(np.zeros(3), v_m_s=np.array([0.0, 1e300, 0.0])))


# The books of a run say what its own element did: on its log, the same element is to come out the same.

PRESS = {"mass": 0.01, "damping": 0.05, "stiffness": 10.0, "force": {"kind": "step", "value": -0.6, "at": 0.05}}
RUNS: dict[str, dict[str, Any]] = {
    "at once": {},
    "late": {"clock": {"round_trip_delay": 0.002}},
    "late by a part of a tick": {"clock": {"round_trip_delay": 0.0013}},
    "rounded": {"clock": {"round_trip_delay": 0.001}, "encoder": {"resolution": 1e-5}},
    "an accelerometer": {"acceleration": {"source": "accelerometer", "cutoff": 80.0}},
    "a chain": {"transmission": {"motor_mass": 0.01, "stiffness": 2e4, "damping": 0.5, "motor_damping": 0.05}},
    "a wall that moves": {"event": [{"at": 0.15, "set": {"wall.position": -0.004}}]},
}


def ran(directory: Path, log: str = "steps", **tables: Any) -> dict[str, Any]:
    """A run with a log in this directory; returns its summary."""
    elements = [
        {"kind": "damping", "damping": 0.3},
        {"kind": "bidirectional-inertia", "mass": 0.002},
        {"kind": "unidirectional-inertia", "mass": 0.002},
    ]
    base: dict[str, Any] = {
        "duration": 0.3,
        "hand": PRESS,
        "wall": {"position": -0.002, "stiffness": 80.0},
        "dissipation": elements,
    }
    made = scene(**(base | tables), run={"log": log})
    directory.mkdir()
    attached = {"scene.toml": to_toml(made.as_dict())}
    return run_in_process(made, KINDS, out=directory, attachments=attached)


@pytest.mark.parametrize("tables", RUNS.values(), ids=RUNS)
def test_on_a_runs_log_its_own_elements_have_its_own_books(tables: dict[str, Any], tmp_path: Path) -> None:
    elements = ran(tmp_path / "run", **tables)["energy"]["elements"]
    found = outcome(tmp_path / "run", dampings=["0.3"], masses=["0.002"])
    assert found.recording.between == "plant steps"
    for ours, theirs in zip(found.elements, elements, strict=True):
        scale = ours.taken_J + ours.given_J
        assert scale > 0.0
        assert ours.kind == theirs["kind"]
        assert ours.true_J == pytest.approx(theirs["true_J"], abs=1e-12 * scale)
        assert ours.sampled_J == pytest.approx(theirs["sampled_J"], abs=1e-12 * scale)


def test_with_another_delay_they_have_not(tmp_path: Path) -> None:
    (damping, *_) = ran(tmp_path / "run")["energy"]["elements"]
    found = outcome(tmp_path / "run", delay_s=0.002, dampings=["0.3"], masses=["0.002"])
    assert found.elements[0].sampled_J == pytest.approx(damping["sampled_J"], rel=1e-12)
    assert abs(found.elements[0].true_J / damping["true_J"] - 1.0) > 0.01


def test_estimates_made_anew_as_the_run_made_them_are_the_same(tmp_path: Path) -> None:
    ran(tmp_path / "run", velocity={"cutoff": 70.0})
    taken = outcome(tmp_path / "run", dampings=["0.3"], masses=["0.002"])
    anew = outcome(tmp_path / "run", dampings=["0.3"], masses=["0.002"], overrides=["velocity.cutoff=70.0"])
    other = outcome(tmp_path / "run", dampings=["0.3"], masses=["0.002"], overrides=["velocity.cutoff=20.0"])
    assert taken.recording.recorded == {"acceleration", "velocity"}
    assert anew.recording.recorded == set()
    assert [e.true_J for e in anew.elements] == pytest.approx([e.true_J for e in taken.elements], rel=1e-12)
    assert [e.true_J for e in other.elements] != pytest.approx([e.true_J for e in taken.elements], rel=1e-3)


def test_estimates_that_read_an_accelerometer_need_its_readings(tmp_path: Path) -> None:
    ran(tmp_path / "as read", acceleration={"source": "accelerometer"})
    ran(tmp_path / "filtered", acceleration={"source": "accelerometer", "cutoff": 80.0})
    anew: dict[str, Any] = {"dampings": ["0.3"], "masses": ["0.002"], "overrides": ["velocity.cutoff=1e9"]}
    taken, again = outcome(tmp_path / "as read", masses=["0.002"]), outcome(tmp_path / "as read", **anew)
    assert again.elements[1].true_J == pytest.approx(taken.elements[0].true_J, rel=1e-12)
    with pytest.raises(RecordingError, match="readings are not in the log"):
        outcome(tmp_path / "filtered", **anew)


def test_a_kalman_filter_reads_recorded_accelerations_as_in_a_run(tmp_path: Path) -> None:
    fused = {"estimator": "kalman", "jerk_density": 2e3, "measurement_noise": 3e-6, "accelerometer": True}
    fused |= {"accelerometer_noise": 0.1}
    elements = ran(tmp_path / "run", velocity=fused, acceleration={"source": "accelerometer"})["energy"]["elements"]
    values = {**fused, "accelerometer": "true"}
    overrides = [f"velocity.{key}={value}" for key, value in values.items()]
    log = read(tmp_path / "run", {"/controller"})["/controller"]
    text = write(tmp_path / "as read.csv", {name: log[name] for name in ("timestamp", "x", "a")})
    wall: dict[str, Any] = {"wall": "-0.002", "dampings": ["0.3"], "masses": ["0.002"], "overrides": overrides}
    found = outcome(text, layout=Layout(acceleration="a"), **wall)
    for ours, theirs in zip(found.elements, elements, strict=True):
        assert ours.sampled_J == pytest.approx(theirs["sampled_J"], abs=1e-9 * (ours.taken_J + ours.given_J))


def test_a_log_of_ticks_alone_is_booked_on_straight_lines_and_says_so(tmp_path: Path) -> None:
    elements = ran(tmp_path / "run", log="ticks")["energy"]["elements"]
    found = outcome(tmp_path / "run", dampings=["0.3"], masses=["0.002"])
    assert found.recording.between == "straight lines"
    for ours, theirs in zip(found.elements, elements, strict=True):
        assert ours.sampled_J == pytest.approx(theirs["sampled_J"], rel=1e-9)


def test_a_log_that_was_cut_off_is_booked_as_far_as_it_goes(tmp_path: Path) -> None:
    ran(tmp_path / "run", duration=6.0)
    log = tmp_path / "run" / "log.mcap"
    whole = outcome(log, dampings=["0.3"])
    (tmp_path / "cut.mcap").write_bytes(log.read_bytes()[: log.stat().st_size * 3 // 4])
    found = outcome(tmp_path / "cut.mcap", dampings=["0.3"])
    assert 0 < found.recording.notes.rows < whole.recording.notes.rows == 6000
    assert any("cut off" in remark for remark in found.recording.notes.remarks)
    assert not whole.recording.notes.remarks
