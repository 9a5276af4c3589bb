"""Steering from the page: orders that go out as they were meant, and what is refused is told and changes nothing."""

import pytest
from playwright.sync_api import expect

from helpers.live.browser import order
from helpers.live.stand_in import OPTIONS, RUNNING, TOKEN
from helpers.live.waiting import wait_for
from oracles.snapshots import contact


@pytest.mark.slow
def test_every_order_carries_the_token_of_the_link(stand_in, page):
    assert order(stand_in, page, lambda: page.click("#pause")) == ("pause", {})
    assert stand_in.commands()[-1]["token"] == TOKEN


@pytest.mark.slow
def test_without_the_token_the_page_watches_says_why_and_orders_nothing(stand_in, open_page):
    stand_in.state()
    page = open_page(stand_in.origin + "/")
    expect(page.locator("#notice")).to_contain_text("open the link that haploop view printed to steer")
    for control in ("#pause", "#stop", "#swap-do", "[data-step='1']", "[name=pace] >> nth=0"):
        expect(page.locator(control)).to_be_disabled()
    for key in (" ", ".", "1", "2", "3", "-", "=", "x", "s"):
        page.keyboard.press(key)
    page.keyboard.press("[")
    expect(page.locator("[name=span][value='1']")).to_be_checked()
    assert stand_in.commands() == []


BUTTONS = [
    ("#pause", ("pause", {})),
    ("[data-step='1']", ("step", {"ticks": 1})),
    ("[data-step='10']", ("step", {"ticks": 10})),
    ("[data-step='100']", ("step", {"ticks": 100})),
    ("label:has([name=pace][value='0.1'])", ("pace", {"pace": 0.1})),
    ("label:has([name=pace][value='free'])", ("pace", {"pace": "free"})),
]


def test_every_button_orders_what_it_says(stand_in, page):
    for selector, expected in BUTTONS:
        assert order(stand_in, page, lambda what=selector: page.click(what)) == expected


@pytest.mark.slow
def test_a_paused_run_is_resumed_by_the_same_button_and_key(stand_in, page):
    stand_in.state(phase="paused")
    expect(page.locator("#pause")).to_have_text("Resume")
    assert order(stand_in, page, lambda: page.keyboard.press(" "))[0] == "resume"
    assert order(stand_in, page, lambda: page.click("#pause"))[0] == "resume"


@pytest.mark.slow
def test_to_stop_is_asked_first_and_may_be_taken_back(stand_in, page):
    page.keyboard.press("x")
    expect(page.locator("#stopping")).to_be_visible()
    page.keyboard.press("Escape")
    expect(page.locator("#stopping")).to_be_hidden()
    page.click("#stop")
    page.get_by_role("button", name="Continue").click()
    assert stand_in.commands() == []
    page.click("#stop")
    assert order(stand_in, page, lambda: page.get_by_role("button", name="End the run").click()) == ("stop", {})


@pytest.mark.slow
def test_a_swap_sends_kind_where_it_acts_and_its_parameters_and_the_answer_is_told(stand_in, page):
    stand_in.answer = lambda command: (True, "element 1 becomes damping at tick 1500 (1.5 s)")
    page.select_option("#swap-element", "1")
    page.select_option("#swap-kind", "damping")
    page.select_option("#swap-acts", "always")
    page.fill("#swap-damping", "0.8")
    swapped = order(stand_in, page, lambda: page.click("#swap-do"))
    assert swapped == ("swap", {"swap": {"kind": "damping", "acts": "always", "damping": 0.8}, "element": 1})
    expect(page.locator("#said")).to_have_text("element 1 becomes damping at tick 1500 (1.5 s)")


@pytest.mark.slow
def test_what_an_element_becomes_may_be_chosen_before_which_one(stand_in, page):
    page.select_option("#swap-kind", "unidirectional-inertia")
    page.fill("#swap-mass", "0.02")
    page.select_option("#swap-element", "0")
    swapped = order(stand_in, page, lambda: page.click("#swap-do"))
    assert (swapped[1]["element"], swapped[1]["swap"]["kind"]) == (0, "unidirectional-inertia")
    assert swapped[1]["swap"]["mass"] == 0.02


