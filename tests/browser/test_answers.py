"""Answers of the page at once: verdict, state and numbers, with and without a run, with and without a server."""

import re

import pytest
from playwright.sync_api import expect

from helpers.live.browser import still
from helpers.live.stand_in import ENDED, RUNNING, RUNS, SUMMARY, WAITING
from oracles.snapshots import contact, snapshot


@pytest.mark.slow
def test_without_a_run_it_says_how_to_start_one_and_offers_nothing_that_steers(stand_in, open_page):
    stand_in.tell(WAITING)
    page = open_page(stand_in.url)
    expect(page.locator("#waiting")).to_contain_text("haploop run SCENE")
    expect(page.locator("#phase")).to_have_text("waiting")
    expect(page.locator("#notice")).to_have_text("")  # the middle of the page says it
    expect(page.locator("#pause")).to_be_disabled()
    expect(page.locator("#swap")).to_be_hidden()
    expect(page.locator("#verdict span")).to_have_text("no verdict")
    assert "NaN" not in page.inner_text("body")
    assert "null" not in page.inner_text("body")


def test_a_run_that_never_began_is_told_and_before_the_first_tick_no_loop_is_denied(stand_in, open_page):
    stand_in.tell(WAITING | {"why": "Run ab ended before its first tick."})
    page = open_page(stand_in.url)
    expect(page.locator("#notice")).to_have_text("Run ab ended before its first tick.")
    for hidden in (".beside", "#scrub"):
        expect(page.locator(hidden)).to_be_hidden()
    stand_in.state(tick=0)
    stand_in.show(snapshot(0.0, 2.0))
    expect(page.locator("#no-ticks")).to_be_visible()
    assert page.locator("#loop").evaluate("e => getComputedStyle(e).visibility") == "hidden"
    stand_in.show(contact())
    expect(page.locator("#no-ticks")).to_be_hidden()
    assert page.locator("#energy .plot").evaluate("e => getComputedStyle(e).visibility") == "visible"


@pytest.mark.slow
def test_a_run_that_is_over_offers_nothing_live_and_says_whether_the_next_one_comes(stand_in, page):
    page.click("#freeze")
    expect(page.locator("#freeze")).to_have_text("Go live")
    stand_in.state(**ENDED)
    expect(page.locator("#freeze")).to_have_text("To its end")
    expect(page.locator("#notice")).to_have_text("The run has ended. A run that is started now will appear here.")
    stand_in.tell(RUNS | {"stays": True})
    expect(page.locator("#notice")).to_have_text("The run has ended.")
    stand_in.tell(RUNS | {"missed": "Run ab ended before its first tick."})
    told = "The run has ended. A run that is started now will appear here. Run ab ended before its first tick."
    expect(page.locator("#notice")).to_have_text(told)


@pytest.mark.slow
def test_a_verdict_is_a_word_a_shape_of_its_own_and_a_colour(stand_in, open_page):
    page = open_page(stand_in.url)
    grounds = set()
    words = ("steady", "limit-cycle", "growing", "diverged", "no-contact", "undecided")
    for word in words:
        stand_in.state(**ENDED | {"verdict": word, "sight": RUNNING["sight"] | {"word": "no swing seen"}})
        expect(page.locator("#verdict span")).to_have_text(word)
        assert page.get_attribute("#verdict use", "href") == f"#verdict-{word}"
        still(page)
        grounds.add(style(page, "backgroundColor"))
    assert len(grounds) == len(words)
    shapes = page.evaluate("[...document.querySelectorAll('.shapes symbol')].map(s => s.innerHTML)")
    assert len(set(shapes)) == len(shapes)
    assert style(page, "color") == "rgb(255, 255, 255)"


