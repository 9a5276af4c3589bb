"""The advice of ``haploop cost`` and what it shows, on data made by hand."""

from dataclasses import replace

import pytest
from rich.console import Console

from haploop.tools.cost.data import Load, Point, ReferenceNote, SceneCost, Spread
from haploop.tools.cost.findings import advice, cheapest
from haploop.tools.cost.report import report
from helpers.data.costs import fake_cost, fake_error


def point(method, rate, size_m, us, right=True, pointwise=True):
    """A point that reached an error in a time, its quartiles 1 µs to either side."""
    error = fake_error(size_m, pointwise, "steady" if right else "limit-cycle", right)
    return Point(method, rate, error, None, Spread(us, us - 1, us + 1))


def scene(*points, own=("exact", 10_000), error_m=1e-15, pointwise=True):
    """A scene with these points."""
    note = ReferenceNote("By hand.", error_m, pointwise, "steady")
    method, rate = own
    return SceneCost("made", "Made by hand", method, rate, 100, note, list(points))


EXACT = point("exact", 10_000, 1e-14, 50.0)
FAST = point("rk4", 2_000, 5e-7, 20.0)
ROUGH = point("euler", 1_000, 1e-3, 10.0)
LUCKY = point("euler", 2_000, 5e-7, 12.0, right=False)


def test_the_cheapest_meets_the_tolerance_and_has_the_right_verdict():
    assert cheapest(scene(EXACT, FAST, ROUGH, LUCKY), 1e-6) is FAST
    assert cheapest(scene(EXACT, FAST, ROUGH, LUCKY), 1e-9) is EXACT
    assert cheapest(scene(EXACT, FAST, ROUGH, LUCKY), 1e-2) is ROUGH
    assert cheapest(scene(ROUGH, LUCKY), 1e-6) is None


def test_a_setting_exactly_at_the_tolerance_meets_it():
    assert cheapest(scene(FAST), 5e-7) is FAST
    assert cheapest(scene(FAST), 4.99e-7) is None


@pytest.mark.parametrize(
    ("made", "said"),
    [
        (
            scene(EXACT, FAST, ROUGH),
            "Cheapest within 1.00 µm of the reference: rk4 at 2 kHz, 20.0 µs a tick; "
            "the scene's own, exact at 10 kHz, takes 50.0 µs, 2.50 times as long.",
        ),
        (
            scene(EXACT, point("rk4", 5_000, 1e-9, 40.0)),
            "Cheapest within 1.00 µm of the reference: rk4 at 5 kHz, 40.0 µs a tick; "
            "the scene's own, exact at 10 kHz, takes 50.0 µs, 1.25 times as long.",
        ),
        (
            scene(EXACT, point("rk4", 5_000, 1e-9, 49.0)),
            "Cheapest within 1.00 µm of the reference: rk4 at 5 kHz, 49.0 µs a tick; the scene's own, exact at 10 kHz, "
            "takes 50.0 µs, 1.02 times as long, which these measurements cannot tell apart.",
        ),
        (
            scene(EXACT, ROUGH),
            "Cheapest within 1.00 µm of the reference: exact at 10 kHz, 50.0 µs a tick; it is the scene's own setting.",
        ),
        (
            scene(EXACT, ROUGH, own=("euler", 1_000)),
            "Cheapest within 1.00 µm of the reference: exact at 10 kHz, 50.0 µs a tick; "
            "the scene's own, euler at 1 kHz, takes 10.0 µs and is off by 1.00 mm.",
        ),
        (
            scene(EXACT, LUCKY, own=("euler", 2_000)),
            "Cheapest within 1.00 µm of the reference: exact at 10 kHz, 50.0 µs a tick; the scene's own, "
            "euler at 2 kHz, takes 12.0 µs and is off by 500 nm, limit-cycle instead of steady.",
        ),
        (
            scene(EXACT, Point("euler", 500, None, "Diverged: far.", Spread(9, 9, 9)), own=("euler", 500)),
            "Cheapest within 1.00 µm of the reference: exact at 10 kHz, 50.0 µs a tick; "
            "the scene's own, euler at 500 Hz, fails.",
        ),
        (
            scene(ROUGH, LUCKY, own=("euler", 1_000)),
            "No setting is within 1.00 µm of the reference; euler at 1 kHz comes nearest, 1.00 mm.",
        ),
        (scene(LUCKY), "No setting is within 1.00 µm of the reference: none ran to the end with the right verdict."),
        (
            scene(EXACT, error_m=3e-6),
            "No setting can be said to be within 1.00 µm of the reference: "
            "the reference itself is only known to 3.00 µm.",
        ),
        (
            scene(point("exact", 10_000, 1e-8, 50.0, pointwise=False), pointwise=False),
            "Cheapest within 1.00 µm of the reference in amplitude: exact at 10 kHz, 50.0 µs a tick; "
            "it is the scene's own setting.",
        ),
    ],
)
def test_the_sentence_says_what_the_data_say(made, said):
    assert advice(made, 1e-6) == said


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
    assert any(not p.error.verdict_right for scene in cost.scenes for p in scene.points if p.error)
    assert "✗ limit-cycle" in text
    assert "busy" not in text


def test_a_busy_machine_is_told():
    varied = shown(replace(fake_cost(), load=Load(0.9, 0.2)))
    assert "The machine was busy meanwhile: a fixed loop timed once a round varied by 20.0 %" in varied
    loaded = shown(replace(fake_cost(), load=Load(4.0, 0.01)))
    assert "the load average was 4.0" in loaded
    assert "busy" not in shown(replace(fake_cost(), load=None))
