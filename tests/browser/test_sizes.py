"""The page on a desk and on a phone, in light and dark: everything is there, nothing is covered or cut off."""

import pytest
from playwright.sync_api import expect

from helpers.live.browser import DESK, IN_BOTH, PHONE, still
from helpers.live.stand_in import ENDED, RUNNING, RUNS, SUMMARY
from helpers.live.waiting import wait_for
from helpers.slowly import first_and_slowly
from oracles.snapshots import contact, snapshot, table

TABLET, LARGE = {"width": 820, "height": 1180}, {"width": 1920, "height": 1080}
MAIN = ["#verdict", "#position", "#force", "#energy", "#pause", "[data-step='100']", "#stop", "#freeze", "#help"]
# Elements of the header and controls whose boxes overlap although neither holds the other.
OVERLAPS = """() => {
    const those = "h1, #phase, #verdict, .figures div, nav button, nav label, .chart, .panel";
    const all = [...document.querySelectorAll(those)]
        .filter(e => e.offsetParent && e.getClientRects().length);
    const box = new Map(all.map(e => [e, e.getBoundingClientRect()]));
    const name = e => e.id || e.textContent.trim().slice(0, 20);
    const found = [];
    for (const a of all) for (const b of all) {
        if (a === b || a.contains(b) || b.contains(a)) continue;
        const p = box.get(a), q = box.get(b);
        const wide = Math.min(p.right, q.right) - Math.max(p.left, q.left);
        const high = Math.min(p.bottom, q.bottom) - Math.max(p.top, q.top);
        if (wide > 2 && high > 2) found.push(`${name(a)} | ${name(b)}`);
    }
    return found;
}"""
# Texts that do not fit into their box and are cut off without a sign of it.
CUT = """() => [...document.querySelectorAll("button, dd, dt, .unit, td, th, #verdict span, .word")]
    .filter(e => e.offsetParent && e.scrollWidth > e.clientWidth + 1 && e.clientWidth > 0)
    .map(e => e.textContent.trim())"""
SIDEWAYS = "document.documentElement.scrollWidth - document.documentElement.clientWidth"
# Text that is hard to read: less contrast with its background than 4.5 (WCAG 2.1, 1.4.3), or smaller than 12 px.
FAINT = """() => {
    const rgb = text => text.match(/[\\d.]+/g).map(Number);
    const light = ([r, g, b]) => [r, g, b].map(v => v / 255)
        .map(v => v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)
        .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
    const behind = e => {
        for (let at = e; at; at = at.parentElement) {
            const colour = rgb(getComputedStyle(at).backgroundColor);
            if (colour.length < 4 || colour[3] > 0.9) return colour;
        }
        return [255, 255, 255];
    };
    const texts = [...document.querySelectorAll("body *")].filter(e => e.offsetParent
        && !e.closest("svg, :disabled, .uplot")
        && [...e.childNodes].some(n => n.nodeType === 3 && n.textContent.trim()));
    return texts.map(e => {
        const style = getComputedStyle(e);
        const [a, b] = [light(rgb(style.color)), light(behind(e))].sort((x, y) => y - x);
        const contrast = (a + 0.05) / (b + 0.05);
        return contrast < 4.5 || parseFloat(style.fontSize) < 12
            ? `${e.textContent.trim().slice(0, 30)}: ${contrast.toFixed(2)}, ${style.fontSize}` : "";
    }).filter(Boolean);
}"""
EVENTS = [
    {"tick": 400 + 3 * i, "t_s": 0.4 + 0.003 * i, "text": f"wall.stiffness = {150 + i} N/m", "kind": "set"}
    for i in range(12)
]
# The longest numbers of a header: a slow run at a wall far too stiff.
EXTREME = {
    "pace": 0.1, "real_time_factor": 0.0987, "displayed_stiffness_N_m": -5.2e5, "residual_J": 1.2e-16,
    "wall": {"position": -0.06, "stiffness": 1e6, "into_wall": -1.0}, "tick": 123_456, "end_tick": 600_000,
    "sight": {**RUNNING["sight"], "word": "not finite", "oscillation_m": 0.98765, "ripple_N": 23_456.0,
              "force_swing_N": 23_456.0, "frequency_Hz": 4987.6},
}  # fmt: skip


@pytest.fixture(params=first_and_slowly("dark", "light"))
def scheme(request):
    return request.param


def shown(stand_in, open_page, viewport, scheme, **options):
    stand_in.state()
    stand_in.tell({"type": "events", "events": EVENTS}, RUNS)
    stand_in.show(contact())
    page = open_page(stand_in.url, viewport=viewport, color_scheme=scheme, **options)
    stand_in.drawn()
    expect(page.locator("#verdict span")).to_have_text(RUNNING["sight"]["word"])
    expect(page.locator("#force .legend")).to_contain_text("total")
    still(page)
    return page


