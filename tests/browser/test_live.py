"""The page on a real run: what is done on it takes effect in the loop, is marked, and stands in the log."""

import json
import re
import signal
from collections.abc import Callable

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from helpers.live.browser import IN_BOTH, free_port
from helpers.live.launched import Launched, Run
from helpers.live.waiting import wait_for

pytest.importorskip("aiohttp", reason="the live page needs aiohttp: pip install 'haploop[view]'")
LINK = re.compile(r"http://127\.0\.0\.1:\d+/#token=\S+")
# The tip is pressed into the wall from the first tenth of a second on.
AT_THE_WALL = ("duration=600", "wall.position=-0.001")
STANDS_AT_1000 = (*AT_THE_WALL, "event=[{at=1.0, pause=true}]")


@pytest.fixture
def viewing(launched: Callable[..., Launched], open_page: Callable[..., Page]) -> Callable[..., tuple[Launched, Page]]:
    """``haploop view`` with some arguments, and its page as the link opens it."""

    def view(*arguments: str) -> tuple[Launched, Page]:
        viewer = launched("view", "--no-browser", *arguments)
        return viewer, open_page(link(viewer))

    return view


def link(viewer: Launched) -> str:
    """The link that a viewer printed."""
    return wait_for("the link", lambda: LINK.search(viewer.stderr))[0]


def tick(page: Page) -> int:
    """The tick the page is at."""
    found = re.match(r"tick (\d+) of", page.get_attribute("#time", "title") or "")
    return int(found[1]) if found else -1


def stands_at(page: Page, number: int) -> None:
    """Wait until the page shows the run standing still at a tick."""
    expect(page.locator("#phase")).to_have_text("paused")
    expect(page.locator("#time")).to_have_attribute("title", re.compile(f"^tick {number} of"))


def events(run: Run) -> list[dict]:
    """What the log says changed the run, without the times."""
    return [{k: v for k, v in e.items() if k not in ("at", "timestamp")} for e in run.log()["/events"]]


@IN_BOTH
@pytest.mark.slow
def test_a_swap_in_mid_contact_takes_effect_at_its_tick_is_marked_and_stands_in_the_log(running, viewing):
    run = running(sets=STANDS_AT_1000)
    _, page = viewing()
    stands_at(page, 1000)
    page.select_option("#swap-kind", "damping")
    page.fill("#swap-damping", "0.8")
    page.click("#swap-do")
    said = "element 0 becomes damping at tick 1000 (1 s)"
    expect(page.locator("#said")).to_have_text(said)  # there is a button to go back
    page.keyboard.press("Escape")
    page.click("[data-step='100']")
    stands_at(page, 1100)
    expect(page.locator("#events")).to_contain_text("tick 1000 element 0 becomes damping (damping 0.8 N s/m)")
    expect(page.locator("#force .legend")).to_contain_text("0: damping")
    expect(page.locator("[id='set-dissipation.0.damping']")).to_have_value("0.8")
    run.ask("stop")
    summary = run.summary()
    contact = run.log()["/controller"]["in_contact"]
    assert contact[999] == contact[1000] == 1.0, "in mid-contact"
    books = [(e["kind"], e["from_tick"], e["to_tick"]) for e in summary["energy"]["elements"]]
    assert books == [("unidirectional-inertia", 0, 1000), ("damping", 1000, 1100)]


@pytest.mark.slow
def test_a_refused_value_is_told_with_the_reason_and_nothing_has_changed(running, viewing):
    run = running(sets=STANDS_AT_1000)
    _, page = viewing()
    stands_at(page, 1000)
    page.select_option("#swap-kind", "damping")
    page.fill("#swap-damping", "-0.8 N s/m")
    page.click("#swap-do")
    expect(page.locator("#swap-damping-problem")).to_contain_text("at least 0")
    page.fill("[id='set-clock.round_trip_delay']", "0.25")
    page.fill("[id='set-wall.stiffness']", "200")
    page.click("#set-do")
    expect(page.locator("[id='set-clock.round_trip_delay-problem']")).to_contain_text("0.0002 s")
    options = run.ask("options")
    assert [element["kind"] for element in options["elements"]] == ["unidirectional-inertia"]
    assert options["settable"]["wall.stiffness"]["value"] == 150.0, "not even the good half of it"
    run.ask("stop")
    run.end(0)
    assert [event for event in events(run) if "swap" in event or "set" in event] == []


@IN_BOTH
@pytest.mark.slow
def test_pause_steps_set_and_pace_reach_the_run(running, viewing):
    run = running(sets=AT_THE_WALL, pace=("--pace", "1"))
    _, page = viewing()
    expect(page.locator("#phase")).to_have_text("running")
    expect(page.locator("[name=pace][value='1']")).to_be_checked()
    page.keyboard.press(" ")
    expect(page.locator("#phase")).to_have_text("paused")
    paused = run.stands()
    stands_at(page, paused)
    page.keyboard.press(".")
    stands_at(page, paused + 1)
    page.keyboard.press("2")
    stands_at(page, paused + 11)
    page.fill("[id='set-wall.stiffness']", "0.12 N/mm")
    page.fill("[id='set-clock.round_trip_delay']", "1.5")
    page.keyboard.press("Enter")
    expect(page.locator("[id='set-wall.stiffness']")).to_have_value("120")
    page.click("label:has([name=pace][value='free'])")
    expect(page.locator("[name=pace][value='free']")).to_be_checked()
    page.click("#stop")
    page.get_by_role("button", name="End the run").click()
    expect(page.locator("#phase")).to_have_text("ended")
    run.summary()
    assert events(run) == [
        {"tick": paused, "pause": True},
        {"tick": paused, "step": 1},
        {"tick": paused + 1, "step": 10},
        {"tick": paused + 11, "set": {"wall.stiffness": 120.0, "clock.round_trip_delay": 0.0015}},
        {"tick": paused + 11, "pace": "free"},
        {"tick": paused + 11, "stop": True},
    ]