@pytest.mark.slow
@pytest.mark.parametrize("cause", ["Likely cause: friction. Started anew on the wall, the loop rests without it.", ""])
def test_a_run_that_ended_tells_its_cause_where_one_was_found(stand_in, open_page, cause):
    page = open_page(stand_in.url)
    stand_in.state(**ENDED | {"verdict": "limit-cycle", "cause": cause})
    expect(page.locator("#cause")).to_have_text(cause)
    expect(page.locator("#cause")).to_be_visible(visible=bool(cause))


def style(page, name):
    return page.evaluate("name => getComputedStyle(document.querySelector('#verdict'))[name]", name)


@pytest.mark.slow
def test_what_the_window_sees_is_an_outline_and_says_that_nothing_is_known_of_stability(stand_in, open_page):
    page = open_page(stand_in.url)
    sight = RUNNING["sight"]
    for word in ("no swing seen", "swinging", "moving", "no contact", "force ripples"):
        stand_in.state(verdict="steady", sight=sight | {"word": word})
        expect(page.locator("#verdict span")).to_have_text(word)
        expect(page.locator("#seen")).to_have_text("in 1.00–1.50 s")
        assert style(page, "borderTopStyle") == "dashed"
        still(page)
        assert style(page, "backgroundColor") == "rgba(0, 0, 0, 0)"
    for word, told in (("swinging", "in 1.00–1.50 s, while its hand moves"), ("no swing seen", "in 1.00–1.50 s")):
        stand_in.state(sight=sight | {"word": word}, hand_moves=True)
        expect(page.locator("#seen")).to_have_text(told)
    stand_in.state(sight=sight | {"word": "settling", "from_s": 1.2, "so_far": True})
    expect(page.locator("#verdict span")).to_have_text("settling")
    expect(page.locator("#seen")).to_have_text("so far: 0.30 of 0.5 s")
    by_window = {key: value for key, value in SUMMARY.items() if key != "stability"}
    unseen = dict.fromkeys(("abandoned", "foreign", "seen"), "no swing seen")
    for verdict_is, told in {"awaited": "being judged", **unseen}.items():
        ended = {"summary": by_window, "verdict": "steady", "verdict_is": verdict_is}
        stand_in.state(**ENDED | ended | {"sight": sight | {"word": "no swing seen"}})
        expect(page.locator("#verdict span")).to_have_text(told)
        expect(page.locator("#summary-title")).to_have_text(f"Ended: {told}")
        assert style(page, "borderTopStyle") != "none"
    for word, told in (("dying away", "still swings by 5.35 mm, dying away"), ("no swing seen", "")):
        stand_in.state(**ENDED | {"verdict": "steady", "sight": sight | {"word": word}})
        expect(page.locator("#verdict span")).to_have_text("steady if held" if told else "steady")
        expect(page.locator("#summary-title")).to_have_text("Ended: steady if held" if told else "Ended: steady")
        expect(page.locator("#seen")).to_have_text(told)
    failed = {"verdict": "undecided", "ended": "failed", "trajectory_sha256": "cd" * 32, "stability": {}}
    stand_in.state(**ENDED | {"phase": "failed", "verdict": "undecided", "summary": SUMMARY | failed})
    expect(page.locator("#verdict span")).to_have_text("undecided")
    expect(page.locator("#summary-title")).to_have_text("Failed: undecided")
    stand_in.state(**ENDED | {"summary": None, "verdict_is": "unknown", "why": "Its summary cannot be read."})
    expect(page.locator("#verdict span")).to_have_text("not known")
    expect(page.locator("#notice")).to_contain_text("Its summary cannot be read.")


