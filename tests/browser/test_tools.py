"""Tools of the page: panels beside the charts, cursors that measure, files that are saved, runs to choose, sliders."""

import base64
import json
import re

import pytest
from playwright.sync_api import expect

from helpers.live.browser import IN_BOTH, RGB, order
from helpers.live.stand_in import OPTIONS, RUNNING, RUNS, WAITING
from oracles.snapshots import contact, snapshot, table

# Whether a colour stands in the rows of names of a saved picture: in none of the rows that a chart's canvas takes.
SAVED_HEAD = """async ([source, colour]) => {
    const image = await createImageBitmap(new Blob([Uint8Array.from(atob(source), c => c.charCodeAt(0))]));
    const canvas = new OffscreenCanvas(image.width, image.height), draw = canvas.getContext("2d");
    draw.drawImage(image, 0, 0);
    const shown = [...document.querySelectorAll(".chart canvas")].filter(c => c.getClientRects().length);
    const heights = shown.map(c => c.height);
    const rows = [[0, 56]];
    for (let i = 0, y = 56; i < heights.length; y += 18 + heights[i++] + 10) rows.push([y, 18]);
    return rows.some(([top, high]) => {
        const { data } = draw.getImageData(0, top, image.width, high);
        for (let i = 0; i < data.length; i += 4)
            if (Math.hypot(...[0, 1, 2].map(c => data[i + c] - colour[c])) < 12) return true;
        return false;
    });
}"""

pytestmark = pytest.mark.slow
ROWS = [
    ("hand", "flow", -2e-3),
    ("delay", "flow", -1e-3),
    ("damping", "flow", 2.5e-3),
    ("put into store", "store", 5e-4),
]


def with_header(data: bytes, **more) -> bytes:
    """A snapshot with more entries in its header."""
    length = int.from_bytes(data[:4], "little")
    head = json.dumps(json.loads(data[4 : 4 + length]) | more).encode()
    head += b" " * (-(4 + len(head)) % 8)
    return len(head).to_bytes(4, "little") + head + data[4 + length :]


def test_bars_of_energy_lie_left_of_zero_where_they_feed_and_right_where_they_take(stand_in, page):
    rows = [{"name": name, "is": what, "total_J": joules, "window_J": joules / 4} for name, what, joules in ROWS]
    page.click("[data-panel=energy]")
    stand_in.asked(lambda watch: watch["panel"] == "energy")
    stand_in.show(with_header(contact(), budget={"from_s": 1.0, "to_s": 3.0, "about_s": 0.0, "rows": rows}))
    expect(page.locator("#budget output")).to_have_text(["−2.00 mJ", "−1.00 mJ", "2.50 mJ", "500 µJ"])
    zero = page.locator("#budget b").bounding_box()
    for (name, _, joules), bar in zip(ROWS, page.locator("#budget .bar").all(), strict=True):
        box, track = bar.bounding_box(), bar.locator("..").bounding_box()
        middle = track["x"] + track["width"] / 2
        assert abs(zero["x"] + zero["width"] / 2 - middle) < 3, "the 0 stands where the bars begin"
        assert (box["x"] + box["width"] / 2 < middle) == (joules < 0), name
    titles = [row.get_attribute("title") for row in page.locator("#budget .bars > div").all()]
    assert "feeds the device" in titles[0]
    assert "takes out of the device" in titles[2]
    assert titles[3] == "put into store: put into store 500 µJ"
    assert [row.get_attribute("class") for row in page.locator("#budget .bars > div").all()] == [None] * 3 + ["store"]
    page.click("#budget label:has-text('power')")
    expect(page.locator("#budget output").first).to_have_text("−250 µW")


def test_a_cause_that_comes_later_has_its_bar_where_it_is_told_and_not_below_the_store(stand_in, page):
    def told(*names):
        rows = [{"name": name, "is": "flow", "total_J": 1e-3, "window_J": 0.0} for name in names]
        stand_in.show(with_header(contact(), budget={"from_s": 1.0, "to_s": 3.0, "about_s": 0.0, "rows": rows}))
        expect(page.locator("#budget dt")).to_have_text([*names])

    page.click("[data-panel=energy]")
    stand_in.asked(lambda watch: watch["panel"] == "energy")
    told("hand", "damping", "put into store")
    told("hand", "damping, from 0 s", "damping, from 1.2 s", "put into store")


def ramp_from(start_s):
    """Two seconds in which a position rises evenly to 10 mm."""
    rows = [0.01 * i / 400 for i in range(401)]
    return snapshot(start_s, start_s + 2.0, table("position", start_s, 0.005, ("x", "m", "position", rows)))


