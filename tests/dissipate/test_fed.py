"""Energy that a recorded force gives to a buzz, against closed forms, and the word passive beside it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.bundled import bundled
from haploop.launch.scene.file import resolved
from haploop.launch.scene.reading.layers import read_layers
from haploop.launch.scene.toml_writer import to_toml
from haploop.tools.cli.app import app
from haploop.tools.dissipate.figure import make_figure
from haploop.tools.dissipate.force_sign import ForceSign
from haploop.tools.dissipate.outcome import Outcome
from haploop.tools.dissipate.recording.samples import Floats
from haploop.tools.dissipate.recording.text_recording import Layout
from haploop.tools.dissipate.report import conclusion, make_report
from helpers.data.recordings import outcome, write
from helpers.scenes.least import KINDS
from helpers.shown import shown

S: Floats = np.arange(4000.0) * 1e-3
K, SWING_M, SWING_HZ, DEEP_M = 1000.0, 1e-4, 37.0, 2e-3
W = 2.0 * np.pi * SWING_HZ
HIDES, FEEDS, TAKES = "not over the buzz", "it feeds the swing", "something else feeds it"


def pressed(t: Floats, counts_m: float = 0.0) -> Floats:
    """Pressed into a wall at 0 within a second, from the first on with a swing that stays, and released a little."""
    swing = SWING_M * np.sin(W * (t - 1.0)) * (t > 1.0)
    x = -DEEP_M * np.clip(t, 0.0, 1.0) + 0.2 * DEEP_M * np.clip(t - 2.0, 0.0, 2.0) + swing
    return np.round(x / counts_m) * counts_m if counts_m else x


def booked(tmp_path: Path, force: Floats, counts_m: float = 0.0, delay_s: float | None = None) -> Outcome:
    path = write(tmp_path / "press.csv", {"t": S, "x": pressed(S, counts_m), "F": force})
    return outcome(path, layout=Layout(force="F"), delay_s=delay_s)


@pytest.mark.parametrize("counts_m", [0.0, 3e-5])
@pytest.mark.parametrize("late_s", [0.0, 1.5e-3])
def test_the_power_given_to_a_swing_is_that_of_a_late_spring_in_closed_form(
    tmp_path: Path, counts_m: float, late_s: float
) -> None:
    """A spring that is d + T/2 late gives K A^2 w sin(w (d + T/2)) / 2, less by sinc(w T/2) for its steps."""
    found = booked(tmp_path, -K * np.minimum(pressed(S, counts_m), 0.0), counts_m, late_s)
    half = W * 0.5e-3
    power = 0.5 * K * SWING_M**2 * W * np.sin(W * late_s + half) * np.sin(half) / half
    assert found.buzz
    assert found.buzz.fed_W == pytest.approx(power, rel=0.02 if not counts_m else 0.1)
    assert found.buzz.fed_J == pytest.approx(power * 3.0, rel=0.15)
    assert FEEDS in shown(make_report(found), 400)


@pytest.mark.slow
def test_a_force_that_fed_the_buzz_is_not_called_passive_though_the_press_had_stored_more(tmp_path: Path) -> None:
    found = booked(
        tmp_path, -K * np.minimum(pressed(S), 0.0) - 10.0 * np.gradient(pressed(S), S) * ((S > 0.01) & (S < 1.0))
    )
    assert found.force
    assert found.force.passivity == "fed the buzz"
    assert HIDES in conclusion(found)
    assert any(FEEDS in text.get_text().replace("\n", " ") for p in make_figure(found).subfigs for text in p.texts)
    result = CliRunner().invoke(app, ["dissipate", str(tmp_path / "press.csv"), "--force", "F", "--json"])
    data = json.loads(result.stdout)
    assert data["force"]["passivity"] == "fed the buzz"
    assert data["buzz"]["fed_J"] == found.buzz.fed_J if found.buzz else False


def test_a_force_that_takes_from_a_swing_is_passive_also_where_the_press_is_released_meanwhile(tmp_path: Path) -> None:
    """Over its buzz the spring gives back what the press had stored: the swing has no part in that."""
    x = pressed(S)
    found = booked(tmp_path, -K * np.minimum(x, 0.0) - 2.0 * np.gradient(x, S) * (S > 0.01))
    assert found.force
    assert found.force.passivity == "passive"
    assert found.buzz
    assert found.buzz.fed_W is not None
    assert found.buzz.fed_W < 0.0
    assert TAKES in shown(make_report(found), 400)


def test_without_a_force_nothing_is_said_of_what_feeds_the_buzz(tmp_path: Path) -> None:
    found = outcome(write(tmp_path / "press.csv", {"t": S, "x": pressed(S)}), dampings=["2"])
    assert found.buzz
    assert found.buzz.fed_W is found.buzz.fed_J is None
    assert "this swing" not in shown(make_report(found), 400)


@pytest.mark.slow
def test_what_a_log_says_of_a_swing_that_lasts_is_the_slope_of_its_own_book(tmp_path: Path) -> None:
    """Late by 2 ms and with an actuator that lags: what the plant's steps hold counts, not what was commanded."""
    layers = read_layers(bundled("scenes")["demo"])
    layers.data.pop("event")
    own = resolved(layers, ["actuator.bandwidth=200", "run.log=steps"], KINDS)
    run_in_process(own, KINDS, out=tmp_path, attachments={"scene.toml": to_toml(own.as_dict())})
    found = outcome(tmp_path)
    assert found.buzz
    assert found.buzz.fed_W
    t, _, _, true_J, _ = found.trace.lines()
    late = t > 1.0
    slope_W = -float(np.polyfit(t[late], true_J[late], 1)[0])
    assert found.buzz.fed_W == pytest.approx(slope_W, rel=0.03)


