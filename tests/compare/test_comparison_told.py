"""What a comparison of stabilizers says and draws: its sentences, page, report and figure."""

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest
from matplotlib.text import Text

from haploop.api.results import ComparisonResult
from haploop.tools.advise.families import STABILIZERS
from haploop.tools.compare.figure import figure_of
from haploop.tools.compare.page import page, places, sentences
from haploop.tools.compare.report import comparison_data, report
from helpers.data.compared import compared
from helpers.shown import shown

PAGE_TEXT = (Path(__file__).parents[2] / "docs/comparison.md").read_text(encoding="utf-8")


def test_the_sentences_follow_from_the_rankings():
    told = sentences([compared()])
    assert len(told) == 5
    lead = "What holds most in the loop as described: "
    assert told[0] == f"{lead}on a device, no element is shown to hold more than none, 1.00 N/mm."
    assert told[1].endswith("or nothing if there is none: nothing on a device.")
    assert told[2] == "Damping cannot be told apart from no element on any of these loops."
    assert told[4].endswith("so adaptive inertia does not help, as far as can be told.")
    helped = sentences([compared(passivity_controller_with_inertia=2000.0)])
    assert "inertia holds more on a device (1 of 1) than passivity controller; adaptive inertia cannot" in helped[4]
    assert helped[4].endswith("so adaptive inertia helps, and on a device it is what to take.")
    assert ": passivity controller with inertia on" in helped[1]
    both = sentences([compared(passivity_controller_with_inertia=2000.0, damping=2000.0)])
    assert ": damping on" in both[1], "the simpler of two that are alike"
    assert both[4].endswith("but nowhere more than every other element.")
    mixed = sentences([compared(passivity_controller_with_inertia=2000.0, adaptive_inertia=500.0)])
    assert mixed[4].endswith("helps on some loops and harms on others.")
    harmful = sentences([compared(unidirectional_inertia=500.0, adaptive_inertia=500.0)])
    assert harmful[3].startswith("Unidirectional inertia holds less on a device (1 of 1) than no element; ")
    assert harmful[4].endswith("does not help, and does harm.")


def test_loops_are_named_by_their_device_once_for_all_of_them():
    of = compared().loops[0]
    loops = {("a", "as described"): of, ("a", "slow"): of, ("b", "as described"): of, ("b", "slow"): of}
    assert places([*loops], loops) == "every loop of a and every loop of b"
    assert places([("a", "slow"), ("b", "as described"), ("b", "slow")], loops) == "a (slow) and every loop of b"


def test_no_ranking_of_the_page_is_the_other_way_round_under_other_seeds():
    said = re.findall(r"(\d+) of (\d+) pairs that .* (\d+) are the other way round", PAGE_TEXT)
    assert said
    assert all(other == "0" for *_, other in said)


@pytest.mark.slow
def test_page_and_report_have_every_element_and_fit_into_a_terminal():
    told = compared(bidirectional_inertia=2000.0)
    words = page([told, told])
    assert all(family.name in words for family in STABILIZERS)
    assert "**bidirectional inertia**" in words
    assert "+1.00 (+1.00 to +1.00) ▲" in words
    json.dumps(comparison_data(told))
    assert max(map(len, shown(report(told), 80).splitlines())) <= 80


def test_a_comparison_tells_in_python_what_to_take_and_prints_as_the_command_does():
    told, same = (ComparisonResult(**vars(of)) for of in (compared(bidirectional_inertia=2000.0), compared()))
    assert told.recommended["element"] == told.most["element"] == "bidirectional inertia"
    assert told.recommended["held_N_m"] == told.held_N_m["bidirectional inertia"] == pytest.approx(2000.0)
    assert told.recommended["parameters"] == {"bidirectional-inertia.mass": 1.0}
    assert same.recommended == {"element": "nothing", "held_N_m": pytest.approx(1000.0), "parameters": {}}
    assert repr(told).startswith("<Comparison on a device: ")
    assert "\n" not in repr(told)
    assert str(told).startswith("All stabilizers on a device, each tuned alike: for comparing, not for building.")
    assert comparison_data(told)["recommended"] == told.recommended


@pytest.mark.parametrize("name", ["omega3", "an_own_device_with_a_long_name"])
def test_no_legend_of_the_figure_covers_the_name_of_the_device(name):
    [loop] = compared().loops
    figure = figure_of([replace(compared(), name=name, loops=(replace(loop, delay_s=1e-3), loop))])
    figure.canvas.draw()
    words = [text for text in figure.findobj(Text) if isinstance(text, Text)]
    [title] = [text for text in words if text.get_text().startswith(name)]
    legends = [legend for ax in figure.axes if (legend := ax.get_legend())]
    assert title.get_text() == f"{name}, round trip 1 ms"
    assert len(legends) == 3
    assert not any(legend.get_window_extent().overlaps(title.get_window_extent()) for legend in legends)
    assert figure.bbox.contains(*title.get_window_extent().max)
