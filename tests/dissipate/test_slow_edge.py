"""Swings as slow as a window resolves: told with their frequency and width, or not."""

from __future__ import annotations

import numpy as np
import pytest

from haploop.tools.dissipate.recording.samples import Floats, Samples
from haploop.tools.dissipate.swing.finder import BuzzFinder

WIDE_M = 8e-3
SLOW = [pytest.param(*of, marks=pytest.mark.slow) for of in ((10.0, 0.0), (2.0, 1.0), (4.0, 4.0))]


def finder(t_s: Floats, x_m: Floats) -> BuzzFinder:
    found = BuzzFinder(1e-3)
    found.add(Samples(t_s, x_m, None, None, x_m, None, True))
    return found


@pytest.mark.parametrize(("seconds", "phase"), [(3.0, 2.2), *SLOW])
@pytest.mark.parametrize("drift", [False, True])
@pytest.mark.parametrize("noise_m", [2e-5, pytest.param(0.0, marks=pytest.mark.slow)])
def test_a_swing_from_1_5_to_4_hz_is_told_right_or_not_at_all(
    seconds: float, phase: float, drift: bool, noise_m: float
) -> None:
    t = np.arange(0.0, seconds, 1e-3)
    beside = drift * (5e-3 * t + 2e-3 * np.sin(2.0 * np.pi * 0.23 * t))
    told = []
    for frequency_Hz in np.arange(1.5, 4.01, 0.1):
        noise = noise_m * np.random.default_rng(3).standard_normal(len(t))
        found = finder(t, 0.5 * WIDE_M * np.sin(2.0 * np.pi * frequency_Hz * t + phase) + beside + noise)
        assert found.slower
        if swing := found.slower.buzz():
            told.append(frequency_Hz)
            assert swing.frequency_Hz == pytest.approx(frequency_Hz, abs=swing.within_Hz), frequency_Hz
            assert swing.width_m == pytest.approx(WIDE_M, rel=0.05), frequency_Hz
        elif found.slow:
            assert found.slow.frequency_Hz == pytest.approx(frequency_Hz, abs=0.25 / seconds + 0.02 * frequency_Hz)
            assert found.slow.width == pytest.approx(WIDE_M, rel=0.1)
    assert told[0] < 3.0
    assert len(told) > 10


def test_a_swing_of_3_hz_is_as_wide_as_it_is() -> None:
    """Its drift, which was left out first, took part of it along: it was told 7 % wider."""
    t = np.arange(0.0, 10.0, 1e-3)
    found = finder(t, 4e-3 * np.sin(2.0 * np.pi * 3.0 * t)).slower
    assert found
    swing = found.buzz()
    assert swing
    assert swing.frequency_Hz == pytest.approx(3.0, abs=0.01)
    assert swing.width_m == pytest.approx(WIDE_M, rel=0.005)
