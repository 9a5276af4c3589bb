"""Numbers in sentences: no power of ten where people write the digits."""

import pytest

from haploop.protocol.filled import filled
from haploop.tools.advise.families import DAMPING


@pytest.mark.parametrize(
    ("value", "text"), [(1234.0, "1234 Hz"), (999.6, "1000 Hz"), (-1234.5, "-1234 Hz"), (0.01234, "0.0123 Hz")]
)
def test_a_number_with_more_digits_than_it_is_rounded_to_is_written_in_digits(value, text):
    assert filled("{:.3g} Hz", value) == text


def test_what_nobody_would_count_keeps_its_power_of_ten():
    assert (filled("{:.3g}", 1e8), filled("{x:.3g}", x=float("inf"))) == ("1e+08", "inf")


def test_words_and_whole_numbers_are_as_they_are_given():
    assert filled("{name} has {count} of {:g}", 2.5, name="1e+3", count=12345678) == "1e+3 has 12345678 of 2.5"


def test_an_advised_element_of_hundreds_is_told_in_digits():
    """It was said to be 2.1e+02 N s/m of damping."""
    assert DAMPING.phrase((210.0,)) == "210 N s/m of damping"
