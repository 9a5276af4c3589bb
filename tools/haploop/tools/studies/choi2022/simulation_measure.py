"""The shortfall of each claim of section V.A in runs of Fig. 6 under an interpretation, and the nearest one."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from haploop.controller.dissipation import registry
from haploop.launch.batch.run import run_batch
from haploop.launch.spec import RunFailed
from haploop.logger.log.recording import Recording
from haploop.logger.summary import Summary
from haploop.protocol.scene.scene import Scene, by_window
from haploop.tools.render.units import amount
from haploop.tools.search.random import Effort, Point, Row, evaluated
from haploop.tools.studies.choi2022.claims import Claim, Finding, words_of
from haploop.tools.studies.choi2022.interpretations import MOST, Found, searched, summed_up
from haploop.tools.studies.choi2022.simulation import BASE, NEAREST, OURS, SPACE, as_row, scene_of
from haploop.tools.studies.choi2022.work import Run, Work, faster_m, run, strongest_Hz

WHOLE = Effort(structures=64, each=64, rounds=4, best=3, children=64, finalists=3, neighbours=64)
SMALL = Effort(structures=2, each=4, rounds=1, best=1, children=2, neighbours=2)
# "Any change resulted in the behavior becoming worse": these multiples of 0.8 N s/m stand for any change.
OTHER_DAMPING = (0.5, 0.75, 4.0 / 3.0, 2.0)
# (a) is run again for so many times as long: what still grows is no limit cycle.
LONGER, GROWN = 3.0, 1.5
# "Small": peak to peak, a tenth of the way to the wall. "Large", "considerably": by this factor.
SMALL_M, MUCH = 6e-3, 2.0
# A book that was never this share of its end below zero, or below its own peak, is passive, or monotone.
SLACK = 0.05
# Least amplitude of a vibration that is felt (Israr, Choi and Tan 2006): at 10 Hz, m.
_FELT_M = 26e-6
_SETTLED_S, _HIGH_HZ, _NEARLY_ALL = 9.0, 50.0, 0.9
_NAMES = {"base": OURS, "nearest": "the nearest"}

# The measure: for each claim how far it is from holding, 0.0 where it holds; ln of the factor that is missing where it
# is a matter of a factor, 1 where it is one of yes or no, MOST where the run diverged. The sum of them is the distance
# of an interpretation from the paper. Every claim of V.A is here, and what the paper says only by its figures
# ("monotone").
CLAIMS: dict[str, str] = words_of(6, "tested")
ASIDE: dict[str, str] = words_of(6, "aside")


def search(work: Work) -> Found[Point]:
    """Searches for the nearest; stages are "base", "nearest" (numbers of three digits), and those of the search."""
    found = searched(work, SPACE, measure, SMALL if work.small else WHOLE)
    nearest = found.best.point.rounded(3)
    ends = [*evaluated("base", measure, [[BASE]]), *evaluated("nearest", measure, [[nearest]])]
    return Found([trial.row for trial in [*ends, *found.trials, *found.neighbours]], nearest)


def measure(interpretations: Sequence[Point]) -> list[Row]:
    """Returns a row for each interpretation: its ``as_row``, the swings in m, and by name the shortfall of each claim.

    The interpretations are best of one structure, so that they run in one batch.
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
        """1.0 unless it ends above 0 and was never below by more than the slack."""
        return float(not (self.end > 0.0 and self.least >= -SLACK * self.end))

    @property
    def not_monotone(self) -> float:
        """1.0 unless it ends above 0 and never fell by more than the slack."""
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
    cycles = {name: result.get("verdict") in ("limit-cycle", "diverged") for name, result in runs.items()}
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
        "c steady": float(runs["c"].get("verdict") != "steady"),
        "c truly passive": books["true"].not_passive,
        "c beats bidirectional": over(swing["c"], swing["bidirectional"]),
    }
    swings = {f"swing {name}_m": value for name, value in swing.items()}
    return as_row(interpretation) | swings | found | summed_up(found, CLAIMS)


def over(value: float, most: float) -> float:
    """Returns ln(value / most) where ``value`` is more than ``most``, else 0; MOST at most."""
    return min(MOST, math.log(value / most)) if value > most > 0.0 else MOST if value > most else 0.0


def findings_on_logs(claims: Mapping[str, Claim], runs: Mapping[str, Mapping[str, Run]]) -> list[Finding]:
    """Tests the claims "heat", "felt", "noise" and "phases" on the runs of both interpretations."""

    def listed(values: Mapping[str, str]) -> str:
        return "; ".join(f"{_NAMES[name]} {value}" for name, value in values.items())

    settled = _heat_over_leak(run(replace(scene_of(BASE, "a"), duration=_SETTLED_S)).log)
    swings = {name: of["a"].summary["window"]["oscillation_m"] for name, of in runs.items()}
    felt = {name: f"{amount(swings[name], 'm')} at {strongest_Hz(of['a'].log):.0f} Hz" for name, of in runs.items()}
    fast = {name: [faster_m(of[panel].log, _HIGH_HZ) for panel in "bc"] for name, of in runs.items()}
    noise = {name: f"{amount(b, 'm')} with damping, {amount(c, 'm')} with inertia" for name, (b, c) in fast.items()}
    quieter = [name for name, (b, c) in fast.items() if c < b]
    phases = {name: _in_phase(of["c"].log) for name, of in runs.items()}
    return [
        claims["heat"].holds_if(abs(settled - 1.0) < 0.05, settled_s=_SETTLED_S, ratio=settled),
        claims["felt"].holds_if(min(swings.values()) > _FELT_M, swings=listed(felt)),
        claims["noise"].holds_if(
            len(quieter) == len(fast),
            bool(quieter),
            high_Hz=_HIGH_HZ,
            noise=listed(noise),
            where=NEAREST if quieter == ["nearest"] else OURS,
        ),
        claims["phases"].holds_if(
            min(phases.values()) > _NEARLY_ALL,
            max(phases.values()) > _NEARLY_ALL,
            shares=listed({name: f"{100.0 * value:.1f} %" for name, value in phases.items()}),
        ),
    ]


def _in_phase(log: Recording) -> float:
    """Returns the share of the ticks with a force at which the acceleration has the direction of motion."""
    force, v, a = (log["/controller"][name] for name in ("dissipation.0", "v", "a"))
    return float(np.mean((v * a)[force != 0.0] >= 0.0))


def _heat_over_leak(log: Recording) -> float:
    """Returns the heat of both dampers over what the wall gave beyond what it took, in whole swings of the last second.

    A swing begins where x rises through its mean.
    """
    energy, x = log["/energy"], log["/controller"]["x"]
    since = len(x) - round(1.0 / (energy["timestamp"][1] - energy["timestamp"][0]))
    above = x[since:] > x[since:].mean()
    rises = since + np.flatnonzero(above[1:] & ~above[:-1])
    first, last = int(rises[0]), int(rises[-1])
    heat, wall = energy["device_heat"] + energy["hand_heat"], energy["wall.true"]
    return float((heat[last] - heat[first]) / (wall[first] - wall[last]))
