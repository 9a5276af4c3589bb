"""Charts of the page: the numbers that came, broken where none came, the wall on its side, marks at their ticks."""

import math
import re

import pytest
from playwright.sync_api import expect

from helpers.live.browser import DESK, IN_BOTH, PHONE, seen, settled, still
from helpers.live.stand_in import RUNS
from oracles.snapshots import contact, snapshot, table

NAN = math.nan
ROWS = 400


@pytest.fixture
def page(stand_in, open_page):
    stand_in.state()
    page = open_page(stand_in.url)
    expect(page.locator("#phase")).to_have_text("running")
    return page


def positions(x, wall=None):
    columns = [("x", "m", "position", x)]
    if wall:
        columns.append(("wall", "m", "wall", [wall] * len(x)))
    return snapshot(0.0, 2.0, table("position", 0.0, 2.0 / (len(x) - 1), *columns))


@IN_BOTH
def test_a_line_goes_through_its_values_and_is_broken_where_there_are_none(stand_in, page):
    ramp = [0.01 * i / (ROWS - 1) for i in range(ROWS)]
    hole = [NAN if 0.4 < i / ROWS < 0.6 else value for i, value in enumerate(ramp)]
    stand_in.show(positions(hole))
    settled(page, "position", "10.000")
    left, gap, right = seen(page, "position", [0.2, 0.5, 0.8], "ink")
    assert gap is None
    assert left
    assert right
    height = 1 / (1 + 2 * 0.07)
    for part, (first, last) in ((0.2, left), (0.8, right)):
        expected = 0.5 + height * (0.5 - part)
        assert first - 0.03 <= expected <= last + 0.03


@pytest.mark.parametrize("diverged", [True, False])
def test_a_run_drawn_behind_that_diverged_leaves_the_axis_to_the_run_on_show(stand_in, page, diverged):
    ramp = [0.01 * i / (ROWS - 1) for i in range(ROWS)]
    step = 2.0 / (ROWS - 1)
    own = table("position", 0.0, step, ("x", "m", "position", ramp))
    away = table("overlay_position", 0.0, step, ("x", "m", "position", [100 * x for x in ramp]))
    stand_in.tell({**RUNS, "overlay": "wall-1", "overlay_diverged": diverged})
    stand_in.show(snapshot(0.0, 2.0, own, away))
    settled(page, "position", "10.000")
    (drawn,) = seen(page, "position", [0.8], "ink")
    assert drawn
    assert (drawn[0] < 0.4) == diverged, drawn


@pytest.mark.slow
def test_what_swings_faster_than_there_are_pixels_is_drawn_from_its_least_to_its_greatest(stand_in, page):
    """Also beside a stretch without numbers, which stays empty."""
    rows = [NAN if 700 < i < 900 else 0.01 * (i % 2) for i in range(1601)]
    stand_in.show(positions(rows))
    stand_in.drawn()
    *swings, gap = seen(page, "position", [0.1, 0.3, 0.9, 0.5], "ink")
    assert gap is None
    for drawn in swings:
        assert drawn
        first, last = drawn
        assert abs(first - 0.07 / 1.14) < 0.03
        assert abs(last - 1.07 / 1.14) < 0.03


@pytest.mark.slow
@pytest.mark.parametrize(("into_wall", "solid"), [(-1.0, "below"), (1.0, "above")])
def test_the_wall_is_shaded_on_the_side_of_its_material(into_wall, solid, stand_in, page):
    stand_in.state(wall={"position": 0.005, "stiffness": 150.0, "into_wall": into_wall})
    stand_in.show(positions([0.01 * (i % 2) for i in range(ROWS)], wall=0.005))
    settled(page, "position", "wall")
    page.click("#position .legend button >> nth=0")
    filled = page.evaluate(
        """() => {
            const canvas = document.querySelector("#position canvas");
            const over = document.querySelector("#position .u-over");
            const ratio = canvas.width / canvas.clientWidth, draw = canvas.getContext("2d");
            const x = Math.round((over.offsetLeft + 0.37 * over.offsetWidth) * ratio);
            return [0.1, 0.9].map(part => {
                const y = Math.round((over.offsetTop + part * over.offsetHeight) * ratio);
                const { data } = draw.getImageData(x, y, 9, 3);
                return [3, 7, 11].some(i => data[i] > 20 && data[i] < 90);
            });
        }"""
    )
    assert filled == ([False, True] if solid == "below" else [True, False])


