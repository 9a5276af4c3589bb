"""A headless browser for the tests of the live page; where there is none they are skipped, and say so."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import pytest
from faults.conftest import launched as launched
from faults.conftest import live_runs_here as live_runs_here
from faults.conftest import running as running

if TYPE_CHECKING:
    from browser.stand_in import StandIn
    from playwright.sync_api import Browser, Page

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


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """One browser for all tests."""
    playwright = pytest.importorskip("playwright.sync_api", reason="there is no playwright to drive a browser with")
    found = next(filter(None, map(shutil.which, NAMES)), None)
    if not found:
        pytest.skip(f"there is no browser: none of {', '.join(NAMES)} is on the path")
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=found, args=ARGUMENTS)
        yield browser
        browser.close()


@pytest.fixture
def open_page(browser: Browser) -> Iterator[Callable[..., Page]]:
    """Open a link as a user does; at the end no page may have complained or asked anybody but its own server."""
    contexts, complaints, strangers = [], [], []

    def open_page(url: str, **options: Any) -> Page:
        given: dict[str, Any] = {"viewport": DESK} | options
        context = browser.new_context(**given)
        contexts.append(context)
        page = context.new_page()
        origin = url.split("/#")[0].rstrip("/")
        own = (origin, origin.replace("http://", "ws://"), "data:", "blob:")
        page.on("request", lambda request: None if request.url.startswith(own) else strangers.append(request.url))
        page.on("websocket", lambda socket: None if socket.url.startswith(own) else strangers.append(socket.url))
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("console", lambda said: complaints.append(said.text) if is_complaint(said) else None)
        page.goto(url)
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert strangers == []
    assert complaints == []


def is_complaint(said: Any) -> bool:
    """Whether a word on the console is one of the page."""
    return said.type in ("error", "warning") and not any(word in said.text for word in OF_THE_TEST)


@pytest.fixture
def stand_in() -> Iterator[StandIn]:
    """A server that tells the page whatever a test wants."""
    pytest.importorskip("aiohttp", reason="the live page needs aiohttp: pip install 'haploop[view]'")
    from browser.stand_in import StandIn

    server = StandIn()
    yield server
    server.close()