def test_on_a_desk_the_answer_the_charts_and_the_controls_are_there_without_scrolling(stand_in, open_page, scheme):
    page = shown(stand_in, open_page, DESK, scheme)
    height, width = page.evaluate("[document.documentElement.scrollHeight, document.documentElement.scrollWidth]")
    assert (height, width) == (DESK["height"], DESK["width"])
    for selector in MAIN:
        box = page.locator(selector).bounding_box()
        assert box["y"] >= 0, selector
        assert box["y"] + box["height"] <= DESK["height"], selector
    for chart in ("position", "force", "energy"):
        assert page.locator(f"#{chart} .u-over").bounding_box()["height"] > 80, chart
    for loop in ("loop", "momentum"):
        box = page.locator(f"#{loop} .u-over").bounding_box()
        assert 0.5 < box["width"] / box["height"] < 2, loop


@IN_BOTH
@pytest.mark.parametrize("viewport", first_and_slowly(DESK, PHONE, TABLET, LARGE))
def test_nothing_covers_anything_and_no_text_is_cut_off(viewport, stand_in, open_page):
    page = shown(stand_in, open_page, viewport, "dark")
    page.evaluate(
        "document.querySelector('nav > *').style.position = 'static'"
    )  # it floats over the phone's lower edge
    assert page.evaluate(OVERLAPS) == []
    assert page.evaluate(CUT) == []
    assert page.evaluate(SIDEWAYS) == 0, "no scrolling sideways"
    stand_in.state(**EXTREME)
    expect(page.locator("#factor")).to_have_text("99 % of 0.1×")
    assert page.locator("#stiffness").inner_text() in ("", "−0.52 of 1.00 MN/m")
    assert page.evaluate(OVERLAPS) == []
    assert page.evaluate(CUT) == []
    stand_in.state(**ENDED)
    expect(page.locator("#phase")).to_have_text("ended")
    assert page.evaluate(CUT) == []
    assert page.evaluate(SIDEWAYS) == 0, "nor after the end"


@pytest.mark.slow
def test_a_box_that_covers_another_would_be_found(stand_in, open_page):
    page = shown(stand_in, open_page, DESK, "light")
    page.evaluate("document.querySelector('#verdict').style.marginLeft = '-300px'")
    assert page.evaluate(OVERLAPS) != []
    page.evaluate("document.querySelector('#pause').style.width = '10px'")
    page.evaluate("document.querySelector('#pause').style.minWidth = '0'")
    assert "Pause" in page.evaluate(CUT)


@pytest.mark.slow
@pytest.mark.parametrize("viewport", [DESK, PHONE])
def test_all_text_is_large_enough_and_stands_out(viewport, stand_in, open_page, scheme):
    page = shown(stand_in, open_page, viewport, scheme)
    assert page.evaluate(FAINT) == []


@pytest.mark.slow
def test_the_charts_of_time_have_one_time_axis_in_common(stand_in, open_page):
    page = shown(stand_in, open_page, DESK, "light")
    boxes = [page.locator(f"#{chart} .u-over").bounding_box() for chart in ("position", "force", "energy")]
    assert len({(box["x"], box["width"]) for box in boxes}) == 1


@pytest.mark.slow
def test_on_a_phone_fingers_find_their_targets(stand_in, open_page):
    page = shown(stand_in, open_page, PHONE, "light", has_touch=True, is_mobile=True)
    for selector in ("#pause", "[data-step='1']", "#stop", "#freeze", "#swap-do", "#swap-damping"):
        assert page.locator(selector).bounding_box()["height"] >= 40, selector


@pytest.mark.slow
def test_on_a_phone_one_row_of_controls_floats_runs_have_a_row_and_every_chart_its_times(stand_in, open_page):
    page = shown(stand_in, open_page, PHONE, "light", has_touch=True, is_mobile=True)
    page.evaluate("scrollTo(0, 1000)")
    floating = [box for row in page.locator("nav > *").all() if (box := row.bounding_box()) and box["y"] > 0]
    assert len(floating) == 1
    assert floating[0]["height"] < 60
    for picker in ("#swap-element", "#swap-kind"):
        assert page.locator(picker).bounding_box()["width"] > 300, picker
    run, over = (page.locator(picker).bounding_box() for picker in ("#run", "#overlay"))
    assert run["y"] == over["y"]
    assert run["width"] + over["width"] > 290
    for chart in ("position", "force", "energy"):
        plot, over = (page.locator(f"#{chart} {part}").bounding_box() for part in (".plot", ".u-over"))
        assert plot["y"] + plot["height"] - over["y"] - over["height"] > 30, chart
    for word in page.locator("nav .joined > .word").all():
        expect(word).to_be_visible()
    assert page.locator("#position").bounding_box()["y"] + page.evaluate("scrollY") < PHONE["height"] / 2
    stand_in.state(**ENDED)
    expect(page.locator("#to-forms")).to_be_hidden()


