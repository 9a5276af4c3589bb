"""Energy that spring, damper and inertia take out of a sinusoidal motion every sample, held and delayed."""

from __future__ import annotations

import numpy as np
import pytest

from helpers.runs.given_motion import books_along
from helpers.scenes.least import scene

AMPLITUDE_M, PERIOD_S, STEPS = 0.01, 1e-3, 10
K, B, M = 200.0, 0.8, 0.01


def per_sample(turns: int, samples: int, delay_steps: int, **tables) -> dict[str, float]:
    """Every book's mean increment per sample over whole turns of A sin(k theta), theta = 2 pi turns / samples."""
    settle = 60  # ticks, longer than any delay here
    ticks = settle + samples + 1
    theta = 2 * np.pi * turns / samples
    x = AMPLITUDE_M * np.sin(theta * np.arange(ticks * STEPS + 1) / STEPS + 0.1)
    clock = {"round_trip_delay": delay_steps * PERIOD_S / STEPS}
    books, _ = books_along(scene(duration=ticks * PERIOD_S, clock=clock, **tables), x)
    return {name: float(rows[-1] - rows[-1 - samples]) / samples for name, rows in books.items()}


FREQUENCIES = [(1, 100), (7, 100), (30, 120), (49, 120), (59, 120)]
DELAYS = [0, 3, 10, 13, 20, 50]


@pytest.mark.parametrize("delay_steps", DELAYS)
@pytest.mark.parametrize(("turns", "samples"), FREQUENCIES)
def test_spring_damper_and_inertia_take_their_closed_forms_at_any_frequency_and_delay(turns, samples, delay_steps):
    """With d = delay / T, whole or not, theta = w T and s = sin(theta / 2):

        spring   (K A^2 / 2) (cos((d + 1) theta) - cos(d theta)), never above 0 for small theta
        damper   (2 B A^2 / T) s^2 cos((d + 1) theta)
        inertia  (4 M A^2 / T^2) s^3 sin((d + 3/2) theta)
    the mean of -f[k] (x((k + 1 + d) T) - x((k + d) T)) over k.
    """
    theta, d, s = 2 * np.pi * turns / samples, delay_steps / STEPS, np.sin(np.pi * turns / samples)
    deep = {"position": 10 * AMPLITUDE_M, "stiffness": K}
    elements = [
        {"kind": "damping", "damping": B, "acts": "always"},
        {"kind": "bidirectional-inertia", "mass": M, "acts": "in-contact"},
    ]
    taken = per_sample(turns, samples, delay_steps, wall=deep, dissipation=elements)

    def expected(late: float) -> dict[str, float]:
        return {
            "wall": K * AMPLITUDE_M**2 / 2 * (np.cos((late + 1) * theta) - np.cos(late * theta)),
            "damping": 2 * B * AMPLITUDE_M**2 / PERIOD_S * s**2 * np.cos((late + 1) * theta),
            "bidirectional-inertia": 4 * M * AMPLITUDE_M**2 / PERIOD_S**2 * s**3 * np.sin((late + 1.5) * theta),
        }

    scale = {"wall": K * AMPLITUDE_M**2, "damping": B * AMPLITUDE_M**2 / PERIOD_S}
    scale["bidirectional-inertia"] = M * AMPLITUDE_M**2 / PERIOD_S**2
    for name, energy in expected(d).items():
        assert taken[f"{name}.true"] == pytest.approx(energy, rel=0, abs=1e-11 * scale[name]), name
    for name, energy in expected(0.0).items():  # all the controller can know is the loop without its delay
        assert taken[f"{name}.sampled"] == pytest.approx(energy, rel=0, abs=1e-11 * scale[name]), name


@pytest.mark.parametrize("delay_steps", [0, 10, 20, 50])
def test_a_virtual_damper_dissipates_below_a_quarter_of_the_rate_over_delay_plus_one_and_generates_above(delay_steps):
    """The boundary is fs / (4 (d + 1)), d in samples; just there it does nothing."""
    samples, element = 240, {"kind": "damping", "damping": B, "acts": "always"}
    boundary = samples // (4 * (delay_steps // STEPS + 1))
    energy = [
        per_sample(boundary + off, samples, delay_steps, dissipation=[element])["damping.true"] for off in (-1, 0, 1)
    ]
    assert energy[0] > 1e-6
    assert abs(energy[1]) < 1e-6 * energy[0]
    assert energy[2] < -1e-6


@pytest.mark.parametrize("turns", [1, 3, 10])
def test_a_virtual_inertia_that_gives_back_all_in_theory_dissipates_by_its_own_delay(turns):
    """Differencing twice and holding delay it by 3/2 samples, without any delay in the line (Choi et al. 2022)."""
    element = {"kind": "bidirectional-inertia", "mass": M, "acts": "always"}
    assert per_sample(turns, 100, 0, dissipation=[element])["bidirectional-inertia.true"] > 0
    assert per_sample(turns, 100, 10, dissipation=[element])["bidirectional-inertia.true"] > 0


def test_the_unidirectional_inertia_takes_more_from_a_slow_swing_than_the_bidirectional_one():
    """It keeps what the other gives back (Choi et al. 2022, eq. 9): about m v_max^2 / 2 twice a turn."""
    taken = {}
    for kind in ("bidirectional-inertia", "unidirectional-inertia"):
        element = {"kind": kind, "mass": M, "acts": "always"}
        taken[kind] = per_sample(1, 2000, 0, dissipation=[element])[f"{kind}.true"]
    peak_J = M * (AMPLITUDE_M * 2 * np.pi / 2.0) ** 2 / 2
    assert taken["unidirectional-inertia"] == pytest.approx(2 * peak_J / 2000, rel=0.02)
    assert taken["unidirectional-inertia"] > 20 * taken["bidirectional-inertia"]
