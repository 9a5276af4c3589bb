"""Makes the picture of the live page, of step 4 of README's walk: ``python docs/site/page_picture.py docs/view.png``.

It needs Chromium on the path, and playwright. The loop goes by steps, so that the swap has the same tick each time.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image
from playwright.sync_api import ViewportSize, expect, sync_playwright

from haploop.api import load, start

SIZE: ViewportSize = {"width": 1280, "height": 720}
PATIENCE_MS = 60_000
COLOURS = 256
SWAP_TICK, TICKS = 4200, 5200


def make(target: Path) -> None:
    """Runs the demo's wall until damping has steadied it, and writes the page as it shows that."""
    with tempfile.TemporaryDirectory(prefix="hl", dir="/tmp") as folder, sync_playwright() as driver:
        os.environ["XDG_RUNTIME_DIR"] = folder  # no other run is on the page
        words = [sys.executable, "-m", "haploop.tools.cli", "view", "--no-browser"]
        viewer = subprocess.Popen(words, stderr=subprocess.PIPE, text=True, cwd=folder)
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        try:
            assert viewer.stderr
            link = re.search(r"http://\S+", viewer.stderr.readline())
            assert link, "haploop view told no address"
            page = browser.new_page(viewport=SIZE, color_scheme="light")
            page.goto(link[0])
            with start(load("demo", {"event": [], "duration": 60}), paused=True) as loop:
                loop.step(SWAP_TICK)
                loop.swap("damping", damping=5)
                loop.step(TICKS - SWAP_TICK)
                page.click("[data-panel=energy]")
                expect(page.locator("#time")).to_contain_text(f"{TICKS / 1000:.3f}", timeout=PATIENCE_MS)
                expect(page.locator("#budget")).to_contain_text("damping", timeout=PATIENCE_MS)
                for row in range(4):
                    expect(page.locator("#nodes tr").nth(row)).to_contain_text(f"{TICKS}", timeout=PATIENCE_MS)
                expect(page.locator("#swap-element")).to_contain_text("0: damping", timeout=PATIENCE_MS)
                page.wait_for_timeout(1500)  # texts come a few times a second
                page.screenshot(path=target)
                with Image.open(target) as picture:
                    small = picture.convert("RGB").quantize(
                        COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE
                    )
                small.save(target, optimize=True)
                loop.stop()
        finally:
            browser.close()
            viewer.terminate()
            viewer.wait(20)


if __name__ == "__main__":
    make(Path(sys.argv[1]))
