"""Runs of Fig. 6 under interpretations of one structure, and how far each claim of section V.A is from holding."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from haploop.controller.dissipation import registry
from haploop.launch.batch.run import run_batch
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.spec import RunFailed
from haploop.logger.log.recording import MemoryLog
from haploop.tools.search.random import Point
from haploop.tools.studies.choi2022.simulation.interpretation import as_row, scene_of

# A shortfall no larger than this is none; none counts for more than the most (a factor of 20).
NONE, MOST = 0.0, 3.0
# "Any change resulted in the behavior becoming worse": these multiples of 0.8 N s/m stand for any change.
OTHER_DAMPING = (0.5, 0.75, 4.0 / 3.0, 2.0)
# (a) is run again for so many times as long: what still grows is no limit cycle.
LONGER, GROWN = 3.0, 1.5
# "Small": peak to peak, a tenth of the way to the wall. "Large", "considerably": by this factor.
SMALL_M, MUCH = 6e-3, 2.0
# A book that was never this share of its end below zero, or below its own peak, is passive, or monotone.
SLACK = 0.05

# The measure: for each claim how far it is from holding, 0.0 where it holds; ln of the factor that is missing where it
# is a matter of a factor, 1 where it is one of yes or no, MOST where the run diverged. The sum of them is the distance
# of an interpretation from the paper. Every claim of V.A is here, and what the paper says only by its figures
# ("monotone").
CLAIMS: dict[str, str] = {
    "a cycles": "(a) is a limit cycle",
    "a bounded": (
        "(a) does not diverge, and does not go on growing: three times as long, its swing is at most 1.5 times"
    ),
    "a small": "(a) swings by no more than 6 mm peak to peak",
    "wall unstable": "0.15 N/mm alone is no steady contact",
    "b bounded": "(b) does not diverge",
    "b large": "(b) is a limit cycle at least twice as wide as (a)",
    "b leaves": "(b) leaves the wall",
    "b helps": "(b) swings less than 0.15 N/mm alone",
    "b best": "(b) swings no more than with 1/2, 3/4, 4/3 and 2 times the damping",
    "c steadied": "(c) does not leave the wall",
    "c smaller": "(c) swings at most half as wide as (b)",
    "c passive": "(c): the sampled book of the inertia ends above 0 and is never below by more than 5 % of its end",
    "c monotone": "(c): the sampled book never falls by more than 5 % of its end",
}
# Beside them, and in no sum.
ASIDE: dict[str, str] = {
    "c steady": "(c) comes to the verdict steady",
    "c truly passive": "(c): the same of the true book, which counts the force that acts, 2 ms late",
    "c beats bidirectional": "(c) swings no more than with bidirectional inertia of the same mass",
}


def shortfalls(interpretations: Sequence[Point]) -> list[dict[str, Any]]:
    """Returns a row for each interpretation: its ``as_row``, the swings in m, and by name the shortfall of each claim.

    Args:
        interpretations: best of one structure, so that they run in one batch.
    """
    variants = [_variants(interpretation) for interpretation in interpretations]
    scenes = [of_one[name] for name in variants[0] for of_one in variants]
    results = run_batch(scenes, registry(), energy=False)
    count = len(interpretations)
    runs = {name: results[i * count : (i + 1) * count] for i, name in enumerate(variants[0])}
    return [
        _row(interpretation, {name: of_all[i] for name, of_all in runs.items()}, _books(variants[i]["c"]))
        for i, interpretation in enumerate(interpretations)
    ]


def _variants(interpretation: Point) -> dict[str, dict[str, Any]]:
    """Returns the scenes that are run, by name."""
    a, b, c = (scene_of(interpretation, panel) for panel in "abc")
    [damping], [inertia] = b["dissipation"], c["dissipation"]
    without = {key: value for key, value in b.items() if key != "dissipation"}
    return {
        "a": a,
        "a longer": a | {"duration": LONGER * a["duration"]},
        "wall": without,
        "b": b,
        "c": c,
        "bidirectional": c | {"dissipation": [inertia | {"kind": "bidirectional-inertia"}]},
    } | {
        f"b {factor:.3g}": b | {"dissipation": [damping | {"damping": factor * damping["damping"]}]}
        for factor in OTHER_DAMPING
    }


def _books(scene: dict[str, Any]) -> dict[str, tuple[float, float, float]]:
    """Returns end, least and greatest fall in J of each book of the element (``extent``); NaN where the run failed."""
    memory = MemoryLog()
    scene = scene | {"run": {**scene["run"], "log": "ticks"}}
    try:
        run_in_process(scene, registry(), memory=memory)
    except RunFailed:
        return dict.fromkeys(("sampled", "true"), (math.nan, math.nan, math.nan))
    energy = memory.recording()["/energy"]
    [name] = {key.rpartition(".")[0] for key in energy if "inertia" in key}
    return {book: extent(energy[f"{name}.{book}"]) for book in ("sampled", "true")}


def extent(book_J: np.ndarray) -> tuple[float, float, float]:
    """Returns the end of a running energy, its least value and its greatest fall below its highest value before, J."""
    fall = np.maximum.accumulate(book_J) - book_J
    return float(book_J[-1]), float(book_J.min()), float(fall.max())


def _row(
    interpretation: Point, runs: dict[str, dict[str, Any]], books: dict[str, tuple[float, float, float]]
) -> dict[str, Any]:
    swing = {name: _swing_m(result) for name, result in runs.items()}
    out = {name: result["window"]["outside_fraction"] for name, result in runs.items() if "window" in result}
    lost = {name: _is_lost(result) for name, result in runs.items()}
    cycles = {name: result.get("verdict") in ("limit-cycle", "diverged") for name, result in runs.items()}
    others = [swing[f"b {factor:.3g}"] for factor in OTHER_DAMPING]
    found = {
        "a cycles": float(not cycles["a"]),
        "a bounded": MOST if lost["a"] or lost["a longer"] else over(swing["a longer"], GROWN * swing["a"]),
        "a small": over(swing["a"], SMALL_M),
        "wall unstable": float(not cycles["wall"]),
        "b bounded": MOST * lost["b"],
        "b large": over(MUCH * swing["a"], swing["b"]) + float(not cycles["b"]),
        "b leaves": float(out.get("b", 0.0) == 0.0),
        "b helps": over(swing["b"], swing["wall"]),
        "b best": max(over(swing["b"], other) for other in others),
        "c steadied": MOST if lost["c"] else math.log1p(10.0 * out["c"]),
        "c smaller": over(MUCH * swing["c"], swing["b"]),
        "c passive": _not_passive(books["sampled"]),
        "c monotone": _not_monotone(books["sampled"]),
        "c steady": float(runs["c"].get("verdict") != "steady"),
        "c truly passive": _not_passive(books["true"]),
        "c beats bidirectional": over(swing["c"], swing["bidirectional"]),
    }
    swings = {f"swing {name}_m": value for name, value in swing.items()}
    distance = sum(min(MOST, found[name]) for name in CLAIMS)
    holding = sum(found[name] == NONE for name in CLAIMS)
    every = {"all": float(holding < len(CLAIMS)), "distance": distance, "holding": holding}
    return as_row(interpretation) | swings | found | every


def over(value: float, most: float) -> float:
    """Returns ln(value / most) where ``value`` is more than ``most``, else 0; MOST at most."""
    return min(MOST, math.log(value / most)) if value > most > 0.0 else MOST if value > most else NONE


def _swing_m(result: dict[str, Any]) -> float:
    """Returns the swing peak to peak in the last half second; infinite for a run that diverged or failed."""
    return math.inf if _is_lost(result) else result["window"]["oscillation_m"]


def _is_lost(result: dict[str, Any]) -> bool:
    return result.get("verdict", "diverged") == "diverged"


def _not_passive(book: tuple[float, float, float]) -> float:
    end, least, _ = book
    return float(not (end > 0.0 and least >= -SLACK * end))


def _not_monotone(book: tuple[float, float, float]) -> float:
    end, _, fall = book
    return float(not (end > 0.0 and fall <= SLACK * end))
