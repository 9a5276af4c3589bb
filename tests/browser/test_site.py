"""The site of the documentation, opened from the disk: its search runs where a page may start no worker."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Browser

SHIM = Path(__file__).parents[2] / "docs/site/iframe-worker.js"
WORKER = 'const own = " twice"; addEventListener("message", (told) => postMessage(told.data + own));'
PAGE = """<!doctype html><title>page</title><script src="iframe-worker.js"></script><p></p><script>
const worker = new Worker("worker.js");
worker.addEventListener("message", (told) => { document.querySelector("p").textContent += told.data; });
worker.postMessage("said");
</script>"""


def test_what_a_worker_would_run_answers_a_page_from_the_disk(browser: Browser, tmp_path: Path):
    (tmp_path / "iframe-worker.js").write_text(SHIM.read_text(encoding="utf-8"), encoding="utf-8")
    (tmp_path / "worker.js").write_text(WORKER, encoding="utf-8")
    (tmp_path / "page.html").write_text(PAGE, encoding="utf-8")
    page = browser.new_page()
    page.goto((tmp_path / "page.html").as_uri())
    page.wait_for_function("document.querySelector('p').textContent === 'said twice'")
    assert page.evaluate("typeof own") == "undefined", "a worker's names are its own"
    page.close()


NAME = "name: Annotated[float, Quantity(unit, bounds)]"
TABLES = """<!doctype html><html style="font-size: 20px"><meta name="viewport" content="width=device-width">
<link rel="stylesheet" href="{css}"><body class="md-typeset" style="margin: .8rem; font-size: .8rem">
<table><tr><td><code>{name}</code></td><td>a parameter: text with any unit of its dimension is taken</td></tr></table>
<table><tr><td><code class="whole">short_name</code></td><td>the same</td>
<td>as <code class="whole">haploop run --plugin x.py</code> or any other says</td></tr></table>"""


@pytest.mark.slow
def test_a_table_with_a_long_name_at_the_head_of_a_row_fits_a_phone_and_a_short_name_stays_whole(
    browser: Browser, tmp_path: Path
):
    css = SHIM.with_name("site.css").as_uri()
    (tmp_path / "tables.html").write_text(TABLES.format(css=css, name=NAME), encoding="utf-8")
    page = browser.new_page(viewport={"width": 390, "height": 844})
    page.goto((tmp_path / "tables.html").as_uri())
    for table in page.locator("table").all():
        box = table.bounding_box()
        assert box
        assert box["x"] + box["width"] <= 390
    meaning = page.locator("td").nth(1).bounding_box()
    assert meaning
    assert meaning["width"] > 120
    lines = "code => code.getClientRects().length"
    assert page.locator("code").first.evaluate(lines) > 1
    assert page.locator("code").nth(1).evaluate(lines) == 1
    page.close()
