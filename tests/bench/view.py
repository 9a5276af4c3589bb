"""Cost of the live page: its server's share of a core, what a browser draws, and what a run loses beside a reader."""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import re
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import aiohttp

from haploop.tools.machine import machine

SCENE = Path(__file__).parents[2] / "launch" / "scenes" / "fig6c.toml"
HAPLOOP = [sys.executable, "-m", "haploop.tools.cli"]
WATCHES = {
    "1 s, forces and energies row by row": {"span_s": 1.0, "points": 590},
    "0.2 s, every plant step": {"span_s": 0.2, "points": 590},
    "10 s, all as envelopes": {"span_s": 10.0, "points": 590},
    "all since the start": {"span_s": None, "points": 590},
}
# Simulated time of each of a pair of runs, s.
PAIRED_S = 80.0


def cpu_s(pid: int) -> float:
    """Processor time a process has used, all its threads (Linux)."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def viewer(folder: str) -> tuple[subprocess.Popen[str], str]:
    """Starts a viewer of the runs under a folder; returns it and its address."""
    environment = {**os.environ, "XDG_RUNTIME_DIR": folder}
    started = subprocess.Popen([*HAPLOOP, "view", "--no-browser"], stderr=subprocess.PIPE, text=True, env=environment)
    assert started.stderr
    found = re.search(r"http://[\d.:]+", started.stderr.readline())
    assert found
    return started, found[0]


def run(folder: str, out: str, duration_s: float, pace: str) -> subprocess.Popen[bytes]:
    sets = ["--set", f"duration={duration_s}", "--set", "run.verdict=window"]
    command = [*HAPLOOP, "run", str(SCENE), *sets, "--pace", pace, "--out", out]
    environment = {**os.environ, "XDG_RUNTIME_DIR": folder}
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment)


async def read(address: str, watch: dict[str, float | None], pid: int = 0, seconds: float = 1e9) -> str:
    """Reads as a page does, which says what it has drawn; returns what that cost the server."""
    async with aiohttp.ClientSession() as session:
        ws = await session.ws_connect(f"{address}/stream", headers={"Origin": address}, max_msg_size=0)
        await ws.send_json({"type": "watch", **watch})
        settled, snapshots, size, began, used = time.monotonic() + 1.0, 0, 0, 0.0, 0.0
        async for message in ws:
            now = time.monotonic()
            if not began and now >= settled:
                began, used = now, cpu_s(pid) if pid else 0.0
            if message.type is aiohttp.WSMsgType.BINARY:
                await ws.send_str('{"type": "drawn", "snapshots": 1}')
                if began:
                    snapshots, size = snapshots + 1, size + len(message.data)
            if began and now >= began + seconds:
                took = now - began
                share = (cpu_s(pid) - used) / took
                return f"{share:6.3f} of a core{snapshots / took:7.1f} snapshots/s{size / took / 1e6:7.2f} MB/s"
        return "The page was closed."


def draw(address: str, pid: int, seconds: float) -> None:
    """Counts the pictures that a headless Chromium draws in each second, of each span of the page."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        browser = driver.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox", "--disable-gpu"]
        )
        page = browser.new_page(viewport={"width": 1280, "height": 720})
        page.goto(address)
        for span in ("1", "10", "all"):
            page.click(f"label:has([name=span][value='{span}'])")
            time.sleep(2.0)
            began, used = time.monotonic(), cpu_s(pid)
            drawn = []
            while time.monotonic() < began + seconds:
                time.sleep(1.02)  # the page counts by the second
                drawn.append(int(page.inner_text("#rate")))
            share, real = (cpu_s(pid) - used) / (time.monotonic() - began), page.inner_text("#factor")
            print(f"{span:>5}: {min(drawn)} to {max(drawn)} pictures a second, server {share:.3f} of a core, {real}")
        browser.close()


def look(pace: str, seconds: float, in_browser: bool) -> None:
    """Looks at Fig. 6(c) in each way for a while."""
    with tempfile.TemporaryDirectory(prefix="hl", dir="/tmp") as folder:
        served, address = viewer(folder)
        going = run(folder, f"{folder}/out", 600.0 if pace != "free" else 60_000.0, pace)
        try:
            time.sleep(12.0)
            if in_browser:
                return draw(address, served.pid, seconds)
            for name, watch in WATCHES.items():
                print(f"{name:<40}{asyncio.run(read(address, watch, served.pid, seconds))}")
        finally:
            for process in (going, served):
                process.terminate()
                process.wait(20)


def pairs(count: int) -> None:
    """Runs as fast as it goes, in turn without a viewer and beside one with a reader in a process of its own."""
    with tempfile.TemporaryDirectory(prefix="hl", dir="/tmp") as folder:
        unseen = Path(folder, "unseen")
        unseen.mkdir(mode=0o700)
        served, address = viewer(folder)
        reader = subprocess.Popen([sys.executable, __file__, "--read", address])

        def factor(beside: bool) -> float:
            served.send_signal(signal.SIGCONT if beside else signal.SIGSTOP)
            out = Path(folder, "out")
            run(folder if beside else str(unseen), f"{out}{time.time_ns()}", PAIRED_S, "free").wait()
            newest = max(Path(folder).glob("out*/summary.json"), key=lambda file: file.stat().st_mtime)
            return json.loads(newest.read_text(encoding="utf-8"))["real_time_factor"]

        try:
            ratios = []
            for pair in range(count):
                found = {beside: factor(beside) for beside in ((True, False) if pair % 2 else (False, True))}
                ratios.append(found[False] / found[True] - 1.0)
            low, *_, high = sorted(ratios)
            print(f"{statistics.median(ratios):+.1%} time beside a reader, {low:+.1%} to {high:+.1%} in {count} pairs")
        finally:
            served.send_signal(signal.SIGCONT)
            for process in (reader, served):
                process.terminate()
                process.wait(20)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--pace", default="1")
    parser.add_argument("--pairs", type=int, default=0, help="compare so many pairs of runs instead")
    parser.add_argument("--browser", action="store_true", help="count what a headless Chromium draws instead")
    parser.add_argument("--read", help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.read:
        print(asyncio.run(read(chosen.read, {"span_s": 2.0, "points": 590})))
        return
    print(machine())
    if chosen.pairs:
        pairs(chosen.pairs)
    else:
        look(chosen.pace, chosen.seconds, chosen.browser)


if __name__ == "__main__":
    main()
