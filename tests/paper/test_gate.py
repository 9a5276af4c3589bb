"""Eq. 9 as a describing function, against the program's own element on prescribed swings."""

from __future__ import annotations

import math

import numpy as np
import pytest

from haploop.controller.dissipation import Motion
from haploop.controller.dissipation.unidirectional_inertia import UnidirectionalInertia
from haploop.tools.studies.choi2022.theory import always_open_Hz, bidirectional, low_passed_s, unidirectional

PERIOD_S, TICKS, MASS_KG = 1e-3, 40_000, 0.01


def by_the_element(frequency_Hz: float, reading_s: float, delay_s: float) -> tuple[float, float]:
    """Felt mass and felt damping of the program's element, the force's fundamental taken by a Fourier sum.

    x = cos(w t): v[k] is the difference of two samples, a[k] the acceleration ``reading_s`` ago. The force arrives the
    delay and half a period (of the hold) late.
    """
    w, t = 2.0 * math.pi * frequency_Hz, np.arange(TICKS) * PERIOD_S
    x = np.cos(w * t)
    a = -(w**2) * np.cos(w * (t - reading_s))
    element, motion, force = UnidirectionalInertia(mass=MASS_KG), Motion(PERIOD_S, -1.0), np.zeros(TICKS)
    for k in range(1, TICKS):
        motion.v, motion.a, motion.a_before = (x[k] - x[k - 1]) / PERIOD_S, a[k], a[k - 1]
        force[k] = element.force(motion)
    complex_force = 2.0 * np.mean(force * np.exp(-1j * w * t)) * np.exp(-1j * w * (delay_s + PERIOD_S / 2.0))
    felt = complex_force / (MASS_KG * w**2)  # f = -(mass a + damping v): mass w^2 - j damping w, over m w^2
    return felt.real, -felt.imag


@pytest.mark.parametrize(
    ("frequency_Hz", "reading_s", "delay_s"),
    [
        (31.4159, 0.0, 0.0),
        (97.31, 0.0, 0.0016),
        (141.7, 0.00138, 0.0016),
        (233.3, 0.0007, 0.0005),
        (402.9, 0.0014, 0.002),
    ],
)
def test_the_element_of_the_program_has_this_describing_function(
    frequency_Hz: float, reading_s: float, delay_s: float
) -> None:
    mass, damping = by_the_element(frequency_Hz, reading_s, delay_s)
    felt = unidirectional(np.array(frequency_Hz), reading_s=reading_s, delay_s=delay_s)
    assert (mass, damping) == pytest.approx((np.real(felt), -np.imag(felt)), abs=3e-3)


def test_without_lag_half_the_mass_and_a_damping_of_m_w_over_pi_remain() -> None:
    felt = unidirectional(np.array(1e-3), reading_s=0.0, delay_s=0.0)
    assert (np.real(felt), -np.imag(felt)) == pytest.approx((0.5, 1.0 / math.pi), abs=1e-4)


def test_where_the_gate_never_closes_it_is_a_bidirectional_inertia() -> None:
    for reading_s in (0.0, 0.00138):
        at = np.array(always_open_Hz(reading_s=reading_s))
        one, two = (of(at, reading_s=reading_s, delay_s=0.0016) for of in (unidirectional, bidirectional))
        assert np.allclose(one, two, atol=1e-12)


def test_a_late_bidirectional_inertia_damps_up_to_half_a_period_of_lag_and_drives_beyond() -> None:
    lag_s = 0.0021  # 1.6 ms and half a period
    around = np.array([0.98, 1.02]) * 0.5 / lag_s
    below, above = -np.imag(bidirectional(around, reading_s=0.0, delay_s=0.0016))
    assert below > 0.0 > above


def test_a_low_pass_ages_what_it_passes_by_its_phase() -> None:
    """At its cutoff by an eighth of a swing; slow signals by 1 / (2 pi cutoff)."""
    assert low_passed_s(np.array(50.0), 50.0, 5e-4) == pytest.approx(5e-4 + 1.0 / 400.0)
    assert low_passed_s(np.array(0.01), 50.0, 0.0) == pytest.approx(1.0 / (2.0 * np.pi * 50.0), rel=1e-4)
    assert low_passed_s(np.array([3.0, 70.0]), None, 5e-4) == pytest.approx(5e-4)
