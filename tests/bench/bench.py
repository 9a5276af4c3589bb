"""Speed as ratios to stated yardsticks, medians of interleaved repeats in one run: ``make bench``."""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from itertools import count
from pathlib import Path

from history import keep
from rich.console import Console
from rich.table import Table
from yardsticks import SCENE, loop_us, ping_pong_us, plain_loop_us

from haploop.controller.dissipation import registry
from haploop.launch.runs.in_batch import run_batch
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.file import load
from haploop.logger.books import segments
from haploop.logger.summary import versions
from haploop.plant.friction import motion
from haploop.protocol.scene.paths import with_value
from haploop.tools.machine import machine


def _in_process_us(seconds: float) -> float:
    """Wall time per tick of figure 6c in one process with the books, nothing logged."""
    scene = load(SCENE, [f"duration={seconds}", "run.log=none", "run.verdict=window", "diverged_beyond=1e9"])
    kinds = registry()
    began = time.perf_counter()
    summary = run_in_process(scene, kinds)
    return (time.perf_counter() - began) / summary["ticks"] * 1e6


def _realistic_us(
    seconds: float, *, by_loops: bool, members: int = 1, key: str = "wall.stiffness", most: float = 1500.0
) -> Callable[[], float]:
    """As ``_in_process_us`` with cable, grip and friction, the hand tapping: by loops of machine code, or without.

    Of so many members, each with a number of its own, which no repeat had before: in one batch where it is the wall's.
    """
    repeats = count()

    def measure() -> float:
        for loops in (motion.LOOPS, segments.LOOPS):
            loops.pays = 0 if by_loops else float("inf")
            assert not by_loops or loops.module(), "numba is missing, or does not work"
        settings = [f"duration={seconds}", "run.log=none", "run.verdict=window"]
        whole, kinds = load(SCENE.parent / "all_effects.toml", settings), registry()
        scene = replace(whole, jitter=None, loss=None, noise=None, actuator=None)
        highest = most * (1.0 - 1e-6 * next(repeats))
        scenes = [with_value(scene, key, highest * (1.0 - 0.9 * place / members)) for place in range(members)]
        began = time.perf_counter()
        summaries = run_batch(scenes, kinds) if members > 1 else [run_in_process(scene, kinds)]
        return (time.perf_counter() - began) / sum(summary["ticks"] for summary in summaries) * 1e6

    return measure


def _first_tick_s() -> float:
    """From the command line until the summary of a run of one tick is there: to the first tick, and the log's end."""
    with tempfile.TemporaryDirectory() as folder:
        command = [
            sys.executable,
            "-m",
            "haploop.tools.cli",
            "run",
            str(SCENE),
            "--set",
            "duration=0.001",
            "--set",
            "run.verdict=window",
        ]
        # Where the environment forbids bytecode, as container images do, every process would compile haploop anew.
        environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
        began = time.perf_counter()
        command += ["--out", f"{folder}/out"]
        with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment) as run:
            while not Path(folder, "out", "summary.json").exists():
                assert run.poll() is None
                time.sleep(0.002)
            return time.perf_counter() - began


ROWS: dict[str, tuple[Callable[[], float], str, str, float]] = {
    # what: (measure, unit, yardstick, target as a ratio; 0 for an absolute one)
    "ping-pong": (ping_pong_us, "us/tick", "", 0.0),
    "plain loop": (plain_loop_us, "us/tick", "", 0.0),
    "processes, d = 0, every step logged": (loop_us(0.0, "steps", 20.0), "us/tick", "ping-pong", 1.25),
    "processes, d = 2 ms, every step logged": (loop_us(0.002, "steps", 10.0), "us/tick", "ping-pong", 0.7),
    "processes, d = 10 ms, every step logged": (loop_us(0.010, "steps", 20.0), "us/tick", "ping-pong", 0.45),
    "processes, d = 10 ms, ticks logged": (loop_us(0.010, "ticks", 20.0), "us/tick", "ping-pong", 0.35),
    "one process, books, no log": (lambda: _in_process_us(20.0), "us/tick", "plain loop", 8.0 / 2.7),
    "the same with cable, grip, friction": (_realistic_us(10.0, by_loops=False), "us/tick", "plain loop", 0.0),
    "the same by numba's loops": (_realistic_us(10.0, by_loops=True), "us/tick", "plain loop", 0.0),
    "128 of them in one batch": (_realistic_us(1.0, by_loops=True, members=128), "us/tick", "plain loop", 0.0),
    "20 devices, each alone": (
        _realistic_us(1.0, by_loops=True, members=20, key="device.mass", most=0.2),
        "us/tick",
        "plain loop",
        0.0,
    ),
    "haploop run of one tick, to its summary": (_first_tick_s, "s", "", 0.0),
}


def main() -> None:
    """Measure, print a table, and add what was measured to the history."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--only", default="", help="rows whose name holds this text, and the yardsticks")
    parser.add_argument("--compare", type=Path, help="history whose last run on such a machine this one is held to")
    options = parser.parse_args()
    rows = {name: row for name, row in ROWS.items() if options.only in name or not row[2]}
    seen: dict[str, list[float]] = {name: [] for name in rows}
    for _ in range(options.repeats):
        for name, (measure, *_rest) in rows.items():
            seen[name].append(measure())
    medians = {name: statistics.median(values) for name, values in seen.items()}
    _show(rows, seen, medians, options.repeats)
    keep("bench", seen, {name: row[2] for name, row in ROWS.items()}, options.compare)


def _show(rows: dict, seen: dict[str, list[float]], medians: dict[str, float], repeats: int) -> None:
    table = Table(title=f"medians of {repeats} interleaved repeats; {machine()}", title_justify="left")
    for heading in ("what", "median", "least - most", "ratio", "yardstick", "at most"):
        table.add_column(heading, justify="left" if heading in ("what", "yardstick") else "right")
    for name, (_, unit, yardstick, target) in rows.items():
        ratio = medians[name] / medians[yardstick] if yardstick else None
        table.add_row(
            name,
            f"{medians[name]:.3g} {unit}",
            f"{min(seen[name]):.3g} - {max(seen[name]):.3g}",
            f"{ratio:.2f}" if ratio else "",
            yardstick,
            f"{target:.2f}" if target else "",
        )
    console = Console(width=130)
    console.print(table)
    console.print(", ".join(f"{name} {version}" for name, version in versions().items()))


if __name__ == "__main__":
    main()
