"""Energy that comes of noise in a recording rather than of its motion: told, and told apart from a buzz."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

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
    assert [each.is_noise for each in found.elements] == [False, is_told, is_told]
    assert ("Not to be relied on" in conclusion(found)) == is_told
    assert sum("noise of the estimates" in sentence for sentence in note_sentences(found)) == 2 * is_told
    # The damper's energy stays what it was, which is b v^2 over the way; an inertia's is another altogether.
    assert damper.true_J == pytest.approx(3.0 * (3e-3 * 2.0 * np.pi * 3.0) ** 2 / 2.0 * 2.0, rel=0.03)
    assert any(abs(each.true_J) > 1e-3 for each in inertias) == is_told


def test_the_fast_share_of_a_line_is_the_square_of_the_sine_of_half_its_angle_a_sample(tmp_path: Path) -> None:
    for of_rate in (0.05, 0.1, 0.25):
        x = 1e-4 * np.sin(2.0 * np.pi * of_rate * np.arange(4000))
        [damper] = outcome(write(tmp_path / "buzz.csv", {"t": np.arange(4000) * 1e-3, "x": x}), dampings=["3"]).elements
        assert damper.fast_share == pytest.approx(np.sin(np.pi * of_rate) ** 2, rel=1e-2)
