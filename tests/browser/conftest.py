"""A headless browser for the tests of the live page; where there is none they are skipped, and say so."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import pytest

from helpers.live.browser import BROWSERS, DESK, is_complaint
from helpers.live.waiting import PATIENCE_S

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

    from helpers.live.stand_in import StandIn

PATIENCE_MS = 1000 * PATIENCE_S


@pytest.fixture(scope="session", params=["chromium"])
def browser(request: pytest.FixtureRequest) -> Iterator[Browser]:
    """One browser for all tests: Chromium, and for those marked ``IN_BOTH`` Firefox, too."""
    playwright = pytest.importorskip("playwright.sync_api", reason="there is no playwright to drive a browser with")
    names, options = BROWSERS[request.param]
    found = next(filter(None, map(shutil.which, names)), None)
    if not found:
        pytest.skip(f"there is no browser: none of {', '.join(names)} is on the path")
    with playwright.sync_playwright() as driver:
        playwright.expect.set_options(timeout=PATIENCE_MS)
        browser = getattr(driver, request.param).launch(executable_path=found, timeout=PATIENCE_MS, **options)
        yield browser
        browser.close()


@pytest.fixture
def open_page(browser: Browser) -> Iterator[Callable[..., Page]]:
    """Open a link as a user does; at the end no page may have complained or asked anybody but its own server."""
    contexts, told, strangers = [], [], []

    def open_page(url: str, **options: Any) -> Page:
        given: dict[str, Any] = {"viewport": DESK} | options
        context = browser.new_context(**given)
        context.set_default_timeout(PATIENCE_MS)
        contexts.append(context)
        page = context.new_page()
        origin = url.split("/#")[0].rstrip("/")
        own = (origin, origin.replace("http://", "ws://"), "data:", "blob:")
        page.on("request", lambda request: None if request.url.startswith(own) else strangers.append(request.url))
        page.on("websocket", lambda socket: None if socket.url.startswith(own) else strangers.append(socket.url))
        page.on("pageerror", lambda error: told.append(str(error)))
        page.on("console", lambda said: told.append(said.text) if said.type in ("error", "warning") else None)
        page.goto(url)
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert strangers == []
    assert list(filter(is_complaint, told)) == []


@pytest.fixture
def stand_in() -> Iterator[StandIn]:
    """A server that tells the page whatever a test wants."""
    pytest.importorskip("aiohttp", reason="the live page needs aiohttp: pip install 'haploop[view]'")
    from helpers.live.stand_in import StandIn

    server = StandIn()
    yield server
    server.close()


@pytest.fixture
def page(stand_in: StandIn, open_page: Callable[..., Page]) -> Page:
    """The page of a run that can be steered."""
    from playwright.sync_api import expect

    stand_in.state()
    page = open_page(stand_in.url)
    expect(page.locator("#pause")).to_be_enabled()
    return page
