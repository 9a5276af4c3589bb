"""``haploop cost``: errors and their ordering, failures, and the command. No test looks at how long anything took."""

import json
import math
from dataclasses import replace
from typing import Any

import pytest
from typer.testing import CliRunner

from haploop.launch.scene.file import load as load_scene
from haploop.tools.cli.app import app
from haploop.tools.cost.data import load
from haploop.tools.cost.findings import is_told_apart
from haploop.tools.cost.grid import METHODS, accuracy_scenes, grid, outcome, starts, true_swings
from haploop.tools.cost.measure import Measurement
from haploop.tools.cost.reference import reference_for, statistics
from haploop.tools.trajectory import trajectory
from helpers.scenes.cost_scene import SMOOTH, exact_reference, outcomes


@pytest.mark.parametrize(("method", "order"), [("euler", 1), ("semi-implicit-euler", 1), ("implicit-midpoint", 2)])
def test_the_error_falls_with_the_rate_by_the_methods_order(smooth, method, order):
    seen = outcomes(smooth, [method], [10_000, 20_000])
    for entry in ("final_m", "rms_m", "max_m"):
        coarse, fine = (getattr(seen[method, rate].error, entry) for rate in (10_000, 20_000))
        assert math.log2(coarse / fine) == pytest.approx(order, abs=0.2)


def test_exact_is_at_rounding_and_every_other_method_is_ordered_behind_it(smooth):
    rms = {m: outcomes(smooth, [m], [5_000])[m, 5_000].error.rms_m for m in METHODS}
    assert rms["exact"] < 1e-14
    assert rms["exact"] < rms["rk4"] < rms["implicit-midpoint"] < rms["semi-implicit-euler"]
    assert rms["exact"] < rms["dop853"] < rms["implicit-midpoint"]
    assert rms["implicit-midpoint"] < rms["euler"]


@pytest.mark.slow
def test_swings_are_compared_where_positions_cannot_be(smooth):
    """A free oscillation: exact has its amplitude, frequency and losses; Euler swings wider and dissipates less."""
    smooth.write_text(
        SMOOTH.replace("duration = 0.04", "duration = 0.5")
        .replace("damping = 0.4", "damping = 0.02\nposition = 0.01")
        .split("[hand.force]")[0]
    )
    reference = replace(exact_reference(smooth), pointwise=False)
    seen = outcomes(smooth, ["exact", "euler"], [5_000], reference)
    exact, euler = seen["exact", 5_000].error, seen["euler", 5_000].error
    assert exact.rms_m is None
    assert exact.size_m == exact.amplitude_m
    assert max(exact.amplitude, exact.frequency, exact.energy_per_cycle) < 1e-10
    assert min(euler.amplitude, euler.energy_per_cycle) > 0.1
    assert euler.amplitude_m == pytest.approx(euler.amplitude * reference.statistics["amplitude_m"], rel=5e-3)
    assert euler.doubt_m < 1e-3 * euler.amplitude_m


@pytest.mark.slow
def test_without_a_swing_there_is_no_frequency_to_be_off(smooth):
    seen = outcomes(smooth, ["exact"], [5_000], replace(exact_reference(smooth), pointwise=False))
    assert seen["exact", 5_000].error.frequency is None


@pytest.mark.slow
def test_what_chaos_alone_makes_of_a_method_is_not_told_as_its_error():
    """The midpoint rule at 2 kHz: single swings are off by a tenth of a millimetre and more, their mean by nothing.

    Euler's at 1 kHz is off for certain, and that of Runge's method, which chaos does not reach, by 10 pm.
    """
    path = next(path for path in accuracy_scenes() if path.stem == "wall_limit_cycle")
    scene = load_scene(path)
    true = true_swings(scene)

    def compared(method: str, rate: int) -> tuple[Any, list[float]]:
        candidate: Any = next(c for c in grid(path, [method], [rate]).candidates if c.method == method)
        ours = [statistics(each, run.x_m, run.v_m_s) for each in starts(candidate.scene) for run in [trajectory(each)]]
        sizes: Any = [[swings["amplitude_m"] for swings in each] for each in (ours, true)]
        off = [mine - theirs for mine, theirs in zip(*sizes, strict=True)]
        return outcome(candidate, reference_for(path, scene), true).error, off

    midpoint, off = compared("implicit-midpoint", 2_000)
    assert max(map(abs, off)) > 1e-4
    assert not is_told_apart(midpoint)
    assert midpoint.amplitude_m == pytest.approx(abs(sum(off)) / len(off))
    euler, _ = compared("euler", 1_000)
    assert is_told_apart(euler)
    rk4, _ = compared("rk4", 1_000)
    assert is_told_apart(rk4)
    assert rk4.at_most_m < 1e-10


