"""Makes the stored references of the accuracy scenes anew: python -m haploop.tools.reference.make [SCENE...]

The continuous plant in 50 decimal digits, the controller in the floats it has. Needs mpmath, of the dev extra.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from mpmath import mp, mpf

from haploop.launch.scene.file import load
from haploop.tools.reference.loop import Closed, close_loop
from haploop.tools.reference.nearest import (
    REFERENCES,
    compares_pointwise,
    difference_m,
    exactly,
    growths,
    problem_hash,
    statistics,
)
from haploop.tools.reference.plant import ContinuousPlant, IntegratedPlant
from haploop.tools.trajectory import trajectory

SCENES = Path(__file__).parents[4] / "launch/scenes/accuracy"
DIGITS, FEWER_DIGITS = 50, 30
_CHECK_RATE = 100_000

Done = Callable[[], None]


def in_digits(scene: dict[str, Any], digits: int, tick_done: Done = lambda: None) -> Closed:
    """Runs the loop around the continuous plant in so many decimal digits."""
    with mp.workdps(digits):
        plant = ContinuousPlant(scene, mpf(1) / scene["clock"]["control_rate"])
        return close_loop(scene, plant, _in_digits, tick_done)


def _in_digits(load: Fraction) -> Any:
    return mpf(load.numerator) / load.denominator


def integrated(scene: dict[str, Any], tick_done: Done = lambda: None) -> Closed:
    """Runs the loop around the plant integrated by DOP853, in floats."""
    with mp.workdps(FEWER_DIGITS):
        plant = IntegratedPlant(scene, 1.0 / scene["clock"]["control_rate"])
    return close_loop(scene, plant, float, tick_done)


def reference(name: str, scene: dict[str, Any], say: Callable[[str], Done]) -> dict[str, Any]:
    """Makes the reference of a resolved scene as it is stored.

    Args:
        name, scene: of the reference.
        say: names the next step of the work; what it returns is called after each tick.
    """
    truth = in_digits(scene, DIGITS, say(f"{name}: {DIGITS} digits"))
    fewer = in_digits(scene, FEWER_DIGITS, say(f"{name}: {FEWER_DIGITS} digits"))
    numerical = integrated(scene, say(f"{name}: DOP853"))
    exact = trajectory(exactly(scene, _CHECK_RATE))
    checks = {
        f"{FEWER_DIGITS}_digits": difference_m(truth.x_m, fewer.x_m),
        "dop853": difference_m(truth.x_m, numerical.x_m),
        f"exact_{_CHECK_RATE // 1000}_kHz": difference_m(truth.x_m, exact.x_m),
    }
    fewer_m, numerical_m, exact_m = checks.values()
    growth = growths(scene, scene["clock"]["plant_rate"])
    how = (
        f"The continuous plant in {DIGITS} digits under the program's own controller; in {FEWER_DIGITS} digits it is "
        f"at most {fewer_m:.1e} m, by DOP853 at 1e-13 {numerical_m:.1e} m away, and the exact method at "
        f"{_CHECK_RATE // 1000} kHz {exact_m:.1e} m. A start moved by up to 0.1 um gets at most "
        f"{max(growth.values()):.3g} times as far away."
    )
    return {
        "scene": name,
        "problem": problem_hash(scene),
        "how": how,
        "verdict": truth.verdict,
        "pointwise": compares_pointwise(growth),
        # Not from the exact method, which is itself to be judged by this reference.
        "error_m": max(fewer_m, numerical_m),
        "checks_m": checks,
        "growth": growth,
        "statistics": statistics(scene, np.array(truth.x_m), np.array(truth.v_m_s)),
        "x_m": truth.x_m,
        "v_m_s": truth.v_m_s,
    }


def main(names: list[str]) -> None:
    """Makes some references, or all, with progress."""
    from rich.progress import Progress

    from haploop.tools.render.terminal import console

    paths = [SCENES / f"{name}.toml" for name in names] or sorted(SCENES.glob("*.toml"))
    REFERENCES.mkdir(exist_ok=True)
    with Progress(console=console(stderr=True)) as progress:
        for path in paths:
            scene = load(path)
            ticks = round(scene["duration"] * scene["clock"]["control_rate"])
            task = progress.add_task(path.stem, total=ticks)

            def say(what: str, task: Any = task) -> Done:
                progress.reset(task, description=what)
                return lambda: progress.advance(task)

            data = reference(path.stem, scene, say)
            target = REFERENCES / f"{path.stem}.json"
            target.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
            progress.update(task, completed=ticks, description=f"{path.stem}: done")
            print(f"{target}\n  {data['how']}")


if __name__ == "__main__":
    main(sys.argv[1:])