@pytest.mark.slow
def test_on_a_phone_a_title_is_read_whole_and_a_verdict_with_a_proviso_keeps_its_sign_beside_its_word(
    stand_in, open_page
):
    page = shown(stand_in, open_page, PHONE, "dark")
    assert page.evaluate("(title => title.scrollHeight <= title.clientHeight)(document.querySelector('h1'))")
    judged = {
        **SUMMARY,
        "verdict": "steady",
        "stability": {"provisos": ["by friction alone", "while the hand holds on"]},
    }
    rests = RUNNING["sight"] | {"word": "no swing seen"}
    stand_in.state(**ENDED | {"verdict": "steady", "summary": judged, "sight": rests})
    expect(page.locator("#seen")).to_have_text("by friction alone, while the hand holds on")
    sign, word = (page.locator(f"#verdict {part}").bounding_box() for part in ("svg", "span"))
    assert 0 < word["x"] - sign["x"] - sign["width"] < 12


@pytest.mark.slow
@pytest.mark.parametrize("viewport", [DESK, PHONE])
def test_another_pace_or_span_of_time_moves_nothing(viewport, stand_in, open_page):
    page = shown(stand_in, open_page, viewport, "light")
    places = """[...document.querySelectorAll('nav *')].map(e => {
        const b = e.getBoundingClientRect();
        return [b.x, b.width];
    })"""
    before = page.evaluate(places)
    for pace in (0.1, "free"):
        stand_in.state(pace=pace)
        expect(page.locator(f"[name='pace'][value='{pace}']")).to_be_checked()
        assert page.evaluate(places) == before
    for span in ("0.2", "10", "all"):
        page.locator(f"label:has([name='span'][value='{span}'])").click()
        expect(page.locator(f"[name='span'][value='{span}']")).to_be_checked()
        assert page.evaluate(places) == before


@pytest.mark.slow
def test_the_page_stays_where_it_is_while_numbers_change(stand_in, open_page):
    page = shown(stand_in, open_page, DESK, "light")
    those = ".figures div, .chart, nav > *, #verdict"
    places = f"[...document.querySelectorAll('{those}')].map(e => e.getBoundingClientRect().x)"
    before = page.evaluate(places)
    stand_in.state(
        sight={**RUNNING["sight"], "word": "no swing seen", "oscillation_m": 1.2345e-9},
        residual_J=None,
        real_time_factor=12.3,
        skipped_ticks=0,
    )
    expect(page.locator("#verdict span")).to_have_text("no swing seen")
    assert page.evaluate(places) == before


@pytest.mark.slow
def test_light_and_dark_change_places_while_the_page_is_open(stand_in, open_page):
    page = shown(stand_in, open_page, DESK, "light")
    brightness = """() => {
        const canvas = document.querySelector("#force canvas");
        const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
        let dark = 0, light = 0;
        for (let i = 0; i < data.length; i += 4) {
            if (data[i + 3] > 200) data[i] + data[i + 1] + data[i + 2] < 380 ? dark++ : light++;
        }
        return dark > light ? "dark lines" : "light lines";
    }"""
    assert page.evaluate(brightness) == "dark lines"
    page.emulate_media(color_scheme="dark")
    wait_for("light lines", lambda: page.evaluate(brightness) == "light lines")


@pytest.mark.slow
def test_every_control_has_a_name(stand_in, open_page):
    page = shown(stand_in, open_page, DESK, "light")
    nameless = page.evaluate(
        """() => [...document.querySelectorAll("button, input, select")].filter(e => !e.closest("dialog"))
            .filter(e => !(e.getAttribute("aria-label") || e.labels?.[0]?.textContent.trim() || e.textContent.trim()))
            .map(e => e.outerHTML)"""
    )
    assert nameless == []


@pytest.mark.slow
def test_on_a_phone_what_steers_is_in_sight_wherever_one_reads_and_the_swap_one_tap_away(stand_in, open_page):
    page = shown(stand_in, open_page, PHONE, "light", has_touch=True, is_mobile=True)
    for down in (0, 1000, 100_000):
        page.evaluate("down => scrollTo(0, down)", down)
        expect(page.locator("#pause")).to_be_in_viewport(ratio=1)
    page.evaluate("scrollTo(0, 0)")
    for selector in ("#stop", "[data-step='100']", "[name=pace] + span", "[name=span] + span", "#freeze", "#run"):
        for control in page.locator(selector).all():
            expect(control).to_be_in_viewport(ratio=1)
    page.tap("#to-forms")
    expect(page.locator("#swap-do")).to_be_in_viewport()
    expect(page.locator("#said")).not_to_be_in_viewport()
    stand_in.answer = lambda command: (True, "element 0 becomes damping")
    page.tap("#swap-do")
    expect(page.locator("#said")).to_have_text("element 0 becomes damping")
    expect(page.locator("#said")).to_be_in_viewport(ratio=1)
    expect(page.locator("#pause")).to_be_in_viewport(ratio=1)
    assert "token" in page.url