def test_no_verdict_of_steady_stands_alone_beside_what_moves_still(stand_in, page):
    sight = RUNNING["sight"] | {"word": "settling", "from_s": 2.85, "to_s": 3.0, "so_far": True}
    stability = {"provisos": ["only friction holds it"]}
    ended = ENDED | {"verdict": "steady", "summary": SUMMARY | {"verdict": "steady", "stability": stability}}
    for word, told in (
        ("swinging", "only friction holds it, still swings by 5.35 mm"),
        ("moving", "only friction holds it, still moves by 5.35 mm"),
        ("force ripples", "only friction holds it, force still ripples by 410 mN"),
    ):
        stand_in.state(**ended | {"sight": sight | {"so_far_word": word}})
        expect(page.locator("#seen")).to_have_text(told)
        expect(page.locator("#verdict span")).to_have_text("steady if held")
        expect(page).to_have_title(re.compile("^steady if held: "))
        assert page.get_attribute("#verdict use", "href") != "#verdict-steady"
    stand_in.state(**ended | {"sight": sight | {"so_far_word": "no swing seen"}})
    expect(page.locator("#seen")).to_have_text("only friction holds it")
    expect(page.locator("#verdict use")).to_have_attribute("href", "#verdict-steady")


@pytest.mark.slow
def test_the_force_that_ripples_in_the_run_and_that_of_its_pushed_copies_are_told_apart(stand_in, page):
    window = {"window": {"force_ripple_N": 0.2, "from_s": 2.5, "oscillation_m": 5.5e-3, "force_swing_N": 0.6}}
    stand_in.state(
        **ENDED | {"summary": SUMMARY | window | {"stability": SUMMARY["stability"] | {"force_ripple_N": 0.0}}}
    )
    expect(page.locator("#summary")).to_contain_text("pushed, it ripples0 N above about 30 Hz")
    expect(page.locator("#summary")).to_contain_text("its own ripple200 mN above about 30 Hz")
    expect(page.locator("#summary")).to_contain_text("oscillation, last 500 ms5.50 mm p-p")
    expect(page.locator("#summary")).to_contain_text("commanded force600 mN p-p")
    expect(page.locator(".figures")).to_contain_text("applied force p-p")
    expect(page.locator("#ripple")).to_have_text("410 mN")


@pytest.mark.slow
def test_the_header_has_the_numbers_with_their_units_and_no_stiffness_of_what_swings(stand_in, open_page):
    stand_in.state()
    page = open_page(stand_in.url)
    expect(page.locator("#oscillation")).to_have_text("5.35 mm")
    expect(page.locator("#frequency")).to_have_text("8.25 Hz")
    expect(page.locator("#ripple")).to_have_text("410 mN")
    expect(page.locator("#stiffness")).to_have_text("–")
    expect(page.locator("#residual")).to_have_text("3.4e−16")
    expect(page.locator("#factor")).to_have_text("0.980×")
    expect(page.locator("#skipped")).to_have_text("12 ticks")
    expect(page.locator("#time")).to_have_text("1.500 of 3 s")
    stand_in.state(sight=RUNNING["sight"] | {"word": "no swing seen"})
    expect(page.locator("#stiffness")).to_have_text("137 of 150 N/m")
    stand_in.state(displayed_stiffness_N_m=None, sight=None, real_time_factor=None, pace="free")
    expect(page.locator("#stiffness")).to_have_text("–")
    expect(page.locator("#oscillation")).to_have_text("–")


@pytest.mark.slow
def test_what_a_plant_of_somebody_elses_makes_of_the_energy_is_told_in_words(stand_in, open_page):
    words = "This plant invents 27 % of the energy: 0.00162 J of the 0.006 J that moved came from nowhere."
    made = {"residual_J": 1.62e-3, "moved_J": 6e-3, "balance": words}
    stand_in.state(**made)
    stand_in.show(contact())
    page = open_page(stand_in.url)
    expect(page.locator("#energy")).to_contain_text("This plant invents 27 %")
    assert page.get_attribute("#residual", "title") == words
    energy = SUMMARY["energy"] | made
    stand_in.state(**ENDED | made | {"summary": SUMMARY | {"energy": energy}})
    expect(page.locator("#summary .balance")).to_have_text(words)
    left_over = {**SUMMARY["energy"], "residual_J": None, "unmodelled_work_J": 2.5e-3}
    stand_in.state(**ENDED | {"summary": SUMMARY | {"energy": left_over, "trajectory_sha256": "cd" * 32}})
    expect(page.locator("#summary")).to_contain_text("hand, as the remainder2.50 mJ")
    expect(page.locator("#summary .balance")).to_be_hidden()
    expect(page.locator("#summary")).not_to_contain_text("residual")