def measured(stand_in, page):
    """Shows a ramp and measures between its quarters; returns the box of the chart."""
    stand_in.show(ramp_from(0.0))
    expect(page.locator("#position .legend")).to_contain_text("10.000")
    box = page.locator("#position .u-over").bounding_box()
    for part in (0.25, 0.75):
        page.mouse.click(box["x"] + box["width"] * part, box["y"] + 20)
    return box


@IN_BOTH
def test_two_clicks_measure_time_frequency_and_differences_and_a_third_ends_it(stand_in, page):
    box = measured(stand_in, page)
    expect(page.locator("#position .note")).to_have_text(re.compile(r"^Δ (0\.99|1\.00)\d* s, 1\.0\d Hz$"))
    expect(page.locator("#position .legend")).to_contain_text(re.compile(r"Δ (4\.9|5\.0)"))
    page.mouse.click(box["x"] + box["width"] * 0.5, box["y"] + 20)
    expect(page.locator("#position .note")).not_to_contain_text("Δ")


def test_what_was_measured_stays_when_its_marks_are_moved_out_of_sight(stand_in, page):
    measured(stand_in, page)
    expect(page.locator("#position .legend")).to_contain_text(re.compile(r"Δ (4\.9|5\.0)"))
    page.wait_for_timeout(300)  # texts come some times a second
    told = page.inner_text("#position .head")
    stand_in.show(ramp_from(3.0))
    stand_in.drawn()
    page.wait_for_timeout(200)
    assert page.inner_text("#position .head") == told


def test_where_a_pixel_covers_many_samples_a_range_is_read_and_at_last_one_sample_of_all(stand_in, page):
    ends = [(-0.0625, -0.0575)[i % 2] for i in range(2000)]
    many = table(
        "position", 0.0, 0.001, ("x", "m", "position", ends), ("wall", "m", "wall", [-0.06] * 2000), envelope=True
    )
    stand_in.show(snapshot(0.0, 2.0, {**many, "last": [-0.0612, -0.06]}))
    expect(page.locator("#position .legend output")).to_have_text(["−61.200", "−60.000"])
    box = page.locator("#position .u-over").bounding_box()
    page.mouse.move(box["x"] + box["width"] * 0.5, box["y"] + 20)
    expect(page.locator("#position .legend output")).to_have_text(["−62.5…−57.5", "−60.000"])
    for part in (0.25, 0.75):
        page.mouse.click(box["x"] + box["width"] * part, box["y"] + 20)
    expect(page.locator("#position .legend output")).to_have_text(["Δ −5.0…5.0", "Δ 0.000"])


def test_picture_and_numbers_are_saved_as_files(stand_in, page, tmp_path):
    stand_in.show(contact())
    expect(page.locator("#force .legend")).to_contain_text("total")
    with page.expect_download() as saving:
        page.click("#save-picture")
    picture = tmp_path / "picture.png"
    saving.value.save_as(picture)
    assert picture.read_bytes()[:4] == b"\x89PNG"
    assert picture.stat().st_size > 20_000, "charts are in it"
    source = base64.b64encode(picture.read_bytes()).decode()
    for name in ("wall", "element-0", "element-1"):
        assert page.evaluate(SAVED_HEAD, [source, page.evaluate(RGB, name)[:3]]), (
            f"{name} has its colour above the charts"
        )
    tone = page.evaluate(
        "getComputedStyle(document.querySelector('#verdict')).borderTopColor.match(/\\d+/g).map(Number)"
    )
    assert page.evaluate(SAVED_HEAD, [source, tone]), "the verdict is on it"
    with page.expect_download() as saving:
        page.click("#save-data")
    saving.value.save_as(tmp_path / "data.csv")
    lines = (tmp_path / "data.csv").read_text().splitlines()
    assert lines[0] == "table,place,quantity,unit,value"
    walls = [line for line in lines if line.startswith("position,") and ",wall," in line]
    assert len(walls) == 1000
    assert float(walls[0].rsplit(",", 1)[1]) == pytest.approx(-0.06)


def test_another_live_run_is_told_and_any_run_can_be_opened_or_drawn_over(stand_in, page):
    expect(page.locator("#runs")).to_be_hidden()
    stand_in.tell(RUNS)
    expect(page.locator("#how-many")).to_have_text("1 other run is live")
    names = ["none on show", "abc123: one", "def456: two", "wall-1: first wall, steady, 1 Jan 12:00"]
    expect(page.locator("#run option")).to_have_text(names)
    assert order(stand_in, page, lambda: page.click("#open-other")) == ("open", {"run": "def456"})
    assert page.input_value("#run") == "abc123"
    opened = order(stand_in, page, lambda: page.select_option("#run", "def456"))
    assert opened == ("open", {"run": "def456"})
    stand_in.tell({**RUNS, "shown": "fed987"})
    expect(page.locator("#run option").last).to_have_text("fed987: one, ended")
    assert page.input_value("#run") == "fed987", "what has ended is on show still"
    over = order(stand_in, page, lambda: page.select_option("#overlay", "wall-1"))
    assert over == ("overlay", {"run": "wall-1"})
    expect(page.locator("#behind")).to_be_hidden()
    stand_in.tell({**RUNS, "overlay": "wall-1"})
    expect(page.locator("#behind")).to_have_text("over: first wall: steady, 1 Jan 12:00")


