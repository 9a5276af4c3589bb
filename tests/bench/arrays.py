"""Arrays of scenes against the loop in one process and against a compiled kernel, on one core."""

from __future__ import annotations

import argparse
import importlib.util
import statistics
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from history import keep
from rich.console import Console
from rich.table import Table

from haploop.controller.dissipation import Element, registry
from haploop.launch.batch import batch
from haploop.launch.runs.in_batch import run_batch
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.file import load
from haploop.protocol.scene.paths import with_value
from haploop.protocol.scene.scene import Scene
from haploop.tools.machine import machine

sys.path.append(str(Path(__file__).parents[1]))  # where the oracles are
SCENE = Path(__file__).parents[2] / "launch" / "scenes" / "fig6b.toml"


def paper_scenes(count: int, duration_s: float | None = None) -> list[Scene]:
    """Figure 6(b) over a square of stiffness and damping, from steady contacts to wide limit cycles."""
    base = load(SCENE, ["run.verdict=window", *([f"duration={duration_s}"] if duration_s else [])])
    side = round(count**0.5)
    return [
        with_value(with_value(base, "wall.stiffness", stiffness), "dissipation.0.damping", damping)
        for stiffness in np.linspace(20.0, 400.0, side).tolist()
        for damping in np.linspace(0.02, 2.0, side).tolist()
    ]


def measured_us(run: Callable[[], Any], ticks: int) -> float:
    """Processor time per tick of one scene."""
    began = time.process_time()
    run()
    return (time.process_time() - began) / ticks * 1e6


def by_numpy(scenes: list[Scene], kinds: dict[str, type[Element]]) -> None:
    """The arrays as they are where numba is not installed."""
    pays, batch.LOOPS.pays = batch.LOOPS.pays, sys.maxsize
    try:
        run_batch(scenes, kinds)
    finally:
        batch.LOOPS.pays = pays


def check_kernel(scenes: list[Scene], kinds: dict[str, type[Element]]) -> None:
    """That the yardstick does the same work: its books are those of the arrays."""
    from oracles.array_kernel import BOOKS, FIGURES, run_kernel

    for result, row in zip(run_batch(scenes, kinds), run_kernel(scenes, True)[:, FIGURES:], strict=True):
        energy, found = result["energy"], dict(zip(BOOKS, row.tolist(), strict=True))
        wall, (element,) = energy["wall"], energy["elements"]
        expected = {name: energy[f"{name}_J"] for name in ("hand_work", "device_heat", "hand_heat", "moved")}
        expected |= {f"wall.{kind}": wall[f"{kind}_J"] for kind in ("sampled", "true")} | {"ideal": wall["ideal_J"]}
        expected |= {f"damping.{kind}": element[f"{kind}_J"] for kind in ("sampled", "true")}
        expected |= {"kinetic": energy["stored_J"] - found["spring"]}
        for name, value in expected.items():
            if abs(found[name] - value) > 1e-12 * found["moved"]:
                raise SystemExit(f"The kernel books {found[name]} J as {name}, the arrays {value} J.")


def main() -> None:
    """Measure in turn, repeat, print medians and ratios."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=10_000)
    parser.add_argument("--duration", type=float, help="s; that of the scene when not given")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--compare", type=Path, help="history whose last run on such a machine this one is held to")
    options = parser.parse_args()
    scenes, kinds = paper_scenes(options.scenes, options.duration), registry()
    few = scenes[:: max(1, len(scenes) // 20)]
    ticks_of = round(scenes[0].duration * scenes[0].clock.control_rate)
    rows: dict[str, tuple[Callable[[], Any], int]] = {
        "one process, with the books": (lambda: [run_in_process(scene, kinds) for scene in few], len(few)),
        "arrays, with the books": (lambda: run_batch(scenes, kinds), len(scenes)),
        "arrays, with the books, by NumPy alone": (lambda: by_numpy(scenes, kinds), len(scenes)),
        "arrays, without": (lambda: run_batch(scenes, kinds, energy=False), len(scenes)),
    }
    if importlib.util.find_spec("numba"):
        from oracles.array_kernel import run_kernel

        check_kernel(few, kinds)
        rows["numba kernel, with the books"] = (lambda: run_kernel(scenes, True), len(scenes))
        rows["numba kernel, without"] = (lambda: run_kernel(scenes, False), len(scenes))
    if importlib.util.find_spec("jax"):
        from haploop.launch.runs.in_jax import compiled_results, compiling

        for name, energy in {"compiled, with the books": True, "compiled, without": False}.items():
            run = partial(lambda energy: list(compiled_results(scenes, kinds, energy=energy, least=0)), energy)
            run()
            rows[name] = (run, len(scenes))
        programs, seconds = compiling()
        print(f"{programs} programs compiled in {seconds:.1f} s, before all that is measured")
    seen: dict[str, list[float]] = {name: [] for name in rows}
    for _ in range(options.repeats):
        for name, (run, count) in rows.items():
            seen[name].append(measured_us(run, count * ticks_of))
    table = Table(
        title=f"{len(scenes)} scenes of {scenes[0].duration:g} s, medians of {options.repeats}; {machine()}",
        title_justify="left",
    )
    for heading in ("what", "µs per tick", "least - most", "in one process / this", "this / kernel"):
        table.add_column(heading)
    medians = {name: statistics.median(values) for name, values in seen.items()}
    alone = medians["one process, with the books"]
    yardsticks = dict.fromkeys(medians, "")
    for name, median in medians.items():
        of = "numba kernel, without" if name.endswith("without") else "numba kernel, with the books"
        kernel = medians.get(of)
        yardsticks[name] = of if kernel and name != of else ""
        spread = f"{min(seen[name]):.3g} - {max(seen[name]):.3g}"
        ratio = f"{median / kernel:.2f}" if kernel else ""
        table.add_row(name, f"{median:.3g}", spread, f"{alone / median:.1f}", ratio)
    Console(width=120).print(table)
    keep(f"arrays, {len(scenes)} scenes of {scenes[0].duration:g} s", seen, yardsticks, options.compare)


if __name__ == "__main__":
    main()
