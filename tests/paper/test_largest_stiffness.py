"""The best size of an element, searched continuously, and what is told of a map of drives."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from haploop.tools.studies.choi2022.device import KINDS, Setup
from haploop.tools.studies.choi2022.figures.figure_3 import leaks_of_phases_J, single_contact
from haploop.tools.studies.choi2022.figures.figure_4 import least_lag_best_g
from haploop.tools.studies.choi2022.figures.figure_14 import bands_Hz, soft_and_stiff
from haploop.tools.studies.choi2022.theory import DAMPINGS, MASSES, best_size, first_end

SETUP = Setup(
    mode_Hz=225.0, near_share=0.3, mode_damping=0.02, push_N=3.0, entry_m_s=0.2, hand=1.0, delay_s=0.0005,
    unit="ideal", mount="motor",
)  # fmt: skip


def test_a_sharp_peak_between_two_sizes_of_the_grid_is_found() -> None:
    sizes = np.geomspace(0.1, 40.0, 16)
    peak = float(np.sqrt(sizes[7] * sizes[8]))

    def ends(of: np.ndarray) -> np.ndarray:
        return 1000.0 + 5000.0 * np.maximum(0.0, 1.0 - np.abs(np.log(of / peak)) / 0.5)

    best = best_size(ends, sizes, 900.0)
    assert best.size == pytest.approx(peak, rel=0.02)
    assert best.stiffness > 5800.0
    assert ends(sizes).max() < 4100.0  # the grid alone is not enough


def test_of_two_peaks_the_higher_one_is_found_though_the_grid_ranks_it_second() -> None:
    sizes = np.geomspace(0.1, 40.0, 16)
    on_grid, between = sizes[4], np.sqrt(sizes[10] * sizes[11])

    def ends(of: np.ndarray) -> np.ndarray:
        peaks = [(on_grid, 5000.0), (between, 6000.0)]
        return np.max([top * np.maximum(0.0, 1.0 - 2.0 * np.abs(np.log(of / at))) for at, top in peaks], axis=0)

    assert ends(sizes).argmax() == 4
    assert best_size(ends, sizes, 1.0).size == pytest.approx(between, rel=0.02)


def test_where_every_size_only_harms_the_best_is_none() -> None:
    assert best_size(lambda of: 100.0 / of, np.geomspace(0.3, 40.0, 16), 700.0) == (700.0, 0.0)


@pytest.mark.slow
@pytest.mark.parametrize("mode_Hz", [70.0, 170.0, 450.0])
def test_the_search_comes_within_a_per_cent_of_a_scan_of_three_hundred_sizes(mode_Hz: float) -> None:
    setup = replace(SETUP, mode_Hz=mode_Hz)

    def ends(kind: str, sizes: np.ndarray) -> np.ndarray:
        return np.array([first_end(setup, kind, float(size)) for size in sizes])

    nothing = first_end(setup, KINDS[0], 0.0)
    for kind, sizes in ((KINDS[1], DAMPINGS), (KINDS[2], MASSES)):
        scan = ends(kind, np.geomspace(sizes[0], sizes[-1], 300)).max()
        assert best_size(partial(ends, kind), sizes, nothing).stiffness > 0.99 * max(scan, nothing)


def test_the_bands_of_a_ratio_end_where_its_logarithm_passes_through_zero() -> None:
    modes = np.array([50.0, 100.0, 200.0, 400.0])
    [(low, high)] = bands_Hz(modes, np.array([0.5, 2.0, 2.0, 0.5]))
    assert (low, high) == (pytest.approx(np.sqrt(50.0 * 100.0)), pytest.approx(np.sqrt(200.0 * 400.0)))
    assert bands_Hz(modes, np.array([2.0, 0.5, 0.5, 2.0]))[0][0] == pytest.approx(50.0)
    assert len(bands_Hz(modes, np.array([2.0, 0.5, 0.5, 2.0]))) == 2
    assert bands_Hz(modes, np.full(4, 0.5)) == []


def test_a_row_follows_the_rule_contradicts_it_or_says_neither() -> None:
    """Along the modes, in the order nothing, damping, bi- and unidirectional; a lead of less than 5 % is none."""
    inertia, damping, even = [1.0, 2.0, 3.0, 1.0], [1.0, 3.0, 1.0, 2.0], [1.0, 2.0, 2.05, 1.0]
    rows = np.array([[inertia, damping], [damping, inertia], [inertia, inertia], [even, damping]])
    assert soft_and_stiff(rows).tolist() == [1, -1, 0, 0]


def test_the_leak_of_a_sampled_contact_does_not_hang_on_where_the_tick_falls() -> None:
    """K x_max v T at constant speed; here the device turns, and the phase moves it by a per cent."""
    leaks = leaks_of_phases_J(single_contact("sampled and held"), 16)
    assert leaks.std() / leaks.mean() < 0.02
    assert leaks.mean() == pytest.approx(14.6e-6, rel=0.02)


@pytest.mark.slow
def test_the_low_pass_with_the_least_lag_is_best_without_delay_from_small_inertias_on() -> None:
    """The paper's 10 g among them; late loops want more lag of small inertias."""
    first, last = least_lag_best_g(0.0).removesuffix(" g").split(" to ")
    assert float(first) < 10.0 < float(last)
    late = least_lag_best_g(0.002).split(" to ")
    assert float(late[0]) > 10.0