def test_a_run_drawn_over_one_that_went_on_longer_says_that_it_had_ended_before_what_is_shown(stand_in, page):
    stand_in.tell({**RUNS, "overlay": "wall-1", "overlay_end_s": 2.0})
    for (begin, end), words in (
        ((15.0, 17.0), "It ended at 2 s, before what is shown"),
        ((0.0, 17.0), ""),
        ((1.5, 3.5), ""),
    ):
        stand_in.state(tick=round(1000 * end), end_tick=30_000)
        stand_in.show(contact(begin, end))
        expect(page.locator("#unseen")).to_contain_text(words) if words else expect(
            page.locator("#unseen")
        ).to_be_empty()


def test_runs_of_one_scene_are_told_apart_where_their_names_are_cut_off(stand_in, page):
    past = [{"id": f"demo-20261127-04575{i}", "title": "a long title", "told": "steady"} for i in (6, 9)]
    stand_in.tell({**RUNS, "past": past, "overlay": past[1]["id"]})
    expect(page.locator("#overlay option").nth(1)).to_have_text("…045756 demo: a long title, steady")
    expect(page.locator("#overlay")).to_have_attribute("title", "demo-20261127-045759: a long title, steady")
    room = "s => { const c = document.createElement('canvas').getContext('2d'); c.font = getComputedStyle(s).font;"
    room += " return s.clientWidth - 48 - c.measureText('…045759…').width; }"
    assert page.locator("#overlay").evaluate(room) > 0


def test_a_page_that_only_watches_cannot_choose_a_run_and_says_why(stand_in, open_page):
    stand_in.state()
    stand_in.tell(RUNS)
    choices = ("#run", "#overlay", "#open-other")
    for url, may in ((stand_in.origin, False), (stand_in.url, True)):
        page = open_page(url)
        expect(page.locator("#how-many")).to_have_text("1 other run is live")
        for choice in choices:
            expect(page.locator(choice)).to_be_enabled(enabled=may)
            assert ("Watching only" in page.get_attribute(choice, "title")) != may, choice


def test_a_page_without_a_run_offers_nothing_to_save_and_its_charts_take_the_room(stand_in, page):
    wide = page.locator("#position").bounding_box()["width"]
    stand_in.show(contact())
    expect(page.locator("#save-data")).to_be_visible()
    stand_in.tell(WAITING)
    expect(page.locator("#save-data")).to_be_hidden()
    expect(page.locator(".beside")).to_be_hidden()
    assert page.locator("#position").bounding_box()["width"] > wide + 200


@IN_BOTH
def test_dragging_the_strip_shows_another_part_of_the_run_and_its_end_is_live(stand_in, page):
    stand_in.state(tick=10_000, end_tick=20_000)
    stand_in.show(contact(8.0, 10.0))
    expect(page.locator("#scrub-ends")).to_have_text("0.0–10.0 s")
    box = page.locator("#scrub").bounding_box()
    page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    stand_in.asked(lambda watch: watch["end_s"] is not None)
    assert 480 <= int(page.input_value("#scrub")) <= 520, "the handle stays where it was put"
    page.fill("#scrub", "500")
    asked = stand_in.asked(lambda watch: watch["end_s"] is not None)
    assert (asked["span_s"], asked["end_s"]) == (pytest.approx(2.0), pytest.approx(5.0, abs=0.02))
    page.fill("#scrub", "1000")
    stand_in.asked(lambda watch: watch["end_s"] is None)


