"""First-order adaptive windowing: the window it takes, what it errs at most, and where it is of no use."""

from collections.abc import Sequence
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from helpers.runs.estimates import COUNT, ENCODER, T, estimates, floats, measured


def longest_window(counts: Sequence[int], k: int, ticks: int, bound_counts: Fraction | int) -> int:
    """The definition without rounding: |c[k-j] i - (c[k] i - (c[k] - c[k-i]) j)| <= bound i for 0 < j < i."""
    return max(
        i
        for i in range(1, min(ticks, k) + 1)
        if all(
            abs((counts[k - j] - counts[k]) * i + (counts[k] - counts[k - i]) * j) <= bound_counts * i
            for j in range(1, i)
        )
    )


_COUNTS = st.lists(st.integers(-3, 3), min_size=2, max_size=40).map(np.cumsum)
_RAMPS = st.tuples(st.floats(-3, 3), st.floats(-0.2, 0.2), st.integers(20, 60)).map(
    lambda p: [round(p[0] * k + p[1] * k * k) for k in range(p[2])]
)


_BOUNDS = st.sampled_from([Fraction(1, 100), Fraction(1, 2), Fraction(2, 3), Fraction(1), Fraction(3)])


@given(_COUNTS.map(floats) | _RAMPS, st.integers(1, 12), _BOUNDS, st.integers(-10_000, 10_000))
def test_foaw_takes_the_longest_window_whose_line_passes_every_sample(counts, ticks, bound, offset):
    """Deviations of exactly the bound count as within it, wherever on the axis they happen."""
    x = [COUNT * (count + offset) for count in counts]
    tables = {"estimator": "foaw", "ticks": ticks, "bound": float(bound) * COUNT}
    ends, _ = estimates(x, velocity=tables)
    best, _ = estimates(x, velocity={**tables, "fit": "best"})
    assert ends[0] == best[0] == 0.0
    for k in range(1, len(x)):
        i = longest_window(counts, k, ticks, bound)
        assert ends[k] == (x[k] - x[k - i]) / (i * T)
        slope = np.polyfit(np.arange(i + 1) * T, np.array(counts[k - i : k + 1]), 1)[0]
        assert best[k] == pytest.approx(COUNT * slope, rel=1e-6, abs=1e-6 * COUNT / T)


def test_the_reference_itself_tells_a_line_from_a_kink():
    assert longest_window([0, 1, 2, 3, 4], 4, 10, 0) == 4
    assert longest_window([0, 0, 0, 0, 9], 4, 10, 1) == 1
    assert longest_window([0, 1, 0], 2, 10, 1) == 2


@given(st.floats(-0.5, 0.5), st.floats(0, 1), st.integers(1, 20), st.sampled_from(["nearest", "floor"]))
def test_foaw_errs_at_a_constant_velocity_by_no_more_than_one_count_over_its_longest_window(v, start, ticks, rounding):
    """The bound left out is one count: no window is refused, whatever the rounding does."""
    x = measured(start * COUNT + v * np.arange(3 * ticks) * T, rounding)
    found, _ = estimates(x, encoder=ENCODER, velocity={"estimator": "foaw", "ticks": ticks})
    assert np.abs(found[ticks:] - v).max(initial=0.0) <= COUNT / (ticks * T) * (1 + 1e-6)


def test_foaw_shrinks_to_one_tick_where_the_velocity_steps_and_a_fixed_window_does_not():
    ticks, step = 10, 50
    t = np.arange(100)
    x = floats(COUNT * np.where(t <= step, 2.0 * t, 2.0 * step - 5.0 * (t - step)))
    v, _ = estimates(x, velocity={"estimator": "foaw", "ticks": ticks, "bound": COUNT})
    right = np.where(t[1:] <= step, 2.0, -5.0) * COUNT / T
    assert v[1:] == pytest.approx(right)
    blunt, _ = estimates(x, velocity={"estimator": "foaw", "ticks": ticks, "bound": 4 * COUNT})
    assert blunt[step + 1] != pytest.approx(right[step])  # the step is less than 2 bound / T
    smeared, _ = estimates(x, velocity={"estimator": "window", "ticks": ticks})
    wrong = np.abs(smeared[1:] - right) > 1e-6 * COUNT / T
    assert np.flatnonzero(wrong).tolist() == list(range(step, step + ticks - 1))


def test_foaw_with_a_bound_below_the_quantisation_falls_back_to_one_tick_differences():
    """Under 1 / ticks of a count only exact lines pass; with the bound of one count the error is 12 times smaller."""
    true_v = 0.618 * COUNT / T
    x = measured(true_v * np.arange(200) * T)
    plain, _ = estimates(x)
    tight, _ = estimates(x, velocity={"estimator": "foaw", "ticks": 12, "bound": COUNT / 13})
    fair, _ = estimates(x, velocity={"estimator": "foaw", "ticks": 12, "bound": COUNT})
    assert tight == pytest.approx(plain, abs=1e-9 * COUNT / T)
    assert np.abs(plain - true_v).max() > 0.6 * COUNT / T > 7 * np.abs(fair[12:] - true_v).max()
