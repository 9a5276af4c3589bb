"""The browser that the tests of the live page drive: names, arguments, sizes of its window, and orders given in it."""

from __future__ import annotations

import random
import socket
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Page

    from helpers.live.stand_in import StandIn

# Names on the path and options of each. Chromium: nothing is fetched, synchronised or reported, so that all requests
# come from the page. Firefox: the one that is installed, driven by WebDriver BiDi.
BROWSERS: dict[str, tuple[tuple[str, ...], dict[str, Any]]] = {
    "chromium": (
        ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable"),
        {"args": [
            "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
            "--disable-component-update", "--disable-sync",
        ]},
    ),
    "firefox": (("firefox", "firefox-esr"), {"channel": "moz-firefox"}),
}  # fmt: skip
IN_BOTH = pytest.mark.parametrize(
    "browser", ["chromium", pytest.param("firefox", marks=pytest.mark.slow)], indirect=True
)
# Messages of a browser that are caused by a test, which stops a server and reads the pixels of a chart.
OF_THE_TEST = (
    "ERR_CONNECTION_", "ERR_EMPTY_RESPONSE", "before receiving a handshake response", "willReadFrequently",
    "establish a connection to the server at ws:", "was interrupted while the page was loading",
)  # fmt: skip
DESK = {"width": 1280, "height": 720}
PHONE = {"width": 390, "height": 844}

# Resolves when a few frames have been drawn and nothing fades or moves.
STILL = """() => new Promise(done => {
    let frames = 0;
    const look = () => {
        const moves = document.getAnimations().some(({ playState }) => playState === "running");
        if (++frames > 3 && !moves) done();
        else requestAnimationFrame(look);
    };
    requestAnimationFrame(look);
})"""
# Heights at which about a colour (r, g, b) is seen in a column of pixels of a chart, at parts (0 .. 1) of its width.
SEEN = """([chart, parts, colour]) => {
    const canvas = document.querySelector(`#${chart} canvas`);
    const over = document.querySelector(`#${chart} .u-over`);
    const ratio = canvas.width / canvas.clientWidth;
    const box = ["offsetLeft", "offsetTop", "offsetWidth", "offsetHeight"].map(key => over[key] * ratio);
    return parts.map(part => {
        const x = Math.round(box[0] + part * (box[2] - 1));
        const { data } = canvas.getContext("2d").getImageData(x - 1, box[1], 3, box[3]);
        let first = null, last = null;
        for (let i = 0; i < data.length; i += 4) {
            const off = Math.hypot(...[0, 1, 2].map(c => data[i + c] - colour[c]));
            if (data[i + 3] > 150 && off < 60) {
                last = Math.floor(i / 12) / box[3];
                first ??= last;
            }
        }
        return first === null ? null : [first, last];
    });
}"""
RGB = """name => {
    const probe = document.body.appendChild(document.createElement("i"));
    probe.style.color = `var(--${name})`;
    const rgb = getComputedStyle(probe).color.match(/[\\d.]+/g).map(Number);
    probe.remove();
    return rgb;
}"""


def free_port() -> int:
    """A port that the system does not assign on its own, so that it can be freed and taken again."""
    while True:
        with socket.socket() as tried, suppress(OSError):
            tried.bind(("127.0.0.1", random.randrange(10_000, 30_000)))
            return tried.getsockname()[1]


def still(page: Page) -> None:
    """Waits until the look of the page no longer changes."""
    page.evaluate(STILL)


def is_complaint(text: str) -> bool:
    """Tells whether an error or a warning is a complaint of the page."""
    return not any(words in text for words in OF_THE_TEST)


def order(stand_in: StandIn, page: Page, act: Callable[[], object]) -> tuple[str, dict[str, Any]]:
    """Returns verb and arguments of the command that ``act`` causes; the page has received the answer."""
    from playwright.sync_api import expect

    page.evaluate("document.querySelector('#said').textContent = ''")
    act()
    expect(page.locator("#said")).not_to_be_empty()
    return [(command["verb"], command["arguments"]) for command in stand_in.commands()][-1]


def seen(page: Page, chart: str, parts: list[float], name: str) -> list[tuple[float, float] | None]:
    """First and last height (0 top .. 1 bottom) at which a colour is seen at some parts of the width; None for none."""
    return page.evaluate(SEEN, [chart, parts, page.evaluate(RGB, name)[:3]])


def settled(page: Page, chart: str, text: str) -> None:
    """Waits until a chart's legend contains a text: then the snapshot is drawn."""
    from playwright.sync_api import expect

    expect(page.locator(f"#{chart} .legend")).to_contain_text(text)
