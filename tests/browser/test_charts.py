"""Charts of the page: the numbers that came, broken where none came, the wall on its side, marks at their ticks."""

import math

import pytest
from playwright.sync_api import expect

from helpers.live.browser import IN_BOTH, seen, settled
from helpers.live.stand_in import RUNS
from oracles.snapshots import contact, positions, snapshot, table

NAN = math.nan
ROWS = 400


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


@pytest.mark.slow
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
    expect(page.locator("#position .legend .name").last).to_have_text("over: first wall")
    over = "#position .legend button:has-text('over')"
    assert seen(page, "position", [0.002 if diverged else 0.8], "overlay")[0], "in a colour of its own"
    page.click(over)
    assert not seen(page, "position", [0.002 if diverged else 0.8], "overlay")[0]


@pytest.mark.slow
def test_the_name_of_a_change_stands_over_the_lines(stand_in, page):
    """A broad swing at the top of the chart hardly shows through its veil; beside the name it does."""
    changed = {"tick": 1000, "t_s": 1.0, "kind": "set", "text": "wall.stiffness = 150 N/m"}
    stand_in.tell({"type": "events", "events": [changed]})
    stand_in.show(positions([0.01 * (i % 2) for i in range(1601)]))
    stand_in.drawn()
    named, beside = seen(page, "position", [0.515, 0.9], "ink")
    assert beside
    assert beside[0] < 0.1
    assert named is None or named[0] > 0.08


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


@pytest.mark.slow
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
    assert label(-1.67, "−1.670") != alone, "now it is J"
    assert label(-80.0, "−80.000") != alone
    assert label(-8e6, "−8.000") != alone


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