@pytest.mark.slow
def test_notes_on_a_change_are_told_without_the_words_for_a_terminal_and_move_no_chart(stand_in, page):
    before = page.locator("main").bounding_box()
    note = "wall.stiffness is 1e+08 N/m; is that the unit you meant? " * 8
    stand_in.answer = lambda command: (True, f"set wall.stiffness; to go back: set wall.stiffness=1\n{note}")
    page.click("#pause")
    expect(page.locator("#said")).to_have_text(f"set wall.stiffness. {note}".strip())
    assert page.locator("main").bounding_box() == before


@pytest.mark.slow
def test_one_can_be_added_past_the_end_and_one_removed(stand_in, page):
    page.select_option("#swap-element", "2")
    assert "none" not in page.locator("#swap-kind option").evaluate_all("all => all.map(o => o.value)")
    page.select_option("#swap-kind", "unidirectional-inertia")
    assert page.input_value("#swap-mass") == "0.01", "the default"
    assert order(stand_in, page, lambda: page.click("#swap-do"))[1]["element"] == 2
    page.select_option("#swap-element", "0")
    page.select_option("#swap-kind", "none")
    assert order(stand_in, page, lambda: page.click("#swap-do")) == ("swap", {"swap": {"kind": "none"}, "element": 0})


@pytest.mark.slow
def test_the_swap_form_follows_what_is_set_until_something_is_chosen_in_it(stand_in, page):
    def set_damping(value):
        element = {**OPTIONS["elements"][0], "damping": value}
        stand_in.state(title=f"damping {value}", options={**OPTIONS, "elements": [element, *OPTIONS["elements"][1:]]})
        expect(page.locator("#title")).to_have_text(f"damping {value}")

    set_damping(2.5)
    expect(page.locator("#swap-damping")).to_have_value("2.5")
    page.fill("#swap-damping", "7")
    set_damping(3.5)
    assert page.input_value("#swap-damping") == "7"


@pytest.mark.slow
def test_the_form_starts_from_the_element_as_it_is_and_says_what_a_kind_does(stand_in, page):
    assert page.input_value("#swap-kind") == "damping"
    assert page.input_value("#swap-damping") == "0.4"
    page.select_option("#swap-element", "1")
    assert page.input_value("#swap-kind") == "unidirectional-inertia"
    expect(page.locator("#swap-about")).to_contain_text("only ever takes energy out")
    expect(page.locator("#swap-mass-unit")).to_have_text("kg, > 0")


WRONG = [
    ("", "A number is needed."),
    ("-0.8", "It must be at least 0 N s/m."),
    ("-1e3", "It must be at least 0 N s/m."),
    ("0,8", "Write a point, not a comma: 0.8"),
    ("much", 'It must be a number in N s/m, or text with its unit such as "1 N s/m".'),
    ("nan", "It must be a number in N s/m"),
    ("1e999", "It must be a number"),
]


def test_a_wrong_value_is_refused_beside_its_field_before_anything_is_sent(stand_in, page):
    problem = page.locator("#swap-damping-problem")
    expect(problem).to_have_attribute("role", "alert")
    for text, reason in WRONG:
        page.fill("#swap-damping", text)
        page.keyboard.press("Enter")
        expect(problem).to_contain_text(reason)
        expect(page.locator("#swap-damping")).to_have_attribute("aria-invalid", "true")
        expect(page.locator("#swap-damping")).to_be_focused()
        assert stand_in.commands() == []
        page.fill("#swap-damping", "0.8")
        expect(problem).to_be_empty()