@pytest.mark.slow
def test_it_shows_who_waits_for_whom_and_what_each_node_skipped(stand_in, open_page):
    stand_in.state()
    page = open_page(stand_in.url)
    rows = page.locator("#nodes tr")
    expect(rows).to_have_count(4)
    assert rows.nth(0).locator("th, td").all_inner_texts() == ["plant", "1500", "0", "→ controller", "0"]
    assert rows.nth(3).locator("th, td").all_inner_texts() == ["view", "1460", "40", "", "12"]
    stand_in.state(nodes=RUNNING["nodes"][:2])
    expect(rows).to_have_count(2)


@pytest.mark.slow
def test_after_the_end_it_shows_what_came_of_the_run_and_its_last_snapshot(stand_in, open_page):
    stand_in.state(**ENDED)
    stand_in.show(contact())
    page = open_page(stand_in.url)
    expect(page.locator("#phase")).to_have_text("ended")
    summary = page.locator("#summary")
    expect(summary).to_contain_text("Ended: limit-cycle")
    for words in ("5.35 mm ± 420 µm", "at 7.10 Hz, felt, chaotic", "410 mN", "−0.0123 ± 0.020 1/s", "93 %"):
        expect(summary).to_contain_text(words)
    expect(summary).to_contain_text("leak by delay")
    expect(summary).to_contain_text("−1.10 mJ")
    expect(summary).to_contain_text("runs/fig6c")
    expect(page.locator("#swap")).to_be_hidden()
    expect(page.locator("#pause")).to_be_disabled()
    expect(page.locator("#freeze")).to_be_enabled()
    expect(page.locator("#force .legend")).to_contain_text("total")


@pytest.mark.slow
def test_a_failed_run_says_why(stand_in, open_page):
    stand_in.state(phase="failed", why="The plant was killed by SIGKILL.", options=None)
    page = open_page(stand_in.url)
    expect(page.locator("#phase")).to_have_text("failed")
    expect(page).to_have_title(re.compile("^failed: "))
    expect(page.locator("#notice")).to_contain_text("The plant was killed by SIGKILL.")


@pytest.mark.slow
def test_a_lost_server_is_told_and_taken_up_again_with_the_same_question(stand_in, open_page):
    stand_in.state()
    page = open_page(stand_in.url)
    expect(page.locator("#phase")).to_have_text("running")
    page.keyboard.press("[")
    asked = stand_in.asked(lambda watch: watch["span_s"] == 1)
    stand_in.stop()
    expect(page.locator("#phase")).to_have_text("not connected")
    expect(page.locator("#notice")).to_contain_text("No connection")
    expect(page.locator("#pause")).to_be_disabled()
    stand_in.received.clear()
    stand_in.start()
    expect(page.locator("#phase")).to_have_text("running")
    expect(page.locator("#pause")).to_be_enabled()
    stand_in.asked(lambda watch: watch == asked)


@pytest.mark.slow
def test_the_next_run_takes_the_place_of_the_one_that_has_ended_and_is_shown_live(stand_in, open_page):
    stand_in.state(**ENDED)
    stand_in.show(contact())
    page = open_page(stand_in.url)
    page.click("#freeze")
    expect(page.locator("#freeze")).to_have_text("To its end")
    stand_in.state(run="def456", title="another", tick=10)
    expect(page.locator("#title")).to_have_text("another")
    expect(page.locator("#freeze")).to_have_text("Freeze")
    expect(page.locator("#summary")).to_be_hidden()
    expect(page.locator("#swap")).to_be_visible()
    stand_in.asked(lambda watch: watch["end_s"] is None)
