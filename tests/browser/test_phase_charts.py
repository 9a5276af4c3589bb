"""Loops of the page: pressing and releasing told apart, the ideal spring beside them, and words where there is none."""

import math

import pytest
from playwright.sync_api import expect

from helpers.live.browser import seen, still
from oracles.snapshots import contact, snapshot, table


@pytest.mark.slow
def test_without_wall_or_inertia_the_loops_say_that_there_is_none(stand_in, page):
    still_there = table("position", 0.0, 5e-3, ("x", "m", "position", [0.001] * 400))
    stand_in.state(wall=None, elements=[])
    stand_in.show(snapshot(0.0, 2.0, still_there))
    expect(page.locator("#loop .absent")).to_contain_text("No wall")
    expect(page.locator("#momentum .absent")).to_contain_text("No virtual inertia")
    stand_in.show(contact())
    expect(page.locator("#loop .absent")).to_be_empty()
    expect(page.locator("#loop .legend")).to_contain_text("ideal spring")
    expect(page.locator("#momentum .legend")).to_contain_text("unidirectional-inertia")


@pytest.mark.slow
def test_where_only_extremes_are_kept_no_wall_is_denied_and_no_line_swings_between_them(stand_in, page):
    """Intervals of 0.1 s between the same two extremes: a line through them would go up and down as nothing did."""
    rows = [(0.0, 0.01)[i % 2] for i in range(40)]
    stand_in.show(
        snapshot(0.0, 2.0, table("position", 0.025, 0.05, ("x", "m", "position", rows), envelope=True), coarse=True)
    )
    expect(page.locator("#position .note")).to_have_text("only ranges of 100 ms kept")
    expect(page.locator("#loop .absent")).to_contain_text("minimum and maximum of each interval")
    expect(page.locator("#momentum .absent")).to_contain_text("minimum and maximum of each interval")
    middle = seen(page, "position", [0.0125 + 0.05 * i for i in range(1, 19)], "ink")
    assert all(edges and edges[1] - edges[0] > 0.8 for edges in middle), "from the least to the greatest all along"
    page.click("[data-panel=spectrum]")
    expect(page.locator("#spectrum > .about")).to_contain_text("No spectrum")
    expect(page.locator("#spectrum")).not_to_contain_text("no line stands out")


@pytest.mark.slow
def test_pressing_and_releasing_are_told_apart_anew_in_every_snapshot(stand_in, page):
    """A straight way in and, in the next snapshot, the same way out: each has the one colour and not the other."""
    way_in = [1e-5 * i for i in range(1, 201)]
    for depth, colour, other in ((way_in, "pressing", "releasing"), (way_in[::-1], "releasing", "pressing")):
        force = [150 * d for d in depth]
        loop = table("loop", 0.0, 1e-3, ("penetration", "m", "", depth), ("force", "N", "", force))
        stand_in.show(snapshot(0.0, 0.2, {**loop, "stiffness": None}))
        stand_in.drawn()
        expect(page.locator("#loop .legend button")).to_have_count(2)
        still(page)
        parts = [0.4 + 0.01 * i for i in range(20)]
        assert any(seen(page, "loop", parts, colour)), colour
        assert not any(seen(page, "loop", parts, other)), colour


@pytest.mark.slow
def test_where_nothing_touches_and_where_there_is_no_spectrum_no_axes_stand_without_a_line(stand_in, page):
    free = [-1e-3] * 20
    for depth, force, told in ((free, [0.0] * 20, "Not in contact in this time."), (free, [0.1] * 20, "")):
        loop = table("loop", 0.0, 1e-3, ("penetration", "m", "", depth), ("force", "N", "", force))
        stand_in.show(snapshot(0.0, 0.02, {**loop, "stiffness": 100.0}))
        expect(page.locator("#loop .absent")).to_have_text(told)
        expect(page.locator("#loop .plot")).to_be_visible(visible=not told)
    page.click("[data-panel=spectrum]")
    expect(page.locator("#spectrum > .about")).to_have_text("Too few samples for a spectrum.")
    expect(page.locator("#spectrum canvas:visible")).to_have_count(0)
    heights = [1e-3 if i == 30 else 0.0 for i in range(500)]
    spectrum = table("spectrum", 1.0, 1.0, ("x", "m", "position", heights), ("force", "N", "force", heights))
    line = {"frequency_Hz": 31.0, "width": 2e-3}
    lines = {"x": line, "force": None, "from_s": 0.0, "to_s": 2.0}
    stand_in.show(snapshot(0.0, 2.0, spectrum, lines=lines))
    expect(page.locator("#spectrum .line-name")).to_have_text(
        ["position, main line: 31.0 Hz, 2.00 mm p-p", "applied force, no line stands out"]
    )
    expect(page.locator("#spectrum canvas:visible")).to_have_count(2)


def test_the_ideal_spring_is_as_steep_as_the_wall(stand_in, page):
    """At the deepest point its line and a loop of the same stiffness meet; of half the stiffness, they do not."""
    depth = [0.002 * math.sin(math.pi * i / 199) for i in range(200)]

    def spring(stiffness):
        rows = table("loop", 0.0, 1e-3, ("penetration", "m", "", depth), ("force", "N", "", [150 * d for d in depth]))
        return snapshot(0.0, 0.2, {**rows, "stiffness": stiffness})

    def height(stiffness):
        """Where the dashed line is, near the deepest point, when the loop itself is hidden."""
        stand_in.show(spring(stiffness))
        stand_in.drawn()
        expect(page.locator("#loop .legend button")).to_have_count(3)
        still(page)
        parts = [0.84 + 0.005 * i for i in range(9)]
        found = [place for place in seen(page, "loop", parts, "ink") if place]
        assert found
        return sum(first for first, _ in found) / len(found)

    stand_in.show(spring(150.0))
    for name in ("pressing", "releasing"):
        page.locator("#loop .legend").get_by_text(name).click()
    steep = height(150.0)
    settled_at = page.locator("#loop .legend button[aria-pressed=false]")
    expect(settled_at).to_have_count(2)
    assert steep < 0.25
    assert height(75.0) > steep + 0.3