@pytest.mark.slow
def test_whatever_the_run_may_understand_is_sent(stand_in, page):
    for text in ("0.8 N s/m", "800 mN s/m", ".5", "1e-3", "+2"):
        page.fill("#swap-damping", text)
        sent = order(stand_in, page, lambda: page.keyboard.press("Enter"))[1]["swap"]["damping"]
        assert sent == (text if "N" in text else float(text))


@pytest.mark.slow
def test_what_the_run_refuses_is_told_beside_the_field_that_it_names(stand_in, page):
    stand_in.answer = lambda command: (False, 'damping is "1 kg". kg has another dimension.')
    page.fill("#swap-damping", "1 kg")
    page.keyboard.press("Enter")
    expect(page.locator("#swap-damping-problem")).to_have_text('damping is "1 kg". kg has another dimension.')
    assert page.input_value("#swap-damping") == "1 kg", "what was typed stays to be mended"
    assert page.input_value("#swap-kind") == "damping"


@pytest.mark.slow
def test_a_fault_that_names_no_field_is_pinned_to_none_and_an_element_taken_back_is_told_as_a_failure(stand_in, page):
    options = {
        **OPTIONS,
        "kinds": {"bad": {"about": "", "parameters": {"b": OPTIONS["kinds"]["damping"]["parameters"]["damping"]}}},
    }
    stand_in.state(options=options, run="other")
    expect(page.locator("#swap-b")).to_be_visible()
    stand_in.answer = lambda command: (False, "RuntimeError: boom")
    page.fill("#swap-b", "3")
    page.click("#swap-do")
    expect(page.locator("#swap-problem")).to_have_text("RuntimeError: boom")
    expect(page.locator("#swap-b-problem")).to_be_empty()
    stand_in.answer = lambda command: (False, "dissipation.0.b is above 1.")
    page.click("#swap-do")
    expect(page.locator("#swap-b-problem")).to_have_text("dissipation.0.b is above 1.")
    stand_in.answer = lambda command: (True, "element 0 becomes bad; to go back: swap none")
    page.click("#swap-do")
    expect(page.locator("#said")).to_have_text("element 0 becomes bad")
    fault = {"tick": 9, "t_s": 0.009, "kind": "restored", "text": "Element 0 gave no force. It is removed."}
    stand_in.tell({"type": "events", "events": [fault]})
    expect(page.locator("#said")).to_have_text("Taken back: Element 0 gave no force. It is removed.")
    expect(page.locator("#said")).to_have_attribute("data-ok", "false")


@pytest.mark.slow
def test_what_the_run_refuses_without_naming_a_field_is_told_in_the_form(stand_in, page):
    stand_in.answer = lambda command: (False, "The run ends at tick 3000, 3 s; nothing can change from then on.")
    page.click("#swap-do")
    expect(page.locator("#swap-problem")).to_contain_text("The run ends at tick 3000")


@pytest.mark.slow
def test_a_pace_that_is_refused_shows_the_pace_as_it_is(stand_in, page):
    stand_in.answer = lambda command: (False, "A pace is a number above 0, or free.")
    page.click("label:has([name=pace][value='free'])")
    expect(page.locator("#said")).to_have_text("Refused: A pace is a number above 0, or free.")
    expect(page.locator("#said")).to_have_attribute("role", "alert")
    expect(page.locator("[name=pace][value='1']")).to_be_checked()


@pytest.mark.slow
def test_an_order_whose_answer_never_comes_is_told(stand_in, page):
    stand_in.answer = lambda command: None
    page.click("#pause")
    stand_in.stop()
    expect(page.locator("#said")).to_contain_text("lost before the answer came")