@pytest.mark.slow
def test_what_the_page_draws_are_the_numbers_of_the_log(running, viewing):
    """Position, forces and loop of the last 0.1 s, as 32-bit floats, sample by sample."""
    run = running(sets=STANDS_AT_1000)
    _, page = viewing()
    stands_at(page, 1000)
    shown = page.evaluate(
        """async () => {
            const { decode } = await import("/static/snapshot.js");
            const socket = new WebSocket(`ws://${location.host}/stream`);
            socket.binaryType = "arraybuffer";
            socket.onopen = () => socket.send(JSON.stringify({ type: "watch", span_s: 0.1, points: 2000, end_s: 1.0 }));
            const snapshot = await new Promise(found => socket.onmessage = ({ data }) => {
                const snapshot = typeof data === "string" ? null : decode(data);
                if (snapshot) socket.send(JSON.stringify({ type: "drawn", snapshots: 1 }));
                // What was logged before the viewer joined comes a moment later than what it hears itself.
                const filled = snapshot && ["position", "force", "loop"].every(
                    name => snapshot.tables[name]?.columns.every(({ values }) => !values.some(Number.isNaN)));
                if (filled && snapshot.from_s === 0.9 && snapshot.to_s === 1.0) found(snapshot);
            });
            socket.close();
            const { position, force, loop } = snapshot.tables;
            const plain = table => Object.fromEntries(table.columns.map(({ name, values }) => [name, [...values]]));
            return { dt_s: position.dt_s, t0_s: position.t0_s, envelope: position.envelope, stiffness: loop.stiffness,
                     position: plain(position), force: plain(force) };
        }"""
    )
    run.ask("stop")
    run.end(0)
    plant, controller = run.log()["/plant"], run.log()["/controller"]
    assert (shown["envelope"], shown["t0_s"], shown["stiffness"]) == (False, 0.9, 150.0)
    assert shown["dt_s"] == pytest.approx(1e-4)
    x = np.array(shown["position"]["x"], dtype=np.float32)
    assert len(x) == 1000
    assert np.array_equal(x, plant["x"][9000:10000].astype(np.float32))
    total = np.array(shown["force"]["total"], dtype=np.float32)
    rows = len(total) // 100
    assert np.array_equal(total[::rows], controller["total"][900:1000].astype(np.float32))


@pytest.mark.slow
def test_after_the_end_the_page_shows_what_came_of_the_run_and_then_the_next_run(running, viewing):
    first = running(sets=("duration=1", "event=[{at=0.5, pause=true}]"))
    _, page = viewing()
    stands_at(page, 500)
    first.ask("resume")
    expect(page.locator("#phase")).to_have_text("ended")
    expect(page.locator("#summary")).to_contain_text("Ended: too short")
    expect(page.locator("#verdict span")).to_have_text("too short")
    expect(page.locator("#summary")).to_contain_text(str(first.out))
    expect(page.locator("#pause")).to_be_disabled()
    running(sets=(*STANDS_AT_1000, 'title="the next one"'))
    expect(page.locator("#title")).to_have_text("the next one")
    stands_at(page, 1000)
    expect(page.locator("#pause")).to_be_enabled()


@pytest.mark.slow
def test_a_viewer_started_anew_on_its_port_is_found_again_but_its_old_link_steers_no_more(running, viewing, launched):
    run, port = running(sets=STANDS_AT_1000), str(free_port())
    viewer, page = viewing("--port", port)
    stands_at(page, 1000)
    viewer.signal(signal.SIGINT)
    viewer.end(0)
    expect(page.locator("#phase")).to_have_text("not connected")
    second = launched("view", "--no-browser", "--port", port)
    again = link(second)
    stands_at(page, 1000)
    page.keyboard.press(".")
    expect(page.locator("#said")).to_contain_text("Refused")
    assert run.ask("status")["granted"] == 1000
    page.goto(again)
    stands_at(page, 1000)
    page.keyboard.press(".")
    stands_at(page, 1001)


@pytest.mark.slow
def test_before_the_first_run_it_waits_and_takes_up_the_run_when_it_comes(running, viewing):
    _, page = viewing()
    expect(page.locator("#waiting")).to_be_visible()
    running(sets=STANDS_AT_1000)
    stands_at(page, 1000)
    expect(page.locator("#waiting")).to_be_hidden()


@pytest.mark.slow
def test_the_loop_computes_the_same_bits_whatever_is_watched_and_however(running, viewing):
    sets = ("duration=2", "wall.position=-0.001")
    alone = running(sets=sets, pace=())
    digest = alone.summary()["trajectory_sha256"]
    watched = running(sets=(*sets, "event=[{at=0.5, pause=true}]"), pace=("--pace", "2"))
    _, page = viewing()
    stands_at(page, 500)
    for key in ("]", "[", "f", "f", "]"):
        page.keyboard.press(key)
    page.keyboard.press(" ")
    expect(page.locator("#phase")).to_have_text("ended")
    assert watched.summary()["trajectory_sha256"] == digest
    assert json.loads((watched.out_directory / "summary.json").read_text())["ended"] == "done"
