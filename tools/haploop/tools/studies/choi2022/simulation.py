"""Interpretations of the paper's simulation (Choi et al. 2022, section V.A): their scenes, and how far each claim is
from holding in their runs.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from haploop.controller.dissipation import registry
from haploop.launch.runs.in_batch import run_batch
from haploop.launch.spec import RunFailed
from haploop.logger.summary import Summary
from haploop.logger.verdict.measures import NO_SWING, SWINGING
from haploop.protocol.scene.effects import Noise
from haploop.protocol.scene.estimators import Acceleration, Velocity
from haploop.protocol.scene.hand_force import Constant, HandForce, MinimumJerk, Ramp, Sine, Step
from haploop.protocol.scene.scene import Encoder, Scene, by_window
from haploop.tools.search.random import Effort, Point, Row, evaluated
from haploop.tools.studies.choi2022.answers import Answers
from haploop.tools.studies.choi2022.interpretations import (
    MOST,
    Found,
    InterpretationSpace,
    searched,
    summed_up,
    tables_of,
)
from haploop.tools.studies.choi2022.runs import fig6, hand_of, run, wall_of

SPACE = InterpretationSpace.of_figure(6, seeded=True)
# Our own interpretation, that of the scene files fig6a.toml to fig6c.toml.
BASE = SPACE.ours
WHOLE = Effort(structures=64, each=64, rounds=4, best=3, children=64, finalists=3, neighbours=64)
SMALL = Effort(structures=2, each=4, rounds=1, best=1, children=2, neighbours=2)
# For each claim of V.A, in words, how it is tested; those aside are in no sum. The shortfall of a claim is 0.0 where it
# holds, ln of the missing factor if the claim is about a factor, 1 if it is about yes or no, MOST where the run
# diverged.
CLAIMS: dict[str, str] = tables_of(6)["tested"]
ASIDE: dict[str, str] = tables_of(6)["aside"]

_REACH_N = -0.6  # holds the hand's spring of 10 N/m at the wall, 60 mm away
_STEP_AT_S = 0.1
# "Any change resulted in the behavior becoming worse": these multiples of 0.8 N s/m stand for any change.
OTHER_DAMPING = (0.5, 0.75, 4.0 / 3.0, 2.0)
# (a) is run again for this many times as long: what still grows is no limit cycle.
LONGER, GROWN = 3.0, 1.5
# "Small": peak to peak, a tenth of the way to the wall. "Large", "considerably": by this factor.
SMALL_M, MUCH = 6e-3, 2.0
# A book that never fell below zero, or below its own peak, by this share of its end is passive, or monotone.
SLACK = 0.05


def used_numbers(chosen: Mapping[str, Any]) -> list[str]:
    """Returns the keys of the numbers that matter under some choices."""
    keys = ["push_N", "resolution_m"]
    of_force = {"ramp": ["rise_s"], "minimum-jerk": ["rise_s"], "sine": ["swing_Hz", "swing_share"]}
    keys += of_force.get(chosen["force"], [])
    keys += ["noise_m", "noise_Hz"] if chosen["noise"] == "low-passed" else []
    keys += ["velocity_Hz"] if chosen["velocity"] == "low-passed" else []
    keys += ["acceleration_Hz"] if chosen["acceleration"].startswith("low-passed") else []
    return keys


def as_row(interpretation: Point) -> Row:
    """Returns choices, numbers and seed in one flat map; numbers that the choices leave unused are NaN."""
    used = used_numbers(interpretation.choices)
    numbers = {key: value if key in used else math.nan for key, value in interpretation.numbers.items()}
    return {**interpretation.choices, **numbers, "seed": interpretation.seed}


def scene_of(interpretation: Point, panel: str) -> Scene:
    """Returns the resolved scene of a panel of Fig. 6, "a", "b" or "c", under an interpretation."""
    base = fig6(panel)
    chosen, number = interpretation.choices, interpretation.numbers
    rest, reach_N = (wall_of(base).position, 0.0) if chosen["rest"] == "wall" else (0.0, _REACH_N)
    force = _force(chosen["force"], reach_N - number["push_N"], number)
    is_filtered = chosen["acceleration"].startswith("low-passed")
    return replace(
        base,
        duration=chosen["duration"],
        seed=interpretation.seed,
        hand=replace(hand_of(base), rest=rest, force=force),
        encoder=Encoder(resolution=number["resolution_m"], rounding=chosen["rounding"]),
        noise=Noise(deviation=number["noise_m"], cutoff=number["noise_Hz"]) if chosen["noise"] != "none" else None,
        velocity=Velocity(cutoff=number["velocity_Hz"]) if chosen["velocity"] == "low-passed" else None,
        acceleration=Acceleration(
            source="accelerometer" if "accelerometer" in chosen["acceleration"] else "encoder",
            cutoff=number["acceleration_Hz"] if is_filtered else None,
        ),
        dissipation=tuple(replace(element, acts=chosen["acts"]) for element in base.dissipation),
    )


def _force(kind: str, value: float, number: Mapping[str, float]) -> HandForce:
    forces: dict[str, HandForce] = {
        "ramp": Ramp(value=value, rise_time=number["rise_s"]),
        "minimum-jerk": MinimumJerk(value=value, rise_time=number["rise_s"]),
        "step": Step(value=value, at=_STEP_AT_S),
        "constant": Constant(value=value),
        "sine": Sine(amplitude=number["swing_share"] * number["push_N"], frequency=number["swing_Hz"], offset=value),
    }
    return forces[kind]


def search(answers: Answers) -> Found:
    """Searches for the nearest interpretation; stages are "base", "nearest" (three-digit numbers) and the search's."""
    found = searched(answers, SPACE, measure, SMALL if answers.small else WHOLE)
    nearest = found.best.point.rounded(3)
    ends = [*evaluated("base", measure, [[BASE]]), *evaluated("nearest", measure, [[nearest]])]
    return Found([trial.row for trial in [*ends, *found.trials, *found.neighbours]], nearest)