@pytest.mark.slow
def test_spans_freezing_and_scrolling_ask_for_that_stretch_of_time(stand_in, page):
    stand_in.show(contact(1.0, 3.0))
    expect(page.locator("#force .legend")).to_contain_text("total")

    def asks(act, *stretch):
        before = len(stand_in.watches())
        act()
        later = lambda: [(watch["span_s"], watch["end_s"]) for watch in stand_in.watches()[before:]]  # noqa: E731
        wait_for(f"the question for {stretch}", lambda: stretch in later())

    stand_in.state(tick=3000, end_tick=60000)
    expect(page.locator("#time")).to_have_text("3.000 of 60 s")
    asks(lambda: page.keyboard.press("]"), 10, None)
    asks(lambda: page.click("label:has([name=span][value='2'])"), 2, None)
    page.click("h1")
    asks(lambda: page.keyboard.press("f"), 2, 3)
    asks(lambda: page.keyboard.press("ArrowLeft"), 2, 2)
    asks(lambda: page.click("#earlier"), 2, 2)
    asks(lambda: page.click("#freeze"), 2, None)
    asks(lambda: page.click("label:has([name=span][value='all'])"), None, None)
    assert RUNNING["first_s"] == 0.0


@pytest.mark.slow
def test_a_link_of_an_earlier_server_is_told_apart(stand_in, page):
    """The server refuses the token; the page says what it said."""
    stand_in.answer = lambda command: (False, "This link is of an earlier haploop view; open the one it printed last.")
    page.click("#pause")
    expect(page.locator("#said")).to_contain_text("open the one it printed last")


@pytest.mark.slow
def test_three_clicks_are_one_swap(stand_in, page):
    stand_in.answer = lambda command: None
    page.locator("#swap-do").evaluate("button => { for (let i = 0; i < 3; i++) button.click(); }")
    page.keyboard.press("[")
    stand_in.asked(lambda watch: watch["span_s"] == 1)  # it comes after all that was ordered
    assert len(stand_in.commands()) == 1
    expect(page.locator("#swap-do")).to_be_disabled()


@pytest.mark.slow
def test_clicks_that_follow_the_answer_of_a_swap_are_no_second_one(stand_in, page):
    page.locator("#swap-do").evaluate("""async button => {
        for (let i = 0; i < 3; i++) {
            button.click();
            await new Promise(done => setTimeout(done, 60));
        }
    }""")
    expect(page.locator("#said")).to_have_text("done")
    assert len(stand_in.commands()) == 1
    expect(page.locator("#swap-do")).to_be_enabled()  # for the next swap


@pytest.mark.slow
def test_the_form_of_a_run_without_elements_offers_the_first_kind_whatever_was_chosen_for_the_last_run(stand_in, page):
    page.select_option("#swap-kind", "unidirectional-inertia")
    page.select_option("#swap-acts", "always")
    stand_in.state(run="another", options={**OPTIONS, "elements": []})
    expect(page.locator("#swap-element option")).to_have_count(1)
    assert [page.input_value(f"#swap-{name}") for name in ("kind", "acts")] == ["damping", "in-contact"]


@pytest.mark.slow
def test_the_form_of_the_next_run_starts_from_its_own_element(stand_in, page):
    page.select_option("#swap-element", "1")
    page.select_option("#swap-kind", "damping")
    page.fill("#swap-damping", "7")
    own = {**OPTIONS, "elements": [{"kind": "unidirectional-inertia", "acts": "always", "mass": 0.03}]}
    stand_in.state(run="another", options=own)
    expect(page.locator("#swap-kind")).to_have_value("unidirectional-inertia")
    assert (page.input_value("#swap-element"), page.input_value("#swap-mass")) == ("0", "0.03")


@pytest.mark.slow
def test_a_form_that_nobody_has_touched_follows_a_swap_made_elsewhere_and_one_begun_stays(stand_in, page):
    after = {**OPTIONS, "elements": [OPTIONS["elements"][1], OPTIONS["elements"][1]]}
    stand_in.state(options=after)
    expect(page.locator("#swap-kind")).to_have_value("unidirectional-inertia")
    page.select_option("#swap-kind", "damping")
    page.fill("#swap-damping", "3")
    stand_in.state(options={**after, "elements": after["elements"][:1]})
    expect(page.locator("#swap-element option")).to_have_count(2)
    assert (page.input_value("#swap-kind"), page.input_value("#swap-damping")) == ("damping", "3")
