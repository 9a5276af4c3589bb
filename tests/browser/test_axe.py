"""Accessibility of the page by axe-core: no violation in its main states, on a desk and a phone, light and dark."""

from pathlib import Path

import pytest
from playwright.sync_api import expect

from helpers.live.browser import DESK, PHONE, still
from helpers.live.stand_in import ENDED, RUNS, WAITING
from oracles.snapshots import contact

pytestmark = pytest.mark.slow
AXE = Path(__file__).parent / "node_modules/axe-core/axe.min.js"
EVENT = {"tick": 500, "t_s": 0.5, "text": "set", "kind": "set"}
# The scheme of Firefox is the system's: its driver cannot choose it.
AXE_IN = [("chromium", "light"), ("chromium", "dark"), ("firefox", "light")]
PANELS = ("energy", "spectrum", "compare", "motion", "own")
RUN = "within => axe.run(within, {resultTypes: ['violations']}).then(found => found.violations" \
      ".map(one => `${one.id}: ${one.nodes[0].target} and ${one.nodes.length - 1} more`))"  # fmt: skip


@pytest.fixture
def violations():
    if not AXE.is_file():
        pytest.skip("there is no axe-core: npm ci --ignore-scripts --prefix tests/browser installs it")

    def violations(page, within="body"):
        if page.evaluate("typeof axe") == "undefined":
            page.evaluate(AXE.read_text(encoding="utf-8"))
        return page.evaluate(RUN, within)

    return violations


@pytest.mark.parametrize(("browser", "scheme"), AXE_IN, indirect=["browser"])
def test_no_state_of_the_page_has_a_violation(stand_in, open_page, violations, scheme):
    stand_in.state(own=True)
    stand_in.tell(RUNS, {"type": "events", "events": [EVENT]})
    stand_in.show(contact())
    page = open_page(stand_in.url, viewport=DESK, color_scheme=scheme)
    expect(page.locator("#force .legend")).to_contain_text("total")
    assert violations(page) == []
    for panel in PANELS:
        page.click(f"[data-panel={panel}]")
        still(page)
        assert violations(page, ".beside") == [], panel
    page.set_viewport_size(PHONE)
    assert violations(page) == []
    for state in (ENDED, {"phase": "failed", "why": "The plant was killed by SIGKILL.", "options": None}):
        stand_in.state(**state)
        expect(page.locator("#phase")).to_have_text(state["phase"])
        still(page)
        assert violations(page) == [], state["phase"]
    stand_in.tell(WAITING)
    expect(page.locator("#phase")).to_have_text("waiting")
    still(page)
    assert violations(page) == []
    page.evaluate("document.querySelector('main').insertAdjacentHTML('beforeend', '<img src=\"/static/icon.svg\">')")
    assert len(violations(page)) == 1, "an image without words is seen"