def measure(interpretations: Sequence[Point]) -> list[Row]:
    """Returns a row for each interpretation: its ``as_row``, the swings in m, and by name the shortfall of each claim.

    The interpretations should share one structure, so that they run in one batch.
    """
    variants = [_variants(interpretation) for interpretation in interpretations]
    names, count = list(variants[0]), len(interpretations)
    scenes = [by_window(of_one[name]) for name in names for of_one in variants]
    results = run_batch(scenes, registry(), energy=False)
    return [
        _row(interpretation, dict(zip(names, results[i::count], strict=True)), _books(variants[i]["c"]))
        for i, interpretation in enumerate(interpretations)
    ]


def _variants(interpretation: Point) -> dict[str, Scene]:
    a, b, c = (scene_of(interpretation, panel) for panel in "abc")
    [damping], [inertia] = b.dissipation, c.dissipation
    return {
        "a": a,
        "a longer": replace(a, duration=LONGER * a.duration),
        "wall": replace(b, dissipation=()),
        "b": b,
        "c": c,
        "bidirectional": replace(c, dissipation=(replace(inertia, name="bidirectional-inertia"),)),
    } | {
        f"b {factor:.3g}": replace(
            b, dissipation=(replace(damping, parameters={"damping": factor * damping.parameters["damping"]}),)
        )
        for factor in OTHER_DAMPING
    }


class Extent(NamedTuple):
    """End of a running energy, its least value and its greatest fall below its highest value before, J."""

    end: float
    least: float
    fall: float

    @classmethod
    def from_book(cls, book_J: np.ndarray) -> Extent:
        fall = np.maximum.accumulate(book_J) - book_J
        return cls(float(book_J[-1]), float(book_J.min()), float(fall.max()))

    @property
    def not_passive(self) -> float:
        """1.0 unless the book ends above 0 and was never below 0 by more than the slack."""
        return float(not (self.end > 0.0 and self.least >= -SLACK * self.end))

    @property
    def not_monotone(self) -> float:
        """1.0 unless the book ends above 0 and never fell by more than the slack."""
        return float(not (self.end > 0.0 and self.fall <= SLACK * self.end))


def _books(scene: Scene) -> dict[str, Extent]:
    try:
        energy = run(replace(scene, run=replace(scene.run, log="ticks"))).log["/energy"]
    except RunFailed:
        return dict.fromkeys(("sampled", "true"), Extent(math.nan, math.nan, math.nan))
    [name] = {key.rpartition(".")[0] for key in energy if "inertia" in key}
    return {book: Extent.from_book(energy[f"{name}.{book}"]) for book in ("sampled", "true")}


def _row(interpretation: Point, runs: dict[str, Summary], books: dict[str, Extent]) -> Row:
    lost = {name: result.get("verdict", "diverged") == "diverged" for name, result in runs.items()}
    # Peak to peak in the last half second; infinite for a run that diverged or failed.
    swing = {name: math.inf if lost[name] else result["window"]["oscillation_m"] for name, result in runs.items()}
    out = {name: result["window"]["outside_fraction"] for name, result in runs.items() if "window" in result}
    cycles = {name: result.get("verdict") in (SWINGING, "diverged") for name, result in runs.items()}
    found = {
        "a cycles": float(not cycles["a"]),
        "a bounded": MOST if lost["a"] or lost["a longer"] else over(swing["a longer"], GROWN * swing["a"]),
        "a small": over(swing["a"], SMALL_M),
        "wall unstable": float(not cycles["wall"]),
        "b bounded": MOST * lost["b"],
        "b large": over(MUCH * swing["a"], swing["b"]) + float(not cycles["b"]),
        "b leaves": float(out.get("b", 0.0) == 0.0),
        "b helps": over(swing["b"], swing["wall"]),
        "b best": max(over(swing["b"], swing[f"b {factor:.3g}"]) for factor in OTHER_DAMPING),
        "c steadied": MOST if lost["c"] else math.log1p(10.0 * out["c"]),
        "c smaller": over(MUCH * swing["c"], swing["b"]),
        "c passive": books["sampled"].not_passive,
        "c monotone": books["sampled"].not_monotone,
        "c steady": float(runs["c"].get("verdict") != NO_SWING),
        "c truly passive": books["true"].not_passive,
        "c beats bidirectional": over(swing["c"], swing["bidirectional"]),
    }
    swings = {f"swing {name}_m": value for name, value in swing.items()}
    return as_row(interpretation) | swings | found | summed_up(found, CLAIMS)


def over(value: float, most: float) -> float:
    """Returns ln(value / most) if ``value`` is more than ``most``, else 0; MOST at most."""
    return min(MOST, math.log(value / most)) if value > most > 0.0 else MOST if value > most else 0.0
