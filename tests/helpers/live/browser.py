"""The browser that the tests of the live page drive: names, arguments, sizes of its window, and orders given in it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from playwright.sync_api import Page

    from helpers.live.stand_in import StandIn

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
# Nothing is fetched, synchronised or reported: what the page asks for is all that is asked for.
ARGUMENTS = [
    "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync",
]  # fmt: skip
# What a browser says because of what a test does: it stops a server, and reads the pixels of a chart.
OF_THE_TEST = ("ERR_CONNECTION_REFUSED", "willReadFrequently")
DESK = {"width": 1280, "height": 720}
PHONE = {"width": 390, "height": 844}


def is_complaint(said: Any) -> bool:
    """Tells whether a message on the console is a complaint of the page."""
    return said.type in ("error", "warning") and not any(word in said.text for word in OF_THE_TEST)


def order(stand_in: StandIn, page: Page, act: Callable[[], object]) -> tuple[str, dict[str, Any]]:
    """Returns verb and arguments of what is ordered by ``act``; the page has heard the answer."""
    from playwright.sync_api import expect

    page.evaluate("document.querySelector('#said').textContent = ''")
    act()
    expect(page.locator("#said")).not_to_be_empty()
    return [(command["verb"], command["arguments"]) for command in stand_in.commands()][-1]
