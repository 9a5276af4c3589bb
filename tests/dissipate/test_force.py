"""A recorded force: its true work against closed forms and a run's own books, the sum F v T, and the word passive."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.reading.delimited import RecordingError
from haploop.launch.scene.toml_writer import to_toml
from haploop.tools.cli.app import app
from haploop.tools.dissipate.figure import make_figure
from haploop.tools.dissipate.outcome import ForceOutcome
from haploop.tools.dissipate.recording.text_recording import Layout
from haploop.tools.dissipate.report import conclusion, make_report, note_sentences
from helpers.data.recordings import outcome, write
from helpers.scenes.least import KINDS, scene
from helpers.shown import artists, shown

K, SPEED, T = 800.0, 0.1, 1e-3
DEEP = 50  # samples from the surface to the deepest point


def pressed(samples_before: int = 20) -> np.ndarray:
    """Pushed into a spring at x < 0 and let out, at a constant speed; m at every sample.

    The first step is a thousand times shorter: equal steps alone would look like the counts of a coarse encoder.
    """
    in_and_out = np.arange(-samples_before, DEEP), np.arange(DEEP, -samples_before - 1, -1)
    way = np.r_[-samples_before - 1e-3, *in_and_out]
    return -SPEED * T * way


def spring(x: np.ndarray) -> np.ndarray:
    return np.maximum(0.0, -K * x)


def booked(path: Path, columns: dict[str, Any], layout: Layout | None = None, **more: Any) -> ForceOutcome:
    x = next(iter(columns.values()))
    write(path, {"t": np.arange(len(x)) * T, **columns})
    found = outcome(path, layout=layout or Layout(force="F"), **more).force
    assert found
    return found


def test_a_sampled_spring_generates_stiffness_times_depth_times_speed_times_period(tmp_path: Path) -> None:
    """And the sum F v T, v by backward difference, says that it took as much: it has the sign of the truth wrong."""
    x = pressed()
    force = booked(tmp_path / "press.csv", {"x": x, "F": spring(x)})
    leak = K * (DEEP * SPEED * T) * SPEED * T
    assert force.books.true_J == pytest.approx(-leak, rel=1e-9)
    assert force.naive_J == pytest.approx(leak, rel=1e-9)
    assert force.passivity == "generated"
    assert force.excess_J == pytest.approx(leak, rel=1e-9)


def test_with_the_velocity_at_the_sample_the_sum_misses_the_leak(tmp_path: Path) -> None:
    x = pressed()
    columns = {"x": x, "F": spring(x), "v": np.gradient(x, T)}
    force = booked(tmp_path / "press.csv", columns, Layout(force="F", velocity="v"))
    leak = K * (DEEP * SPEED * T) * SPEED * T
    assert force.books.true_J == pytest.approx(-leak, rel=1e-9)
    assert force.naive_J == pytest.approx(0.0, abs=1e-12)


def test_a_spring_that_is_sampled_half_a_period_early_would_be_passive(tmp_path: Path) -> None:
    """The force of the middle of each hold conserves energy: the leak is that of the hold alone."""
    x = pressed()
    middle = np.append(x[:-1] + x[1:], 2.0 * x[-1]) / 2.0
    force = booked(tmp_path / "press.csv", {"x": x, "F": spring(middle)})
    assert force.books.true_J == pytest.approx(0.0, abs=1e-15)
    assert force.passivity == "passive"
    assert abs(force.naive_J) > 1e-5


@pytest.mark.parametrize("delay", [1, 3])
def test_a_delay_adds_its_leak(tmp_path: Path, delay: int) -> None:
    """2 K x v d more, for every force that acts d later: on the way in less is taken, on the way out more is given."""
    x = pressed()
    force = booked(tmp_path / "press.csv", {"x": x, "F": spring(x)}, delay_s=delay * T)
    deep = DEEP * SPEED * T
    step = SPEED * T
    expected = K * deep * step * (1 + 2 * delay) - K * step**2 * delay * (delay + 1)
    assert -force.books.true_J == pytest.approx(expected, rel=1e-9)


def test_a_spring_that_a_damper_outweighs_is_passive_and_the_sum_is_off_by_twice_the_leak(tmp_path: Path) -> None:
    x = pressed()
    v = np.diff(x, prepend=x[0]) / T
    inside = x < 0.0
    damped = spring(x) - inside * 2.0 * v
    force = booked(tmp_path / "press.csv", {"x": x, "F": damped})
    assert force.passivity == "passive"
    assert force.books.true_J > 0.0
    by_hand = -float(damped[:-1] @ np.diff(x))
    assert force.books.true_J == pytest.approx(by_hand, rel=1e-9)
    assert force.naive_J == pytest.approx(-float(damped[:-1] @ v[:-1]) * T, rel=1e-9)


def test_what_rounding_alone_can_make_is_not_called_generated(tmp_path: Path) -> None:
    """A force that conserves energy on the true path, booked on positions rounded to 0.3 mm, at ten places of the wall.

    Of the same spring held at its sample the leak is beyond the doubt where they are rounded to 0.03 mm.
    """
    words, t = set(), T * np.arange(190)
    for phase in np.linspace(0.0, 1.0, 10, endpoint=False):
        x = 5e-3 * np.cos(2.0 * np.pi * 5.0 * (t + 0.5 * t**2)) + phase * 3e-4
        middle = np.append(x[:-1] + x[1:], 2.0 * x[-1]) / 2.0
        coarse, fine = (np.round(x / count) * count for count in (3e-4, 3e-5))
        words.add(booked(tmp_path / "coarse.csv", {"x": coarse, "F": spring(middle)}).passivity)
        assert booked(tmp_path / "fine.csv", {"x": fine, "F": spring(x)}).passivity == "generated"
    assert words == {"passive", "unresolved"}


def test_a_force_at_work_where_the_recording_begins_may_have_stored_energy(tmp_path: Path) -> None:
    x = pressed()[20 + DEEP // 2 :]
    force = booked(tmp_path / "press.csv", {"x": x, "F": spring(x)})
    assert force.passivity == "begins loaded"
    whole = booked(tmp_path / "whole.csv", {"x": pressed(), "F": spring(pressed())})
    assert -force.books.true_J > -whole.books.true_J


def test_a_force_that_gives_before_it_takes_may_have_the_other_sign(tmp_path: Path) -> None:
    x = np.tile(pressed(), 5)
    force = booked(tmp_path / "wrong.csv", {"x": x, "F": -spring(x)})
    assert force.passivity == "other sign"
    right = booked(tmp_path / "wrong.csv", {"x": x, "F": -spring(x)}, Layout(force="F", force_unit="-1"))
    assert right.passivity == "generated"
    assert right.books.true_J == -force.books.true_J


def test_nothing_is_booked_over_a_gap_and_a_contact_before_it_counts(tmp_path: Path) -> None:
    x = np.r_[pressed(), pressed()]
    t, columns = np.arange(len(x)) * T, {"x": x, "F": spring(x)}
    once = booked(tmp_path / "once.csv", {"x": pressed(), "F": spring(pressed())})
    for missing, word in (
        (slice(141, 171), "generated"),
        (slice(150, 190), "generated"),
        (slice(30, 60), "begins loaded"),
    ):
        kept = np.delete(np.arange(len(x)), missing)
        path = write(tmp_path / "gap.csv", {"t": t[kept], **{name: column[kept] for name, column in columns.items()}})
        found = outcome(path, layout=Layout(force="F"))
        by_hand = -sum(
            float(F[:-1] @ np.diff(way))
            for way, F in (
                (x[: missing.start], spring(x[: missing.start])),
                (x[missing.stop :], spring(x[missing.stop :])),
            )
        )
        assert found.force
        assert found.force.books.true_J == pytest.approx(by_hand, rel=1e-9)
        assert found.force.passivity == word
    assert once.passivity == "generated"


@pytest.mark.parametrize(
    ("name", "layout", "scale"),
    [
        ("F (mN)", Layout(force="F"), 1e3),
        ("F [N]", Layout(force="F"), 1.0),
        ("F", Layout(force="F", force_unit="mN"), 1e3),
        ("F", Layout(force="3", force_unit="0.002"), 500.0),
    ],
)
def test_the_unit_of_the_force_comes_from_the_header_or_is_given(
    tmp_path: Path, name: str, layout: Layout, scale: float
) -> None:
    x = pressed()
    plain = booked(tmp_path / "plain.csv", {"x": x, "F": spring(x)})
    other = booked(tmp_path / "other.csv", {"x": x, name: spring(x) * scale}, layout)
    assert other.books.true_J == pytest.approx(plain.books.true_J, rel=1e-9)


def test_a_unit_that_is_no_force_is_refused(tmp_path: Path) -> None:
    x = pressed()
    with pytest.raises(RecordingError, match="'mm' is not a unit for numbers in N"):
        booked(tmp_path / "wrong.csv", {"x": x, "F (mm)": x})


def test_a_column_that_may_be_a_force_is_not_read_unasked_but_named(tmp_path: Path) -> None:
    x = pressed()
    path = write(tmp_path / "press.csv", {"t": np.arange(len(x)) * T, "x": x, "Force": spring(x)})
    found = outcome(path, dampings=["1.0"])
    assert found.force is None
    assert "Column Force was not read: --force Force books its work." in note_sentences(found)
    assert shown(make_report(found)).count("was not read") == 1


def test_elements_are_booked_as_without_a_force(tmp_path: Path) -> None:
    x = pressed()
    path = write(tmp_path / "press.csv", {"t": np.arange(len(x)) * T, "x": x, "F": spring(x)})
    without, beside = (outcome(path, layout=layout, dampings=["2.7"]) for layout in (Layout(), Layout(force="F")))
    assert without.elements == beside.elements


RUNS: dict[str, dict[str, Any]] = {
    "at once": {},
    "late by a part of a tick": {"clock": {"round_trip_delay": 0.0013}},
    "rounded": {"clock": {"round_trip_delay": 0.001}, "encoder": {"resolution": 1e-5}},
    "jitter and loss": {"jitter": {"kind": "gamma", "mean": 3e-4, "deviation": 2e-4}, "loss": {"probability": 0.05}},
}


def ran(directory: Path, **tables: Any) -> dict[str, Any]:
    """The energies of a run that presses on a wall with a damper, and its log in this directory."""
    hand = {"mass": 0.01, "damping": 0.05, "stiffness": 10.0, "force": {"kind": "step", "value": -0.6, "at": 0.05}}
    damper = {"kind": "damping", "damping": 0.3}
    wall = {"position": -0.002, "stiffness": 80.0}
    made = scene(
        **({"duration": 0.3, "hand": hand, "wall": wall, "dissipation": [damper], "run": {"log": "steps"}} | tables)
    )
    directory.mkdir()
    return run_in_process(made, KINDS, out=directory, attachments={"scene.toml": to_toml(made.as_dict())})["energy"]


@pytest.mark.parametrize("tables", RUNS.values(), ids=RUNS)
def test_of_a_run_the_work_of_its_force_is_that_of_its_own_books(tables: dict[str, Any], tmp_path: Path) -> None:
    energy = ran(tmp_path / "run", **tables)
    force = outcome(tmp_path / "run").force
    assert force
    scale = force.books.taken_J + force.books.given_J
    assert scale > 1e-5
    theirs = energy["wall"]["true_J"] + sum(element["true_J"] for element in energy["elements"])
    assert force.books.true_J == pytest.approx(theirs, abs=1e-12 * scale)
    sampled = energy["wall"]["sampled_J"] + sum(element["sampled_J"] for element in energy["elements"])
    assert force.books.sampled_J == pytest.approx(sampled, abs=1e-12 * scale)


def test_the_force_of_an_export_of_a_run_has_its_sampled_book(tmp_path: Path) -> None:
    ran(tmp_path / "run")
    log = outcome(tmp_path / "run").force
    assert CliRunner().invoke(app, ["export", str(tmp_path / "run"), "--to", "csv"]).exit_code == 0
    text = outcome(tmp_path / "run/controller.csv", layout=Layout(force="total")).force
    assert log
    assert text
    assert text.books.sampled_J == pytest.approx(log.books.sampled_J, rel=1e-9)


@pytest.mark.slow
def test_the_command_tells_the_force_without_elements_too(tmp_path: Path) -> None:
    x = pressed()
    path = write(tmp_path / "press.csv", {"t": np.arange(len(x)) * T, "x": x, "F": spring(x)})
    result = CliRunner().invoke(app, ["dissipate", str(path), "--force", "F", "--json"])
    data = json.loads(result.stdout)
    assert data["elements"] == []
    assert data["force"]["work_on_device_J"] == pytest.approx(4e-4)
    assert data["force"]["passivity"] == "generated"
    shown = CliRunner().invoke(app, ["dissipate", str(path), "--force", "F", "--damping", "1"], terminal_width=200)
    words = " ".join(shown.stdout.split())
    assert "recorded force" in words
    assert "gave out up to 400 µJ more than it had taken: not passive" in words
    assert "In all the recorded force gave 400 µJ to the device" in words
    assert "would say that the force took 400 µJ out of the device: off by 800 µJ (200 % of it)" in words


def test_the_figure_of_a_force_alone_draws_its_book_and_the_sum(tmp_path: Path) -> None:
    x = pressed()
    path = write(tmp_path / "press.csv", {"t": np.arange(len(x)) * T, "x": x, "F": spring(x)})
    found = outcome(path, layout=Layout(force="F"))
    figure = make_figure(found)
    (true,), (naive,), (force,) = (artists(figure, gid) for gid in ("force.true", "force.naive", "force"))
    assert true.get_ydata()[-1] == pytest.approx(-0.4)
    assert naive.get_ydata()[-1] == pytest.approx(0.4)
    assert max(force.get_ydata()) == pytest.approx(K * DEEP * SPEED * T)
    assert conclusion(found).startswith("in all the recorded force gave 400 µJ to the device")
