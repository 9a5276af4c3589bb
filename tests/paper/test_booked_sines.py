"""The sampled books of one frequency, by closed form and by the program's controller."""

from __future__ import annotations

import numpy as np
import pytest

from haploop.tools.studies.choi2022.figures.figure_8 import ahead, first_ahead_Hz
from haploop.tools.studies.choi2022.sampled import (
    DAMPING_N_S_M,
    MASS_KG,
    PERIOD_S,
    bidirectional_J,
    damper_J,
    mean_taken,
    returned,
    unidirectional_J,
)

FREQUENCIES_HZ = np.array([21.3, 77.7, 151.1, 233.9])


def test_differenced_readings_are_booked_as_the_controller_does() -> None:
    """Damping, and both inertias with the program's own acceleration, on prescribed sines."""
    theta = 2.0 * np.pi * FREQUENCIES_HZ * PERIOD_S
    damping = mean_taken("damping", theta, 0)
    assert damper_J(FREQUENCIES_HZ) * DAMPING_N_S_M == pytest.approx(damping, rel=1e-3, abs=1e-3 * damping.max())
    for kind, booked in (("bidirectional-inertia", bidirectional_J), ("unidirectional-inertia", unidirectional_J)):
        taken = mean_taken(kind, theta, 0)
        assert booked(FREQUENCIES_HZ, None) * MASS_KG == pytest.approx(taken, rel=0.01, abs=1e-3 * taken.max())


def test_a_reading_without_age_is_ahead_of_the_damper_later_than_an_old_one() -> None:
    """1.8 g against 2.7 N s/m: where cos(theta) - cos(2 theta) is 1.5 cos(theta), at 149 Hz, if differenced."""
    frequencies = np.linspace(2.3, 247.9, 492)
    cosine = (np.sqrt(8.25) - 0.5) / 4.0
    assert first_ahead_Hz(bidirectional_J(frequencies, None)) == pytest.approx(
        np.arccos(cosine) / (2.0 * np.pi * PERIOD_S), abs=0.6
    )
    assert first_ahead_Hz(bidirectional_J(frequencies, 0.0)) > first_ahead_Hz(bidirectional_J(frequencies, 1.38e-3))
    assert (ahead(bidirectional_J(frequencies, 1e-3))[frequencies < 100.0] < 1.0).all()


def test_the_gate_of_the_sample_before_gives_back_more_than_that_of_the_present_one() -> None:
    """Choi et al. 2022, eq. 9, on a sine of 50 Hz."""
    assert returned(50.7) > 0.03 > 1e-9 > abs(returned(50.7, before=False))
