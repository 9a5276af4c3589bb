"""Cost of the live page to its server in real time: share of a core, snapshots and bytes a second."""

from __future__ import annotations

import argparse
import asyncio
import os
import re
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
    "2 s, forces and energies row by row": {"span_s": 2.0, "points": 1000},
    "0.2 s, every plant step": {"span_s": 0.2, "points": 1000},
    "10 s, all as envelopes": {"span_s": 10.0, "points": 1000},
    "all since the start": {"span_s": None, "points": 1000},
}


def cpu_s(pid: int) -> float:
    """Processor time a process has used, all its threads (Linux)."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


async def measure(
    address: str, pid: int, watch: dict[str, float | None], seconds: float
) -> tuple[float, float, float, int]:
    """Share of a core, snapshots a second, MB a second, and columns of a snapshot, with one page open."""
    import json

    async with aiohttp.ClientSession() as session:
        ws = await session.ws_connect(f"{address}/stream", headers={"Origin": address}, max_msg_size=0)
        await ws.send_json({"type": "watch", **watch})
        settled, snapshots, size, columns = time.monotonic() + 1.0, 0, 0, 0
        began, used = 0.0, 0.0
        async for message in ws:
            now = time.monotonic()
            if not began and now >= settled:
                began, used = now, cpu_s(pid)
            if began and message.type is aiohttp.WSMsgType.BINARY:
                snapshots, size = snapshots + 1, size + len(message.data)
                head = json.loads(message.data[4 : 4 + int.from_bytes(message.data[:4], "little")])
                columns = sum(len(table["columns"]) for table in head["tables"])
            if began and now >= began + seconds:
                took = now - began
                return (cpu_s(pid) - used) / took, snapshots / took, size / took / 1e6, columns
        raise RuntimeError("The page was closed.")


def main() -> None:
    """Run figure 6(c) in real time, look at it in each way for a while, and print what that cost."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=10.0)
    seconds = parser.parse_args().seconds
    with tempfile.TemporaryDirectory(prefix="hl", dir="/tmp") as folder:
        environment = {**os.environ, "XDG_RUNTIME_DIR": folder}
        viewer = subprocess.Popen(
            [*HAPLOOP, "view", "--no-browser"], stderr=subprocess.PIPE, text=True, env=environment
        )
        command = [*HAPLOOP, "run", str(SCENE), "--set", "duration=600", "--pace", "1", "--out", f"{folder}/out"]
        run = subprocess.Popen(command, stderr=subprocess.DEVNULL, env=environment)
        try:
            assert viewer.stderr
            found = re.search(r"http://[\d.:]+", viewer.stderr.readline())
            assert found
            time.sleep(12.0)
            print(f"{machine()}; {seconds:g} s each, in real time")
            for name, watch in WATCHES.items():
                share, rate, rate_MB, columns = asyncio.run(measure(found[0], viewer.pid, watch, seconds))
                print(f"{name:<40}{share:6.3f} of a core{rate:7.1f} snapshots/s{rate_MB:7.2f} MB/s{columns:4} columns")
        finally:
            for process in (run, viewer):
                process.terminate()
                process.wait(20)


if __name__ == "__main__":
    main()
