"""Gain of a sweep by a second worker, and what its memory is proportional to; a part of ``make bench``."""

from __future__ import annotations

import argparse
import multiprocessing
import os
import statistics
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from haploop.tools.executor.pool import MOST, Group, Pool
from haploop.tools.executor.work import Work
from haploop.tools.machine import machine
from haploop.tools.sweep.sweep_file import load

SCENE = Path(__file__).parents[2] / "launch" / "scenes" / "fig6b.toml"


def sweep_file(folder: Path, cells: int, duration: float) -> Path:
    """Figure 6(b) over stiffness and damping."""
    side = round(cells**0.5)
    path = folder / f"{cells}.toml"
    path.write_text(
        f"""scene = "{SCENE}"
[set]
duration = {duration}
"run.verdict" = "window"
[axes]
"wall.stiffness" = {{ from = 20, to = 400, count = {side} }}
"dissipation.0.damping" = {{ from = 0.02, to = 2, count = {side} }}
""",
        encoding="utf-8",
    )
    return path


def times_s(path: Path, workers: int) -> tuple[float, float]:
    """Wall time of all cells on so many processes that are started already, and the processor time of all of it."""
    made = load(path)
    work = Work(make=made.scene, keep=made.row, energy=False)
    with Pool(workers) as pool:
        for _ in pool.parts(work, [Group(range(workers), together=False)]):
            pass  # everything is imported in every worker
        used_before_s, began = used_s(), time.perf_counter()
        for _ in pool.parts(work, made.groups(), made.count):
            pass
        return time.perf_counter() - began, used_s() - used_before_s


def used_s() -> float:
    """Processor time of this process and of its workers so far (Linux)."""
    ticks = 0
    for child in multiprocessing.active_children():
        fields = Path(f"/proc/{child.pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
        ticks += int(fields[11]) + int(fields[12])
    return time.process_time() + ticks / os.sysconf("SC_CLK_TCK")


_TIMES = """
import sys
from pathlib import Path
sys.path.insert(0, sys.argv[3])
from sweep import times_s
if __name__ == "__main__":
    print(*times_s(Path(sys.argv[1]), int(sys.argv[2])))
"""


def measured(path: Path, workers: int) -> tuple[float, float]:
    """``times_s`` in a process of its own, with one thread as the workers have."""
    script = path.with_name("times.py")
    script.write_text(_TIMES, encoding="utf-8")
    command = [sys.executable, str(script), str(path), str(workers), str(Path(__file__).parent)]
    threads = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    ended = subprocess.run(command, check=True, capture_output=True, text=True, env={**os.environ, **threads})
    wall_s, processor_s = map(float, ended.stdout.split())
    return wall_s, processor_s


def beside_another_s(path: Path) -> float:
    """Wall time of a sweep in one process while another does the same: the yardstick of what two cores allow."""
    with ThreadPoolExecutor(2) as pool:
        return max(wall_s for wall_s, _ in pool.map(measured, [path, path], [1, 1]))


# The height of resident memory of the command, in a process of its own.
_PEAK = """
import resource, sys
from pathlib import Path
from haploop.tools.sweep.command import Request, sweep
if __name__ == "__main__":
    sweep(Request(Path(sys.argv[1]), out=Path(sys.argv[2]), workers=2), as_json=True)
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3)
"""


def peak_MB(path: Path, folder: Path) -> float:
    """Of the command itself, which collects what the workers send, MB (Linux)."""
    script = folder / "peak.py"
    script.write_text(_PEAK, encoding="utf-8")
    command = [sys.executable, str(script), str(path), str(folder / f"out-{path.stem}")]
    ended = subprocess.run(command, check=True, capture_output=True, text=True)
    return float(ended.stdout.splitlines()[-1])


def main() -> None:
    """One worker process against two, in turn; then the peak of memory of a long sweep and of a longer one."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cells", type=int, default=90_000)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--memory", type=int, nargs=2, default=(20_000, 60_000), metavar="CELLS")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        path = sweep_file(folder, options.cells, 1.0)
        ratios, costs, most = [], [], []
        for _ in range(options.repeats):
            (one_s, one_used_s), (two_s, two_used_s) = measured(path, 1), measured(path, 2)
            ratios.append(one_s / two_s)
            costs.append(two_used_s / one_used_s)
            most.append(2.0 * one_s / beside_another_s(path))
            print(
                f"{options.cells} cells: one worker {one_s:.2f} s, two {two_s:.2f} s: {ratios[-1]:.2f} times as fast; "
                f"two sweeps beside each other: {most[-1]:.2f} times as much"
            )
        print(
            f"medians: two workers {statistics.median(ratios):.2f} times as fast, for {statistics.median(costs):.2f} "
            f"times the processor time; two processes that share nothing do {statistics.median(most):.2f} times as "
            f"much, which is what the machine allows; {machine()}, load {os.getloadavg()[0]:.1f}"
        )
        for cells in options.memory:
            peak = peak_MB(sweep_file(folder, cells, 0.02), folder)
            print(f"{round(cells**0.5) ** 2} cells: {peak:.0f} MB at most, parts of at most {MOST} cells")


if __name__ == "__main__":
    main()