def test_the_numbers_of_an_axis_leave_its_label_alone_however_large_they_are(stand_in, page):
    """The label's strip of pixels is the same beside −8 mJ and −900 mJ; of more, the unit climbs."""

    def label(energy_J, number):
        values = [energy_J * i / (ROWS - 1) for i in range(ROWS)]
        stand_in.show(snapshot(0.0, 2.0, table("energy", 0.0, 2.0 / (ROWS - 1), ("wall", "J", "wall", values))))
        settled(page, "energy", number)
        return page.evaluate(
            """() => {
                const canvas = document.querySelector("#energy canvas");
                const ratio = canvas.width / canvas.clientWidth;
                const strip = [0, 0, 18 * ratio, canvas.height].map(Math.round);
                return canvas.getContext("2d").getImageData(...strip).data.join();
            }"""
        )

    alone = label(-0.008, "−8.000")
    assert len(set(alone.split(","))) > 2, "there is a label"
    assert label(-0.9, "−900.000") == alone
    assert label(-80.0, "−80.000") != alone, "now it is J"
    assert label(-8e6, "−8.000") != alone


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
def test_a_label_stands_over_the_lines_of_other_changes(stand_in, page):
    stand_in.tell({"type": "events", "events": [
        {"tick": tick, "t_s": tick / 1000, "text": "set", "kind": "set"} for tick in (500, *range(510, 660, 16))
    ]})  # fmt: skip
    stand_in.show(contact())
    settled(page, "force", "total")
    solid = """() => {
        const canvas = document.querySelector("#energy canvas"), over = document.querySelector("#energy .u-over");
        const ratio = canvas.width / canvas.clientWidth, draw = canvas.getContext("2d");
        const x = Math.round((over.offsetLeft + 0.275 * over.offsetWidth) * ratio);
        const column = y => draw.getImageData(x - 12, (over.offsetTop + y) * ratio, 24, 1).data;
        const lines = y => [...column(y)].filter((_, i) => i % 4 === 3).filter(alpha => alpha > 200).length;
        return [lines(1), lines(over.offsetHeight / 2)];
    }"""
    label, below = page.evaluate(solid)
    assert label > 2 * below, "the ground of the label hides the lines, which stand below it"


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
def test_of_snapshots_that_come_faster_than_the_screen_the_last_is_what_stays(stand_in, page):
    for i in range(100):
        stand_in.show(positions([0.001 * i] * ROWS))
    settled(page, "position", "99.000")


@pytest.mark.slow
def test_what_changed_the_run_is_marked_at_its_tick_in_every_chart_over_time_and_listed(stand_in, page):
    events = [
        {"tick": 500, "t_s": 0.5, "text": "element 0 becomes damping (0.8 N s/m)", "kind": "swap"},
        {"tick": 1200, "t_s": 1.2, "text": "swap refused: it raised", "kind": "refused"},
    ]
    stand_in.show(contact())
    settled(page, "force", "total")
    for chart in ("position", "force", "energy"):
        assert seen(page, chart, [0.25], "mark") == [None], chart
    stand_in.tell({"type": "events", "events": events})
    expect(page.locator("#events li").last).to_contain_text("tick 500 element 0 becomes damping (0.8 N s/m)")
    for chart in ("position", "force", "energy"):
        line, refused = seen(page, chart, [0.25, 0.6], "mark")
        assert line, chart
        assert line[1] - line[0] > 0.9, f"the mark in {chart} goes from top to bottom"
        assert refused is None, "what was refused took no effect"


@pytest.mark.slow
def test_a_click_on_an_event_shows_its_moment(stand_in, page):
    stand_in.tell({"type": "events", "events": [{"tick": 500, "t_s": 0.5, "text": "set", "kind": "set"}]})
    stand_in.show(contact())
    page.locator("#events button").click()
    expect(page.locator("#freeze")).to_have_text("Go live")
    asked = stand_in.asked(lambda watch: watch["end_s"] is not None)
    assert (asked["span_s"], asked["end_s"]) == (pytest.approx(0.2), pytest.approx(0.6))


@pytest.mark.slow
def test_dragging_in_a_chart_looks_closer_and_a_double_click_goes_back_to_now(stand_in, page):
    stand_in.show(contact())
    settled(page, "force", "total")
    box = page.locator("#force .u-over").bounding_box()
    page.mouse.move(box["x"] + box["width"] * 0.25, box["y"] + 20)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] * 0.5, box["y"] + 20, steps=5)
    page.mouse.up()
    expect(page.locator("#freeze")).to_have_text("Go live")
    asked = stand_in.asked(lambda watch: watch["end_s"] is not None)
    assert (asked["span_s"], asked["end_s"]) == (pytest.approx(0.5, abs=0.02), pytest.approx(1.0, abs=0.02))
    page.mouse.dblclick(box["x"] + 50, box["y"] + 30)
    expect(page.locator("#freeze")).to_have_text("Freeze")
    stand_in.asked(lambda watch: watch["end_s"] is None)


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
