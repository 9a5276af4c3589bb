"""Energy on sampled motion (Choi et al. 2022, sections II to IV), by closed forms and by the program."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from haploop.tools.studies.choi2022.figures.figure_4 import largest_mass_kg, passive_up_to_Hz
from haploop.tools.studies.choi2022.sampled import (
    DAMPING_N_S_M,
    KINDS,
    MASS_KG,
    PERIOD_S,
    SPRING,
    closed_form,
    forces,
    mean_taken,
    positions,
    steps_J,
    taken_J,
)
from helpers.scenes.effect_tables import slowly

FREQUENCIES = np.array([3.7, 21.3, 57.1, 143.9, 211.7, 333.1, 451.3])
THETA = 2.0 * np.pi * FREQUENCIES * PERIOD_S
LINEAR = [kind for kind in KINDS if not kind.startswith("unidirectional")]
CHANGES = st.floats(0.01, 1.0)


@pytest.mark.parametrize("kind", LINEAR)
@pytest.mark.parametrize("late", [0, 2, *slowly([1, 5])])
def test_under_a_sine_the_programs_controller_takes_what_the_closed_form_says(kind: str, late: int) -> None:
    formula = closed_form(kind, THETA, late)
    assert mean_taken(kind, THETA, late) == pytest.approx(formula, abs=2e-3 * np.abs(formula).max())


def test_the_wrong_delay_is_seen() -> None:
    formula = closed_form("bidirectional-inertia", THETA, 1)
    measured = mean_taken("bidirectional-inertia", THETA, 0)
    assert np.abs(measured - formula).max() > 0.1 * np.abs(formula).max()


@pytest.mark.parametrize("late", [0, 1, 2])
def test_bidirectional_inertia_takes_below_the_sample_rate_over_2d_plus_3_and_gives_above(late: int) -> None:
    bound = 1000.0 / (2 * late + 3)
    theta = 2.0 * np.pi * np.array([0.97, 1.03]) * bound * PERIOD_S
    below, above = mean_taken("bidirectional-inertia", theta, late)
    assert below > 0.0 > above


@pytest.mark.slow
def test_a_slow_sine_loses_the_whole_damping_and_its_kinetic_energy_twice_a_period_to_unidirectional_inertia() -> None:
    """A unidirectional mass takes m V^2 / 2 in each half period and gives nothing back."""
    hertz = 1.013
    theta = np.array([2.0 * np.pi * hertz * PERIOD_S])
    speed = 2.0 * np.pi * hertz
    kinetic = MASS_KG * speed**2 / 2.0 * 2.0 * hertz * PERIOD_S
    assert mean_taken("unidirectional-inertia", theta, 0, ticks=16_000)[0] == pytest.approx(kinetic, rel=0.02)
    heat = DAMPING_N_S_M * speed**2 / 2.0 * PERIOD_S
    assert mean_taken("damping", theta, 0, ticks=16_000)[0] == pytest.approx(heat, rel=0.01)


def test_equation_8_is_the_energy_of_the_programs_inertia_step_by_step() -> None:
    v = np.random.default_rng(8).normal(size=300)
    x = positions(v)[:, None]
    taken = taken_J(x, forces(x, "bidirectional-inertia"))[:, 0]
    assert taken[3:] == pytest.approx(steps_J(v, MASS_KG)[3:], rel=1e-6, abs=1e-12)


def test_equation_5_sums_by_parts_over_any_path() -> None:
    x = np.random.default_rng(5).normal(scale=1e-3, size=(400, 1)).cumsum(axis=0)
    taken = taken_J(x, forces(x, SPRING)).sum()
    ends = 150.0 / 2.0 * (x[-1, 0] ** 2 - x[0, 0] ** 2)
    assert taken == pytest.approx(ends - 150.0 / 2.0 * (np.diff(x[:, 0]) ** 2).sum(), rel=1e-9)


def around(changes: list[np.ndarray]) -> float:
    """Energy taken once around a loop of velocity made of tendencies up, down, up, ..., closed by scaling the downs."""
    ups, downs = sum(one.sum() for one in changes[::2]), sum(one.sum() for one in changes[1::2])
    signed = [one if number % 2 == 0 else -one * ups / downs for number, one in enumerate(changes)]
    v = np.cumsum(np.concatenate(signed))
    return float(steps_J(np.tile(v, 3), 1.0)[-len(v) :].sum())


@given(
    st.lists(st.lists(CHANGES, min_size=2, max_size=5), min_size=2, max_size=8).filter(lambda one: len(one) % 2 == 0)
)
def test_a_closed_loop_of_velocity_whose_tendencies_last_three_samples_never_leaks(
    tendencies: list[list[float]],
) -> None:
    assert around([np.array(one) for one in tendencies]) >= -1e-12


@given(st.lists(CHANGES, min_size=1, max_size=4))
def test_one_that_alternates_by_equal_changes_every_sample_leaks_half_their_squares(sizes: list[float]) -> None:
    size = sizes[0]
    loop = [np.array([size])] * (2 * len(sizes))
    assert around(loop) == pytest.approx(-0.5 * 2 * len(sizes) * size**2)


@pytest.mark.parametrize("drift_m_s", [0.0, 0.05])
def test_jitter_about_rest_costs_unidirectional_inertia_nothing_and_on_a_velocity_more_than_bidirectional(
    drift_m_s: float,
) -> None:
    x = positions(drift_m_s + 0.01 * (-1.0) ** np.arange(40))[:, None]
    taken = {kind: taken_J(x, forces(x, kind))[4:].sum() for kind in KINDS if "inertia" in kind}
    assert taken["bidirectional-inertia"] < 0.0
    if drift_m_s:
        assert taken["unidirectional-inertia"] < taken["bidirectional-inertia"]
    else:
        assert taken["unidirectional-inertia"] == 0.0


@pytest.mark.slow
def test_a_filter_narrows_where_inertia_takes_and_widens_how_much_of_it_is_stable() -> None:
    assert passive_up_to_Hz(None) == pytest.approx(1000.0 / 3.0, abs=2.0)
    assert 200.0 < passive_up_to_Hz(10.0) < passive_up_to_Hz(100.0) < passive_up_to_Hz(None)
    assert largest_mass_kg(30.0, 0.0) > 2.0 * largest_mass_kg(None, 0.0) > 0.0
