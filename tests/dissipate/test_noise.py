"""Energy that comes of noise in a recording rather than of its motion: told, and told apart from a buzz."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from haploop.protocol.amounts import amount
from haploop.tools.dissipate.outcome import Outcome
from haploop.tools.dissipate.recording.text_recording import Layout
from haploop.tools.dissipate.report import conclusion, note_sentences
from helpers.data.recordings import outcome, write


@pytest.mark.parametrize(("noise_m", "is_told"), [(0.0, False), (5e-6, True)])
def test_energy_that_comes_of_noise_in_the_positions_is_not_told_as_that_of_the_motion(
    tmp_path: Path, noise_m: float, is_told: bool
) -> None:
    t = np.arange(2000) * 1e-3
    x = 3e-3 * np.sin(2.0 * np.pi * 3.0 * t) + noise_m * np.random.default_rng(1).standard_normal(len(t))
    found = outcome(write(tmp_path / "slow.csv", {"t": t, "x": x}), dampings=["3"], masses=["0.01"])
    damper, *inertias = found.elements
    assert [each.is_fast for each in found.elements] == [False, is_told, is_told]
    assert ("Not reliable" in conclusion(found)) == is_told
    assert any("noise of the estimates" in sentence for sentence in note_sentences(found)) == is_told
    # The damper's energy stays what it was, which is b v^2 over the way; an inertia's is another altogether.
    assert damper.true_J == pytest.approx(3.0 * (3e-3 * 2.0 * np.pi * 3.0) ** 2 / 2.0 * 2.0, rel=0.03)
    assert any(abs(each.true_J) > 1e-3 for each in inertias) == is_told


def test_the_fast_share_of_a_line_is_the_square_of_the_sine_of_half_its_angle_a_sample(tmp_path: Path) -> None:
    for of_rate in (0.05, 0.1, 0.25):
        x = 1e-4 * np.sin(2.0 * np.pi * of_rate * np.arange(4000))
        [damper] = outcome(write(tmp_path / "buzz.csv", {"t": np.arange(4000) * 1e-3, "x": x}), dampings=["3"]).elements
        assert damper.fast_share == pytest.approx(np.sin(np.pi * of_rate) ** 2, rel=1e-2)


S = np.arange(2000) * 1e-3
SLOW, FAST, BUZZ = (size * np.sin(2.0 * np.pi * f * S) for size, f in ((0.5e-3, 1.3), (3e-3, 3.0), (3e-5, 180.0)))
WHITE = np.random.default_rng(3).standard_normal(len(S))


def damped(path: Path, x: np.ndarray) -> Outcome:
    return outcome(write(path, {"t": S, "x": x}), dampings=["2.7"])


@pytest.mark.parametrize(("motion", "noise_m"), [(SLOW, 1e-6), (SLOW, 10e-6), (BUZZ + 0.3 * SLOW, 10e-6)])
def test_what_white_noise_made_of_the_energy_of_damping_is_told_within_a_third(
    tmp_path: Path, motion: np.ndarray, noise_m: float
) -> None:
    true_J = damped(tmp_path / "clean.csv", motion).elements[0].true_J
    found = damped(tmp_path / "noisy.csv", motion + noise_m * WHITE)
    [damper] = found.elements
    assert found.noise_m == pytest.approx(noise_m, rel=0.1)
    assert damper.noisier_J is not None
    assert damper.noisier_J - damper.true_J == pytest.approx(damper.true_J - true_J, rel=1 / 3)
    assert damper.is_moved_by_noise
    assert "Not reliable" in conclusion(found)
    assert any(f"from {amount(damper.true_J, 'J')} to" in sentence for sentence in note_sentences(found))


@pytest.mark.parametrize("step_m", [10e-6, 30e-6])
def test_counts_that_hide_a_slow_motion_from_damping_are_told(tmp_path: Path, step_m: float) -> None:
    """A difference of one period seldom meets one in the next, so a damper books next to nothing."""
    found = damped(tmp_path / "coarse.csv", np.round(SLOW / step_m) * step_m)
    assert found.elements[0].true_J < 0.5 * damped(tmp_path / "clean.csv", SLOW).elements[0].true_J
    assert found.elements[0].is_moved_by_noise


@pytest.mark.parametrize(
    "x", [SLOW, FAST, FAST + BUZZ, FAST + 3e-6 * WHITE, np.round(FAST / 10e-6) * 10e-6, np.zeros(2000)]
)
def test_a_motion_whose_noise_changes_little_is_relied_on(tmp_path: Path, x: np.ndarray) -> None:
    found = damped(tmp_path / "fine.csv", x)
    assert not found.elements[0].is_moved_by_noise
    assert "Not reliable" not in conclusion(found)


def test_recorded_rates_leave_open_what_noise_of_the_positions_made(tmp_path: Path) -> None:
    path = write(tmp_path / "v.csv", {"t": S, "x": SLOW, "v": np.gradient(SLOW, 1e-3)})
    found = outcome(path, layout=Layout(velocity="v"), dampings=["2.7"])
    assert (found.noise_m, found.elements[0].noisier_J) == (None, None)
