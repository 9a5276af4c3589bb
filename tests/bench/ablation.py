"""Cost of every effect: the loop in one process with all effects, with all but one, with none, in random order.

All effects stand in the table twice: how far these two rows differ is how much a difference of others means.
"""

from __future__ import annotations

import argparse
import random
import statistics
import time
from pathlib import Path

from rich.console import Console
from rich.table import Table

from haploop.controller.dissipation import registry
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.file import load
from haploop.protocol.scene.scene import Scene
from haploop.tools.machine import machine
from haploop.tools.operations import AGAIN, NONE, WHOLE, Kinds, ablations

SCENE = Path(__file__).parents[2] / "launch" / "scenes" / "all_effects.toml"


def measured_us(scene: Scene, kinds: Kinds) -> float:
    """Wall time of a tick, µs."""
    began = time.perf_counter()
    summary = run_in_process(scene, kinds)
    return (time.perf_counter() - began) / summary["ticks"] * 1e6


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--seconds", type=float, default=2.0)
    options = parser.parse_args()
    kinds = registry()
    everything = load(SCENE, [f"duration={options.seconds}", "diverged_beyond=1e9", "run.verdict=window"], kinds)
    scenes = ablations(everything)
    seen: dict[str, list[float]] = {name: [] for name in scenes}
    for _ in range(options.repeats):
        for name in random.Random(len(seen[WHOLE])).sample(list(scenes), len(scenes)):
            seen[name].append(measured_us(scenes[name], kinds))
    show(seen, options.repeats)


def show(seen: dict[str, list[float]], repeats: int) -> None:
    """A row a scene: median, quartiles, and what leaving the effect out saves."""
    table = Table(title=f"one process, medians of {repeats} repeats in random order; {machine()}", title_justify="left")
    for heading in ("scene", "us/tick", "quartiles", "saves"):
        table.add_column(heading, justify="left" if heading == "scene" else "right")
    whole = statistics.median(next(iter(seen.values())))
    for name, values in seen.items():
        low, middle, high = statistics.quantiles(values, n=4)
        scene = name if name in (WHOLE, AGAIN, NONE) else f"without {name}"
        table.add_row(scene, f"{middle:.1f}", f"{low:.1f} - {high:.1f}", f"{whole - middle:+.1f}")
    Console(width=110).print(table)


if __name__ == "__main__":
    main()