def test_a_slider_sets_when_it_is_let_go_and_shades_what_lies_beyond_the_limit(stand_in, page):
    stand_in.state(limit_N_m=300.0)
    slider = page.locator("input[aria-label='wall.stiffness, coarse']")
    expect(slider).to_have_attribute(
        "title", "Beyond 300 N/m the loop as it is now, without friction, quantisation and noise, is unstable."
    )
    told = page.locator("#set-fields p:has([id='set-wall.stiffness'])")
    expect(told).to_contain_text("shaded: above 300 N/m unstable if friction, quantisation and noise are left out")
    share = float(slider.evaluate("e => e.style.getPropertyValue('--safe')").rstrip("%"))
    assert share == pytest.approx(50 + 50 * 0.30103, abs=0.1), "log10 of 300 over 150"
    slider.focus()
    slider.evaluate("""slider => {
        for (let i = 0; i < 3; i++) {
            slider.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowRight" }));
            slider.stepUp();
            slider.dispatchEvent(new Event("input"));
            slider.dispatchEvent(new Event("change"));
        }
    }""")
    coarse = pytest.approx(150 * 10 ** (3 / 200), rel=0.01)
    stand_in.ordered(lambda command: command["arguments"]["set"]["wall.stiffness"] == coarse)
    assert len(stand_in.commands()) == 1, "three presses are one choice"
    page.keyboard.press("ArrowRight")
    finer = pytest.approx(150 * 10 ** (4 / 200), rel=0.01)
    stand_in.ordered(lambda command: command["arguments"]["set"]["wall.stiffness"] == finer)
    stand_in.state(no_limit="not linear, because of [jitter]")
    expect(told).to_contain_text("no limit is shaded: not linear, because of [jitter]")
    assert OPTIONS["settable"]["wall.position"]["value"] < 0
    expect(page.locator("input[aria-label='wall.position, coarse']")).to_be_hidden()


def test_the_change_panel_has_both_sides_and_says_what_is_not_held(stand_in, page):
    t = [i / 1000 for i in range(500)]
    side = {
        "sight": RUNNING["sight"],
        "budget": {"from_s": 0.0, "to_s": 0.5, "rows": [{"name": "hand", "window_J": -1e-3}]},
    }
    page.click("[data-panel=compare]")
    expect(page.locator("#compare")).to_contain_text("Swap an element or set a number")
    after = {**table("after", 2.0, 1e-3, ("x", "m", "", t), ("force", "N", "", t)), **side}
    stand_in.show(with_header(snapshot(0.0, 2.0, after), change={"tick": 2000, "t_s": 2.0}))
    expect(page.locator("#compare")).to_contain_text("no longer kept")
    before = {**table("before", 1.5, 1e-3, ("x", "m", "", t), ("force", "N", "", t)), **side}
    stand_in.show(with_header(snapshot(0.0, 2.0, before, after), change={"tick": 2000, "t_s": 2.0}))
    expect(page.locator("#compare")).not_to_contain_text("not held")
    row = page.locator("#compare tr:has-text('hand')")
    expect(row.locator("td")).to_have_text(["−2.00 mW", "−2.00 mW"])


def test_a_choice_stands_at_what_it_is_and_has_no_slider(stand_in, page):
    """Not at the first that there is, which would be set with the next number."""
    free = dict.fromkeys(("at_least", "above", "at_most", "below"))
    on = {**free, "unit": "", "choices": [False, True], "default": True}
    kinds = {"mine": {"about": "", "parameters": {"on": on}}}
    stiffness = OPTIONS["settable"]["wall.stiffness"]
    settable = {"wall.stiffness": stiffness, "dissipation.0.on": {**on, "value": True}}
    stand_in.state(options={"settable": settable, "kinds": kinds, "elements": [{"kind": "mine", "acts": "always"}]})
    expect(page.locator("[id='set-dissipation.0.on']")).to_have_value("true")
    expect(page.locator("#swap-on")).to_have_value("true")
    expect(page.locator("#set-do")).to_be_disabled()
    expect(page.locator("#set input[type=range]")).to_have_count(1)


def test_the_axis_of_a_spectrum_is_in_the_unit_of_its_title_and_begins_at_zero(stand_in, page):
    def axes():
        return page.evaluate("""() => [...document.querySelectorAll('#spectrum canvas')].map(canvas => {
            const ratio = canvas.width / canvas.clientWidth;
            return canvas.getContext("2d").getImageData(0, 0, 18 * ratio, canvas.height).data.join();
        })""")

    def show(width_m, told):
        heights = [width_m / 2 if i == 30 else 0.0 for i in range(500)]
        spectrum = table("spectrum", 1.0, 1.0, ("x", "m", "position", heights), ("force", "N", "force", heights))
        line = {"frequency_Hz": 31.0, "width": width_m}
        lines = {"x": line, "force": line, "from_s": 0.0, "to_s": 2.0}
        stand_in.show(with_header(snapshot(0.0, 2.0, spectrum), lines=lines))
        expect(page.locator("#spectrum .line-name").first).to_contain_text(told)
        stand_in.drawn()
        return axes()

    page.click("[data-panel=spectrum]")
    small = show(3e-4, "300 µm")
    assert show(9e-4, "900 µm") == small
    large = show(4e-3, "4.00 mm")
    assert large[0] != small[0], "now it is mm"
