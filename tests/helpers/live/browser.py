"""The browser that the tests of the live page drive: its names, arguments and sizes of its window."""

from __future__ import annotations

from typing import Any

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
