"""Legends of the charts: every line with its name, colour and number, hidden or shown, however many there are."""

import math
import re

import pytest
from playwright.sync_api import expect

from helpers.live.browser import DESK, IN_BOTH, PHONE, seen, settled, still
from oracles.snapshots import contact, positions, snapshot, table

NAN = math.nan
ROWS = 400


@pytest.mark.slow
@IN_BOTH
def test_every_part_has_its_line_its_name_and_its_number(stand_in, page):
    stand_in.show(contact())
    settled(page, "force", "0: damping")
    names = page.locator("#force .legend .name").all_inner_texts()
    assert names == ["wall", "0: damping", "1: unidirectional-inertia", "total"]
    assert page.locator("#energy .legend .name").all_inner_texts() == ["wall", "damping", "unidirectional-inertia"]
    expect(page.locator("#energy .note")).to_have_text("residual 2.1e−18 J")
    expect(page.locator("#energy .legend")).to_contain_text("0.300")
    looks = page.evaluate(
        "[...document.querySelectorAll('#force .legend line')]"
        ".map(l => [getComputedStyle(l).stroke, l.getAttribute('stroke-dasharray')].join())"
    )
    assert len(set(looks)) == 4
    dashes = [look.rsplit(")", 1)[1] for look in looks]
    assert len(set(dashes[1:3])) == 2, "elements differ without colour, too"


@IN_BOTH
@pytest.mark.slow
def test_a_chart_stays_in_its_place_under_the_cursor_whatever_its_numbers_need(stand_in, page):
    """At each of these widths the time under the cursor may need a row more in some legend."""
    stand_in.show(contact())
    settled(page, "force", "0: damping")
    for width in (1130, 1210, 1290):
        page.set_viewport_size({"width": width, "height": 720})
        still(page)
        box = page.locator("#force .u-over").bounding_box()
        places = []
        for part in (0.3, 0.4, 0.5):
            page.mouse.move(box["x"] + box["width"] * part, box["y"] + 30)
            settled(page, "force", "wall")
            still(page)
            places.append(page.locator("#force .u-over").bounding_box()["y"])
            assert "at " in page.inner_text("#force .note"), width
        assert len(set(places)) == 1, width
        page.mouse.move(0, 0)
        expect(page.locator("#force .note")).to_be_empty()
        assert page.locator("#force .u-over").bounding_box()["y"] == places[0], width


@IN_BOTH
@pytest.mark.slow
def test_of_many_books_the_legend_leaves_the_chart_its_room_and_every_name_can_be_scrolled_to(stand_in, page):
    books = [(f"unidirectional-inertia-{i}", "J", f"unidirectional-inertia-{i}", [1e-3 * i] * ROWS) for i in range(16)]
    stand_in.show(snapshot(0.0, 2.0, table("energy", 0.0, 2.0 / (ROWS - 1), *books)))
    names = page.locator("#energy .legend .name")
    expect(names).to_have_count(16)
    assert page.locator("#energy .u-over").bounding_box()["height"] > 60
    names.last.scroll_into_view_if_needed()
    legend, name = page.locator("#energy .legend").bounding_box(), names.last.bounding_box()
    assert legend["y"] <= name["y"]
    assert name["y"] + name["height"] <= legend["y"] + legend["height"] + 1


@IN_BOTH
@pytest.mark.slow
@pytest.mark.parametrize("viewport", [DESK, PHONE])
def test_own_columns_with_long_names_are_told_in_full(viewport, stand_in, page):
    page.set_viewport_size(viewport)
    label = "element 0: time-domain-passivity-observer, velocity_after_deadband_and_filter"
    stand_in.state(own=True)
    page.click("[data-panel=own]")
    columns = [(f"own.0.{i}", "m/s", label, [0.1 * i] * ROWS) for i in range(2)]
    stand_in.show(snapshot(0.0, 2.0, table("own.0", 0.0, 2.0 / (ROWS - 1), *columns)))
    name = page.locator("#own .legend .name").first
    expect(name).to_have_text(label.removeprefix("element "))
    assert name.evaluate("e => e.scrollWidth <= e.clientWidth + 1 && e.scrollHeight <= e.clientHeight + 1")
    assert page.locator("#own .u-over").bounding_box()["height"] > 80


