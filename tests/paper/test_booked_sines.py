"""The sampled books of one frequency, by closed form and by the program's controller."""

from __future__ import annotations

import numpy as np
import pytest

from haploop.tools.studies.choi2022.figures.figure_8 import first_ahead_Hz
from haploop.tools.studies.choi2022.sampled import (
    MASS_KG,
    PERIOD_S,
    bidirectional_J,
    closed_form,
    mean_taken,
    returned,
)

FREQUENCIES_HZ = np.array([21.3, 77.7, 151.1, 233.9])


def test_differenced_readings_are_booked_as_the_controller_does() -> None:
    """Bidirectional inertia with the program's own acceleration on prescribed sines, and by the other closed form."""
    theta = 2.0 * np.pi * FREQUENCIES_HZ * PERIOD_S
    booked = MASS_KG * bidirectional_J(FREQUENCIES_HZ, None)
    taken = mean_taken("bidirectional-inertia", theta, 0)
    assert booked == pytest.approx(taken, rel=0.01, abs=1e-3 * taken.max())
    assert booked == pytest.approx(closed_form("bidirectional-inertia", theta, 0), rel=1e-9)


def test_the_paper_s_inertia_is_ahead_of_its_damper_from_some_150_Hz_whatever_the_lag() -> None:
    """1.8 g against 2.7 N s/m: where cos(theta) - cos(2 theta) is 1.5 cos(theta), at 149 Hz, if differenced."""
    cosine = (np.sqrt(8.25) - 0.5) / 4.0
    assert first_ahead_Hz(None) == pytest.approx(np.arccos(cosine) / (2.0 * np.pi * PERIOD_S), abs=0.6)
    assert 140.0 < first_ahead_Hz(1.38e-3) < first_ahead_Hz(None) < first_ahead_Hz(5e-4) < 160.0


def test_the_gate_of_the_sample_before_gives_back_more_than_that_of_the_present_one() -> None:
    """Choi et al. 2022, eq. 9, on a sine of 50 Hz."""
    assert returned(50.7) > 0.03 > 1e-9 > abs(returned(50.7, before=False))
