"""The site of the documentation, opened from the disk: its search runs where a page may start no worker."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

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