# What stands along the left axis of a chart of one column after each of these, and how far from 0 the axis goes.
AXES = """async columns => {
    const { TimeChart } = await import("/static/charts/time_chart.js");
    const host = document.body.appendChild(document.createElement("section"));
    const options = { label: "", unit: "N s/m", prefix: "", least: 1e-9, zero: false, times: true };
    const chart = new TimeChart(host, options, { measured: [] });
    const line = { key: "own", label: "own", line: { colour: "ink", width: 1 } };
    return columns.map(column => {
        const values = Float64Array.from(column);
        chart.show([0, 1], values.map((_, i) => i / 10), [{ ...line, values }]);
        return [chart.u.axes[1].label, chart.range.now[1]];
    });
}"""


@pytest.mark.slow
def test_a_column_that_is_zero_has_its_plain_unit_and_one_that_is_small_a_prefix(page):
    zero, small = [0.0] * 5, [0.0, 2e-9, 4e-9, 2e-9, 0.0]
    (plain, to), (prefixed, _), (still, _) = page.evaluate(AXES, [zero, small, zero])
    assert (plain, prefixed, still) == ("N s/m", "nN s/m", "nN s/m")
    assert to == pytest.approx(0.57), "0 and as much beyond it as there is beside all numbers"


@pytest.mark.slow
def test_an_element_has_the_same_colour_in_force_energy_and_momentum(stand_in, page):
    stand_in.show(contact())
    settled(page, "force", "unidirectional-inertia")
    stroke = "line => getComputedStyle(line).stroke"

    def colour(chart, number):
        return page.locator(f"#{chart} .legend line").nth(number).evaluate(stroke)

    assert colour("force", 1) == colour("energy", 1)
    assert colour("force", 2) == colour("energy", 2) == colour("momentum", 0)
    assert colour("force", 1) != colour("force", 2)


@pytest.mark.slow
def test_a_line_can_be_hidden_and_brought_back_and_stays_hidden_in_the_next_snapshot(stand_in, page):
    stand_in.show(positions([0.004] * ROWS, wall=0.0))
    settled(page, "position", "4.000")
    assert seen(page, "position", [0.5], "ink")[0]
    button = page.locator("#position .legend button").first
    button.click()
    expect(button).to_have_attribute("aria-pressed", "false")
    assert seen(page, "position", [0.5], "ink")[0] is None
    stand_in.show(positions([0.003] * ROWS, wall=0.0))
    settled(page, "position", "3.000")
    assert seen(page, "position", [0.5], "ink")[0] is None
    button.click()
    assert seen(page, "position", [0.5], "ink")[0]


@pytest.mark.slow
def test_under_the_cursor_all_charts_tell_their_numbers_of_that_time(stand_in, page):
    stand_in.show(contact())
    settled(page, "energy", "0.300")
    box = page.locator("#position .u-over").bounding_box()
    page.mouse.move(box["x"] + box["width"] * 0.5, box["y"] + 20)
    settled(page, "energy", "0.15")
    for chart in ("position", "force", "energy"):
        expect(page.locator(f"#{chart} .note")).to_have_text(re.compile(r"at (0\.99|1\.00)\d\d s"))


@pytest.mark.slow
def test_a_scene_of_many_elements_is_drawn_with_all_of_them(stand_in, page):
    forces = [(f"element.{i}.damping", "N", f"element {i}: damping", [0.1 * i] * ROWS) for i in range(10)]
    stand_in.show(snapshot(0.0, 2.0, table("force", 0.0, 2.0 / (ROWS - 1), *forces)))
    expect(page.locator("#force .legend li")).to_have_count(10)
