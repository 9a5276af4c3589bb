"""The form of what can be set: only what was changed goes out, and news of the run never take what is being typed."""

import pytest
from playwright.sync_api import expect

from helpers.live.browser import order
from helpers.live.stand_in import OPTIONS


@pytest.mark.slow
def test_settable_numbers_show_their_present_values_lengths_in_mm_and_times_in_ms(page):
    shown = {key: page.input_value(f"[id='set-{key}']") for key in OPTIONS["settable"]}
    assert shown == {
        "wall.stiffness": "150", "wall.position": "-60", "clock.round_trip_delay": "2", "dissipation.0.damping": "0.4",
        "dissipation.1.mass": "0.01",
    }  # fmt: skip
    expect(page.locator("[id='set-clock.round_trip_delay-unit']")).to_have_text("ms, ≥ 0")


def test_only_what_was_changed_is_set_and_a_number_in_mm_or_ms_goes_out_with_its_unit(stand_in, page):
    expect(page.locator("#set-do")).to_be_disabled()
    page.fill("[id='set-wall.position']", "-58.5")
    page.fill("[id='set-clock.round_trip_delay']", "1.2")
    page.fill("[id='set-wall.stiffness']", "0.2 N/mm")
    assert order(stand_in, page, lambda: page.click("#set-do")) == (
        "set",
        {"set": {"wall.stiffness": "0.2 N/mm", "wall.position": "-58.5 mm", "clock.round_trip_delay": "1.2 ms"}},
    )
    expect(page.locator("#set-do")).to_be_disabled()


@pytest.mark.slow
def test_the_last_change_is_taken_back_by_one_click(stand_in, page):
    expect(page.locator("#undo")).to_be_hidden()
    stand_in.tell({"type": "events", "events": [{"tick": 500, "t_s": 0.5, "text": "set", "kind": "set"}]})
    stand_in.state()
    assert order(stand_in, page, lambda: page.click("#undo-do")) == ("undo", {})


@pytest.mark.slow
def test_what_is_being_typed_survives_news_of_the_run_and_the_rest_follows_it(stand_in, page):
    page.fill("[id='set-wall.stiffness']", "180")
    settable = OPTIONS["settable"]
    changed = {**settable, "wall.stiffness": {**settable["wall.stiffness"], "value": 160.0},
               "dissipation.0.damping": {**settable["dissipation.0.damping"], "value": 0.7}}  # fmt: skip
    stand_in.state(options={**OPTIONS, "settable": changed})
    expect(page.locator("[id='set-dissipation.0.damping']")).to_have_value("0.7")
    assert page.input_value("[id='set-wall.stiffness']") == "180"
    expect(page.locator("[id='set-wall.stiffness']")).to_be_focused()
    page.click("#set-reset")
    assert page.input_value("[id='set-wall.stiffness']") == "160"
    assert stand_in.commands() == []


@pytest.mark.slow
def test_a_field_that_has_gone_with_its_element_takes_nothing_else_with_it(stand_in, page):
    """After a swap there are other keys; what is typed in those that stay is kept, and so is the place of the caret."""
    page.fill("[id='set-wall.stiffness']", "180")
    settable = {key: value for key, value in OPTIONS["settable"].items() if not key.startswith("dissipation.1")}
    stand_in.state(options={**OPTIONS, "settable": settable, "elements": OPTIONS["elements"][:1]})
    expect(page.locator("#set-fields input[type=text]")).to_have_count(4)
    assert page.input_value("[id='set-wall.stiffness']") == "180"
    expect(page.locator("[id='set-wall.stiffness']")).to_be_focused()
    expect(page.locator("#swap-element option")).to_have_text(["0: damping", "1: add one"])


@pytest.mark.slow
def test_a_refused_set_leaves_what_was_typed_and_names_the_field(stand_in, page):
    key = "clock.round_trip_delay"
    said = f"{key} is 0.00025. It is no whole number of plant steps; 0.0002 s or 0.0003 s is."
    stand_in.answer = lambda command: (False, said)
    page.fill("[id='set-wall.stiffness']", "180")
    page.fill("[id='set-clock.round_trip_delay']", "0.25")
    page.keyboard.press("Enter")
    problem = page.locator("[id='set-clock.round_trip_delay-problem']")
    expect(problem).to_contain_text("0.0002 s or 0.0003 s is.")
    expect(page.locator("[id='set-wall.stiffness-problem']")).to_be_empty()
    assert page.input_value("[id='set-clock.round_trip_delay']") == "0.25"
    expect(page.locator("#set-do")).to_be_enabled()


@pytest.mark.slow
def test_what_was_set_is_not_taken_back_on_the_page_by_older_news(stand_in, page):
    """The run tells of the new number a moment after it took the order; until then the page shows what was ordered."""
    page.evaluate("{ const now = performance.now(); performance.now = () => now; }")  # the moment lasts
    page.fill("[id='set-wall.stiffness']", "180")
    order(stand_in, page, lambda: page.click("#set-do"))
    stand_in.state(tick=1501)
    expect(page.locator("#time")).to_have_text("1.501 of 3 s")
    assert page.input_value("[id='set-wall.stiffness']") == "180"
    settable = OPTIONS["settable"]
    settable = {**settable, "wall.stiffness": {**settable["wall.stiffness"], "value": 180.5}}
    stand_in.state(options={**OPTIONS, "settable": settable})
    expect(page.locator("[id='set-wall.stiffness']")).to_have_value("180.5")
