"""The page from the keyboard: every key, every control, and what is typed into a field."""

import pytest
from playwright.sync_api import expect

from helpers.live.browser import order

KEYS = [
    (" ", ("pause", {})),
    (".", ("step", {"ticks": 1})),
    ("2", ("step", {"ticks": 10})),
    ("3", ("step", {"ticks": 100})),
    ("-", ("pace", {"pace": 0.1})),
    ("=", ("pace", {"pace": 1})),
    ("+", ("pace", {"pace": "free"})),
]


@pytest.mark.slow
def test_every_key_orders_what_the_help_says(stand_in, page):
    for key, expected in KEYS:
        assert order(stand_in, page, lambda what=key: page.keyboard.press(what)) == expected


@pytest.mark.slow
def test_a_key_that_is_typed_into_a_field_steers_nothing(stand_in, page):
    page.fill("#swap-fields input", "")
    page.locator("#swap-fields input").press_sequentially("0.123 kg")
    page.focus("#freeze")
    page.keyboard.press(" ")
    expect(page.locator("#freeze")).to_have_text("Go live")
    assert stand_in.commands() == []
    assert page.input_value("#swap-fields input") == "0.123 kg"


def test_with_the_keyboard_alone_an_element_is_swapped(stand_in, page):
    """s goes to the form; arrows, tab and digits do the rest."""
    page.keyboard.press("s")
    expect(page.locator("#swap-kind")).to_be_focused()
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Tab")
    expect(page.locator("#swap-mass")).to_be_focused()
    page.keyboard.press("Control+a")
    page.keyboard.type("0.02")
    swapped = order(stand_in, page, lambda: page.keyboard.press("Enter"))
    assert swapped == (
        "swap",
        {"swap": {"kind": "unidirectional-inertia", "acts": "in-contact", "mass": 0.02}, "element": 0},
    )


@pytest.mark.slow
def test_every_control_can_be_reached_by_tab(stand_in, page):
    """From the top to the last button, none left out: a group of radio buttons counts as one."""
    reached = set()
    for _ in range(80):
        page.keyboard.press("Tab")
        reached.add(page.evaluate("document.activeElement.id || document.activeElement.getAttribute('name') || ''"))
    wanted = {"pause", "pace", "stop", "span", "earlier", "freeze", "help", "swap-element", "swap-kind", "swap-damping"}
    wanted |= {"swap-acts", "swap-do", "set-wall.stiffness", "events"}
    assert wanted - reached == set()


@pytest.mark.slow
def test_the_help_names_every_key(page):
    page.keyboard.press("?")
    expect(page.locator("#keys")).to_be_visible()
    names = page.locator("#key-list kbd").all_inner_texts()
    assert {"Space", "s", "e", "f", "[", "]", "x", "?"} <= set(names)
    page.keyboard.press("Escape")
    expect(page.locator("#keys")).to_be_hidden()