def test_where_the_sign_of_the_force_is_in_doubt_so_is_who_feeds_the_swing(tmp_path: Path) -> None:
    found = booked(tmp_path, K * np.minimum(pressed(S), 0.0))
    assert found.force
    assert found.force.passivity == "other sign"
    said = shown(make_report(found), 400)
    assert "which way depends on its sign" in said
    assert FEEDS not in said
    assert TAKES not in said


def late_spring(sign: float, late: int) -> Floats:
    """A spring a sample late or more, which gives to the swing; with the sign that it has, or the other."""
    x = np.minimum(pressed(S), 0.0)
    return -sign * K * np.concatenate([np.zeros(late), x[: len(x) - late]])


@pytest.mark.parametrize("late", [1, 4])
def test_a_force_that_pushes_back_feeds_the_swing_whatever_it_gave_before_and_one_that_pulls_in_is_in_doubt(
    tmp_path: Path, late: int
) -> None:
    """What a buzz gave first makes the books say other sign; how the force stands to the depth says that it is none."""
    right, wrong = (booked(tmp_path, late_spring(sign, late)) for sign in (1.0, -1.0))
    for found, pushes_back, word in ((right, True, FEEDS), (wrong, False, "which way depends on its sign")):
        assert found.force
        assert found.force.pushes_back is pushes_back
        said = shown(make_report(found), 400)
        assert word in said
        assert ("recorded with the opposite sign (then --force-unit -1)" in said) is not pushes_back
        assert TAKES not in said


@pytest.mark.parametrize("of", ["damper", "inertia", "noise", "nothing", "short"])
def test_a_force_that_is_no_springs_says_nothing_of_its_sign(of: str) -> None:
    x = 5e-3 * np.sin(2.0 * np.pi * 0.7 * S) + 1e-4 * np.sin(W * S)
    v, a = np.gradient(x, S), np.gradient(np.gradient(x, S), S)
    noise = np.random.default_rng(3).normal(size=len(S))
    force = {"damper": -2.0 * v, "inertia": -0.02 * a, "noise": noise, "nothing": 0.0 * x, "short": -K * x}[of]
    sign = ForceSign(1e-3)
    sign.add(x[: 1900 if of == "short" else None], force[: 1900 if of == "short" else None], begins=True)
    assert sign.pushes_back is None


def test_the_sign_of_a_force_is_the_same_in_whatever_pieces_it_comes_and_a_gap_ends_a_block() -> None:
    x = pressed(S)
    found = set()
    for size in (1, 7, 250, 4000):
        sign = ForceSign(1e-3)
        for first in range(0, len(x), size):
            part = slice(first, first + size)
            sign.add(x[part], -K * np.minimum(x[part], 0.0), begins=first == 0)
        found.add(sign.pushes_back)
    assert found == {True}
    gaps = ForceSign(1e-3)
    for first in range(0, 4000, 200):
        gaps.add(x[first : first + 200], -K * x[first : first + 200], begins=True)
    assert gaps.pushes_back is None