@pytest.mark.slow
def test_on_a_phone_the_numbers_of_a_swing_stand_in_one_row(stand_in, open_page):
    page = shown(stand_in, open_page, PHONE, "dark")
    stand_in.state(
        tick=118_887, end_tick=600_000, sight=RUNNING["sight"] | {"frequency_Hz": 30.2, "force_swing_N": 3.56}
    )
    expect(page.locator("#time")).to_have_text("118.887 of 600 s")
    heights = (
        """() => [...document.querySelectorAll(".figures div")].filter(e => e.offsetParent).map(e => e.offsetTop)"""
    )
    assert len(set(page.evaluate(heights))) == 1
    page.evaluate("document.querySelector('.figures .spare').style.display = 'inline'")
    assert len(set(page.evaluate(heights))) == 2, "of the desk's name they would not"


# Every picture is drawn as if the page waited for a run, when charts have two columns, and shown as it was before.
DRAWN_IN_ANOTHER_LAYOUT = """() => {
    const ask = requestAnimationFrame;
    window.requestAnimationFrame = act => ask(time => {
        const before = document.body.dataset.phase;
        document.body.dataset.phase = "waiting";
        window.wideWhileDrawn = document.querySelector("#position .plot").clientWidth;
        act(time);
        document.body.dataset.phase = before;
    });
}"""
# Left and right end of the card of each plot in sight, and of the plot.
ENDS = """selector => [...document.querySelectorAll(selector)].filter(over => over.getClientRects().length)
    .map(over => [over.closest(".chart"), over].map(e => e.getBoundingClientRect()))
    .map(boxes => boxes.map(({left, right}) => [left, right]))"""


@pytest.mark.slow
@pytest.mark.parametrize("panel", ["loops", "spectrum", "own"])
def test_a_chart_made_in_another_layout_than_it_is_shown_in_ends_where_its_card_does(panel, stand_in, open_page):
    own = [table(f"own.{unit}", 0.0, 0.002, (f"0.{unit}", unit, unit, [1e-3] * 1000)) for unit in ("J", "N s/m")]
    stand_in.state(own=True)
    stand_in.show(contact())
    page = open_page(stand_in.url, viewport=DESK)
    expect(page.locator("#force .legend")).to_contain_text("total")
    page.click(f"[data-panel={panel}]")
    still(page)
    page.evaluate(DRAWN_IN_ANOTHER_LAYOUT)
    t = [i / 1000 for i in range(2000)]
    others = [
        table(name, 0.0, 1e-3, ("other", unit, "other", t))
        for name, unit in (("position", "m"), ("force", "N"), ("energy", "J"))
    ]
    stand_in.show(snapshot(0.0, 2.0, *others, *own))
    stand_in.drawn()
    expect(page.locator("#energy .legend")).to_contain_text("other")
    still(page)
    assert page.evaluate("wideWhileDrawn - document.querySelector('#position .plot').clientWidth") > 200
    found = page.evaluate(ENDS, ".charts .u-over")
    assert len(found) == 3
    assert len({tuple(over) for _, over in found}) == 1, "one time axis"
    for card, over in [*found, *page.evaluate(ENDS, ".beside .u-over")]:
        assert card[1] - 40 < over[1] < card[1]


@pytest.mark.parametrize("width", [900, 1280])
def test_a_long_message_is_seen_whole_on_a_desk(stand_in, open_page, width):
    """The line of the plugin that failed was cut off, the last words of the longest messages."""
    stand_in.tell(RUNS | {"missed": 'Run a42e28, "a loop", ended before its first tick; its terminal says why.'})
    stand_in.state(
        phase="failed", options=None,
        why="The controller failed: Element 0 (my-pc) gave no force at tick 2995: RuntimeError: my own fault at tick "
        "1500 (mypc.py, line 24).",
    )  # fmt: skip
    page = open_page(stand_in.url, viewport={"width": width, "height": 800})
    expect(page.locator("#notice")).to_contain_text("line 24")
    box = page.locator(".messages").bounding_box()
    notice = page.locator("#notice").bounding_box()
    assert box["y"] <= notice["y"]
    assert notice["y"] + notice["height"] <= box["y"] + box["height"] + 1