def test_the_residual_of_a_method_that_gains_energy_is_told(smooth):
    seen = outcomes(smooth, ["exact", "euler"], [5_000])
    assert seen["exact", 5_000].error.residual < 1e-12
    assert seen["euler", 5_000].error.residual > 1e-6


def test_failures_are_points_with_their_reason(smooth):
    """Refused by the check; blown up (h omega of 4.5 and more for the spring made stiff); another length."""
    smooth.write_text(SMOOTH.replace("stiffness = 400.0", "stiffness = 400000.0"))
    seen = outcomes(smooth, ["euler", "exact"], [1_000, 1_500])
    refused, diverged = seen["exact", 1_500], seen["euler", 1_000]
    assert refused.error is None
    assert refused.ticks == 0
    assert "plant_rate" in refused.failure
    assert "1500 Hz" in refused.failure
    assert diverged.error is None
    assert diverged.failure.startswith("Diverged: ")
    assert 0 < diverged.ticks < 40
    assert seen["exact", 1_000].failure is None
    reference = exact_reference(smooth)
    shorter = replace(reference, x_m=reference.x_m[:-1])
    seen = outcomes(smooth, ["exact"], [1_000], shorter)
    assert seen["exact", 1_000].failure == "Ended after 40 ticks, the reference after 39."


def test_a_scenes_own_setting_is_one_of_the_candidates(smooth):
    measured = grid(smooth, ["exact"], [10_000, 1_000, 10_000])
    assert measured.own == ("euler", 5_000)
    settings = [(c.method, c.plant_rate) for c in measured.candidates]
    assert settings == [("exact", 1_000), ("exact", 10_000), ("euler", 5_000)]


@pytest.mark.slow
def test_the_command_measures_prints_and_then_only_prints(smooth, tmp_path):
    """A scene without a stored reference: one is made."""
    options = ["--rates", "5k,10000", "--methods", "euler,exact", "--repeats", "1", "--no-processes"]
    command = ["cost", str(smooth), *options, "--out", str(tmp_path / "out")]
    first, again = (CliRunner().invoke(app, command) for _ in range(2))
    assert first.exit_code == again.exit_code == 0, first.output
    assert "smooth: errors: 4 of 4" in first.stderr
    assert "errors" not in again.stderr
    assert first.stdout == again.stdout
    assert "smooth: Cheapest within 1.00 µm of the reference: exact at" in first.stdout
    given = CliRunner().invoke(app, [*command, "--json"])
    assert (tmp_path / "out" / "cost.png").stat().st_size > 10_000
    data = json.loads(given.stdout)
    kept = json.loads((tmp_path / "out" / "cost.json").read_text())
    assert kept.pop("checksum")
    assert data == kept
    assert [p["error"]["rms_m"] < 1e-12 for p in data["scenes"][0]["points"]] == [False, False, True, True]


@pytest.mark.slow
def test_ctrl_c_leaves_what_was_measured_and_the_same_command_goes_on(smooth, tmp_path, monkeypatch):
    command = ["cost", str(smooth), "--rates", "5k", "--methods", "euler", "--repeats", "1", "--no-processes"]
    command += ["--out", str(tmp_path / "out")]

    def interrupted(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(Measurement, "times", interrupted)
        stopped = CliRunner().invoke(app, command)
    assert stopped.exit_code == 1
    assert "the same command continues from it" in stopped.stderr
    [half] = load(tmp_path / "out").scenes[0].points
    assert half.error
    assert half.time is None
    done = CliRunner().invoke(app, command)
    assert done.exit_code == 0
    assert "errors" not in done.stderr
    assert load(tmp_path / "out").scenes[0].points[0].time


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--rates", "1k,ten"], "--rates must be whole numbers of Hz above 0"),
        (["--rates", "0"], "--rates must be whole numbers of Hz above 0"),
        (["--methods", "ruler"], "did you mean euler?"),
        (["--tolerance", "0"], "--tolerance must be above 0 m"),
        (["--repeats", "0"], "--repeats must be at least 1"),
    ],
)
def test_wrong_options_are_told_before_anything_is_measured(smooth, tmp_path, options, said):
    result = CliRunner().invoke(app, ["cost", str(smooth), *options, "--out", str(tmp_path / "out")])
    assert result.exit_code == 2
    assert said in result.stderr
    assert not (tmp_path / "out").exists()


def test_without_a_scene_the_accuracy_scenes_are_taken():
    names = [path.stem for path in accuracy_scenes()]
    assert names == ["all_effects", "stick_slip", "stiff_cable", "wall_limit_cycle", "wall_steady"]
