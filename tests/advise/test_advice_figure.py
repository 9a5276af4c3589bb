"""The figure of an advice: every mark has its number, nothing has a length, and both panels share an axis."""

import math
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from haploop.tools.advise.families import BOTH, DAMPING, NOTHING
from haploop.tools.advise.figure import figure_of
from haploop.tools.advise.search import fallen
from haploop.tools.advise.walls.limit import Limit
from haploop.tools.advise.walls.store import Failure
from haploop.tools.advise.withstand import Best, Rival
from helpers.data.advices import ADVICE, DAMPED, FOUND, ONE, TWO, changed

WIDE = "Common Mass of a Wrist Motor, " * 3
LONG = replace(
    ADVICE, name=WIDE, tried_by=WIDE, not_varied=(WIDE,), uncertain={WIDE: (0.8, 1.2)}, hand=(0.269, 6.43, 105.0),
    grip=(3.6, 552.0), provisos=(WIDE, WIDE),
)  # fmt: skip


@pytest.fixture(scope="module")
def panels():
    walls, _, changes = figure_of(ADVICE).get_axes()
    return walls, changes


def beside(ax, row):
    return [text.get_text() for text in ax.texts if text.xy[1] == row]


def test_what_withstood_the_attack_stands_beside_what_holds_in_every_corner_and_as_described(panels):
    walls, changes = panels
    assert beside(walls, 0) == ["0.91 N/mm", "–", "2.1 N/mm"]
    assert beside(walls, 1) == ["1.64 N/mm", "1.7 N/mm", "2.9 N/mm"]
    assert beside(walls, 2) == ["below 1.53 N/mm", "2.0 N/mm", "3.1 N/mm"], (
        "the wall at which the attack broke it is not one it bears"
    )
    assert [beside(walls, row)[2] for row in (4, 5, 6)] == ["0 N/mm", "any", "0.80 N/mm"]
    assert [beside(changes, row)[1:] for row in range(3)] == [
        ["5.8 N/mm", "2.3 N/mm"], ["0.13 N/mm", "0.13 N/mm"], ["2.8 N/mm", "2.1 N/mm"],
    ]  # fmt: skip


def test_the_widest_numbers_beside_the_axes_do_not_overlap():
    """ "below 0.040 N/mm" ran into the dash of the column before it."""
    below, wide = Limit(0.0, 40.2), Limit(20_123.4, math.inf)
    bests = (Best(NOTHING, (), below, below), Best(DAMPING, (1.1,), wide, wide), Best(BOTH, (1.1, 2e-3), below))
    figure = figure_of(replace(ADVICE, found=replace(FOUND, bests=bests, fell=((bests[0], 40.2),))))
    figure.draw_without_rendering()
    places = [text.get_window_extent() for text in figure.get_axes()[0].texts if text.get_text()]
    assert not any(one.overlaps(other) for one, other in combinations(places, 2))


@pytest.mark.parametrize("advice", [ADVICE, LONG], ids=["usual", "long words"])
def test_all_that_is_written_is_within_the_figure_and_the_answer_overlaps_nothing(advice):
    figure = figure_of(advice)
    figure.draw_without_rendering()
    whole, (walls, between, changes) = figure.bbox, figure.get_axes()
    lines = [text.get_window_extent() for text in between.texts]
    panels = [ax.get_tightbbox() for ax in (walls, changes)]
    for place in (*lines, *panels):
        assert place
        assert whole.x0 <= place.x0 < place.x1 <= whole.x1
        assert whole.y0 <= place.y0 < place.y1 <= whole.y1
    assert panels[0]
    assert panels[1]
    assert panels[1].y1 < min(line.y0 for line in lines) < max(line.y1 for line in lines) < panels[0].y0
    assert not any(one.overlaps(other) for one, other in combinations(lines, 2))


def test_the_panel_of_changes_says_that_the_element_is_tuned_anew_and_which_column_is_without_one(panels):
    assert panels[1].get_title(loc="left").endswith("in the hardest corners, with the element tuned again")
    assert beside(panels[1], -0.85)[1:] == ["element", "without"]


def test_an_element_that_was_not_attacked_has_no_number_there_however_much_it_bears_in_the_corners(panels):
    assert beside(panels[0], 3) == ["–", "1.8 N/mm", "2.7 N/mm"]


def test_a_wall_far_softer_than_the_others_is_an_arrow_at_the_end_of_the_axis_and_does_not_stretch_it():
    soft = replace(ADVICE, without=(changed("no friction", 2.0, 2.0),))
    walls, _, changes = figure_of(soft).get_axes()
    assert changes.get_xlim() == walls.get_xlim() == (0.02, 10.0)
    assert beside(changes, 1) == ["", "2.0 N/m", "2.0 N/m"]
    arrows = [line for line in changes.lines if line.get_marker() == "<"]
    assert [np.asarray(line.get_xdata()).tolist() for line in arrows] == [[0.02]]
    assert list(walls.get_xlim()) == [0.02, 10.0]


def test_both_panels_have_one_axis_from_and_to_round_numbers_and_no_bar_whose_length_would_mean_nothing(panels):
    assert [ax.get_xlim() for ax in panels] == [(0.1, 10.0)] * 2
    assert not any(ax.patches for ax in panels)


def test_every_kind_of_mark_is_in_a_legend(panels):
    walls, changes = ([text.get_text() for text in ax.get_legend().get_texts()] for ax in panels)
    assert walls == ["as described", "in every corner", "attacked", "formula", "published"]
    assert set(changes) == {"stiffer", "softer", "equally stiff within a tenth", "unchanged"}


def test_an_element_fell_only_where_a_wall_that_it_bears_in_every_corner_broke():
    why = Failure("hold x 1", 1.0, gone=False)
    won, lost, kept = (
        Rival(best, 900.0, 1.0, broken=(below, why)) for best, below in ((DAMPED, 1800.0), (TWO, 1530.0), (ONE, 1910.0))
    )
    assert fallen([won, lost, kept], won) == ((TWO, 1530.0),)
