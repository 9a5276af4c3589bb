"""The advice of ``haploop cost`` and what it shows, on data made by hand."""

import math
from dataclasses import replace

import pytest
from rich.console import Console

from haploop.tools.cost.data import Load, Point, ReferenceNote, SceneCost, Spread
from haploop.tools.cost.findings import advice, cheapest, exact_below_m, meets
from haploop.tools.cost.page import report
from helpers.data.costs import fake_cost, fake_error


def point(method, rate, size_m, us, pointwise=True):
    """A point that reached an error in a time, its interval 1 to either side."""
    return Point(method, rate, fake_error(size_m, pointwise), None, Spread(us, us - 1, us + 1))


def scene(*points, own=("exact", 10_000), error_m=1e-15, pointwise=True):
    """A scene with these points."""
    note = ReferenceNote("By hand.", error_m, pointwise)
    method, rate = own
    return SceneCost("made", "Made by hand", method, rate, 1_000, 100, note, list(points))


EXACT = point("exact", 10_000, 1e-14, 50.0)
FAST = point("rk4", 2_000, 5e-7, 20.0)
ROUGH = point("euler", 1_000, 1e-3, 10.0)
FAILED = Point("euler", 2_000, None, "Diverged: far.", Spread(12.0, 11.0, 13.0))


def test_the_cheapest_meets_the_tolerance_and_did_not_fail():
    assert cheapest(scene(EXACT, FAST, ROUGH, FAILED), 1e-6) is FAST
    assert cheapest(scene(EXACT, FAST, ROUGH, FAILED), 1e-9) is EXACT
    assert cheapest(scene(EXACT, FAST, ROUGH, FAILED), 1e-2) is ROUGH
    assert cheapest(scene(ROUGH, FAILED), 1e-6) is None


def test_a_setting_exactly_at_the_tolerance_meets_it():
    assert cheapest(scene(FAST), 5e-7) is FAST
    assert cheapest(scene(FAST), 4.99e-7) is None


@pytest.mark.parametrize(
    ("made", "said"),
    [
        (
            scene(EXACT, FAST, ROUGH),
            "Cheapest within 1.00 µm of the reference: rk4 at 2 kHz, 20 (19–21) times the yardstick.",
        ),
        (
            scene(EXACT, point("rk4", 5_000, 1e-9, 49.0), ROUGH),
            "Cheapest within 1.00 µm of the reference: rk4 at 5 kHz, 49 (48–50) times the yardstick; "
            "not told apart: exact at 10 kHz.",
        ),
        (
            scene(EXACT, FAILED),
            "Cheapest within 1.00 µm of the reference: exact at 10 kHz, 50 (49–51) times the yardstick.",
        ),
        (
            scene(ROUGH, FAILED),
            "No setting is within 1.00 µm of the reference; euler at 1 kHz comes nearest, 1.00 mm.",
        ),
        (scene(FAILED), "No setting is within 1.00 µm of the reference: none ran to its end."),
        (
            scene(EXACT, error_m=3e-6),
            "No setting can be said to be within 1.00 µm of the reference: "
            "the reference itself is only known to 3.00 µm.",
        ),
        (
            scene(point("exact", 10_000, 1e-8, 50.0, pointwise=False), pointwise=False),
            "Cheapest within 1.00 µm of the reference in amplitude: exact at 10 kHz, 50 (49–51) times the yardstick.",
        ),
    ],
)
def test_the_sentence_says_what_the_data_say(made, said):
    assert advice(made, 1e-6) == said


def test_an_error_in_doubt_is_held_against_a_tolerance_with_its_interval():
    """A mean swing that is off by 0.1 um, known to 2 um, is not within 1 um of the truth."""
    doubtful = replace(EXACT, error=fake_error(1e-7, pointwise=False, doubt_m=2e-6))
    assert not meets(doubtful, 1e-6)
    assert meets(doubtful, 3e-6)
    assert meets(replace(EXACT, error=fake_error(1e-7, pointwise=False, doubt_m=2e-7)), 1e-6)


def test_below_the_least_error_of_a_cheaper_method_nothing_beats_the_exact_flow():
    assert exact_below_m(scene(EXACT, FAST, ROUGH)) == 5e-7
    assert exact_below_m(scene(EXACT, ROUGH)) == 1e-3
    # 49.5 +- 1 is not told apart from 50 +- 1, and a failure is no rival.
    assert exact_below_m(scene(EXACT, point("rk4", 5_000, 1e-9, 49.5), ROUGH)) == 1e-3
    assert exact_below_m(scene(EXACT, FAILED)) == math.inf
    assert exact_below_m(scene(FAST)) is None


def shown(cost, width=140):
    console = Console(width=width, record=True, file=None, quiet=False)
    with console.capture() as capture:
        console.print(report(cost))
    return capture.get()


def test_the_table_holds_every_point_and_why_some_failed():
    cost = fake_cost()
    text = shown(cost)
    assert text.count("100 kHz") >= 5 * 6
    for scene in cost.scenes:
        assert f"{scene.name}: {scene.advice}" in text
        failures = [point.failure for point in scene.points if point.failure]
        assert all(failure in text for failure in failures)
    assert text.count("✗") >= 2 * sum(p.error is None for scene in cost.scenes for p in scene.points)


def test_the_yardstick_is_told_with_how_steady_it_was():
    text = " ".join(shown(replace(fake_cost(), load=Load(4.3, 0.2, 4.0))).split())
    assert "The yardstick is a tick of a plain wall; here it took 4.30 µs" in text
    assert "its middle half lay within 20 %, under a load average of 4.0" in text
    assert "here it took" not in shown(replace(fake_cost(), load=None))
