"""Interpretations of the experiments (Choi et al. 2022, section V.B): the walls that each element steadies under them,
the claims that then hold, and the search for the one nearest to the paper.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TypedDict

import numpy as np

from haploop.launch.scene.file import load
from haploop.logger.summary import Summary
from haploop.protocol.scene.scene import Scene
from haploop.tools.search.bisect import climb
from haploop.tools.search.random import Effort, Point, Row, Scale
from haploop.tools.studies.choi2022.answers import Answers
from haploop.tools.studies.choi2022.device import KINDS, Setup, elements_of
from haploop.tools.studies.choi2022.device import nearest as nearest_of_scene_file
from haploop.tools.studies.choi2022.interpretations import (
    Found,
    InterpretationSpace,
    decider,
    interval,
    often,
    options,
    searched,
    summed_up,
    tables_of,
)
from haploop.tools.studies.choi2022.steadiness import (
    BRIEFLY_S,
    STEP_N_M,
    STIFFNESSES,
    is_steady,
    largest,
    pressed,
    run_all,
)

SPACE = InterpretationSpace.of_figure(
    7,
    # Delays are whole plant steps.
    scales={"delay_s": Scale(1e-4, 0.0, 2e-3)},
    # As in a scene file: what is steady may depend on the fourth digit.
    digits=3,
    labels={"friction_N": "dry friction (N)", "acceleration": "acceleration of"},
)
WHOLE = Effort(structures=24, each=24, rounds=2, best=3, groups=3, children=8, neighbours=24, far=0.15, close=0.05)
SMALL = Effort(structures=1, each=2, rounds=1, best=1, children=1, neighbours=1, far=0.15)
# For each claim of V.B, in words, how it is tested.
CLAIMS: dict[str, str] = tables_of(7)["tested"]

NAMES = (*KINDS, "both")
_MASSES = (0.0009, 0.0018, 0.0035, 0.006, 0.009, 0.014, 0.02, 0.03)
# Sizes in N s/m and kg; the paper's own are among them: 2.7 N s/m, 1.8 g, and 2.15 N s/m with 9 g.
SIZES: dict[str, tuple[tuple[float, ...], ...]] = {
    KINDS[0]: ((0.0,),),
    KINDS[1]: tuple((b,) for b in (0.3, 0.8, 1.5, 2.15, 2.7, 4.0, 6.0, 9.0)),
    KINDS[2]: tuple((m,) for m in _MASSES),
    KINDS[3]: tuple((m,) for m in _MASSES),
    "both": tuple((b, m) for b in (0.8, 2.15, 4.0, 7.0) for m in (0.0035, 0.009, 0.02)),
}
# For each element of NAMES the steady sizes, shape (stiffnesses, sizes).
Steady = dict[str, np.ndarray]

# The largest stiffness in N/m steadied in the paper: Fig. 10 (damping and bidirectional inertia "also 4.5 N/mm"),
# Fig. 9 (5.5), and section V.B.4 (6.3). The grid has a point every 500 N/m, so that one step away is no disagreement.
PAPER = {"damping": 4500.0, "bidirectional-inertia": 4500.0, "unidirectional-inertia": 5500.0, "both": 6300.0}
# Sections V.B.2 and V.B.4: what was compared in Fig. 8, and the pair of Figs. 11 to 13.
BOOKED_DAMPING, BOOKED_KG, BOOKED_AT_N_M = 2.7, 0.0018, (4500.0, 5000.0)
PAIR, PAIR_AT_N_M = (2.15, 0.009), 6300.0
# "Particularly for lower values of inertia": up to the paper's largest.
LOW_KG = 0.009
# This small a part of an inertia is booked beside a damper without being felt.
_UNFELT = 1e-6
# Files that figure 7 leaves for the figures after it.
SHARES, SCENE = "figure_7_shares.json", "figure_7.toml"


def setup_of(point: Point) -> Setup:
    """Returns a point of the space as a setup, without friction."""
    return Setup(**point.numbers, **point.choices)


def search(answers: Answers) -> Found:
    """Searches for the nearest interpretation; the stages are those of the search, and "nearest".

    All are without friction, with which a run takes some forty times as long.
    """
    found = searched(answers, SPACE, measure, SMALL if answers.small else WHOLE, tie=gap_N_m)
    rows = [trial.row for trial in [*found.trials, *found.neighbours]]
    return Found([*rows, found.best.row | {"stage": "nearest"}], found.best.point)


def gap_N_m(row: Row) -> float:
    """Returns the sum of the differences between the four largest stiffnesses and those of the paper."""
    return sum(abs(row[f"{name}_N_m"] - stiffness) for name, stiffness in PAPER.items())


def stiffness_ladder(
    setups: Sequence[Setup], stiffnesses: np.ndarray = STIFFNESSES, names: Sequence[str] = NAMES
) -> list[Steady]:
    """Returns for each setup and element which sizes steady which walls, up to the first wall that no size steadies.

    The setups should share one structure, so that they run in one batch; the stiffnesses, in N/m, increase.
    """

    def ask(stiffness: float, going: Sequence[tuple[int, str]]) -> list[list[bool]]:
        scenes = [setups[i].scene(stiffness, elements_of(name, *size)) for i, name in going for size in SIZES[name]]
        steady = iter(map(is_steady, run_all([pressed(scene, BRIEFLY_S) for scene in scenes])))
        return [[next(steady) for _ in SIZES[name]] for _, name in going]

    members = [(i, name) for i in range(len(setups)) for name in names]
    found = [{name: np.zeros((len(stiffnesses), len(SIZES[name])), bool) for name in names} for _ in setups]
    for (i, name), rows in climb(members, stiffnesses.tolist(), ask, passes=any).items():
        found[i][name][: len(rows)] = rows
    return found


def largest_of(one: tuple[Setup, str]) -> float:
    """Returns the largest stiffness in N/m that an element steadies, with the sizes that the search tries."""
    setup, name = one
    [steady] = stiffness_ladder([setup], names=[name])
    return largest(steady[name])


def measure(points: Sequence[Point]) -> list[Row]:
    """Returns a row for each point: its setup, the largest stiffnesses, 0.0 for each claim that holds, its distance.

    The points should share one structure, so that they run in one batch.
    """
    setups = [*map(setup_of, points)]
    ladders = stiffness_ladder(setups)
    booked = run_all([_booked(setup, k) for setup in setups for k in BOOKED_AT_N_M], energy=True)
    pairs = run_all([pressed(setup.scene(PAIR_AT_N_M, elements_of("both", *PAIR)), BRIEFLY_S) for setup in setups])
    hardest = [_stiffest(setup, steady["both"]) for setup, steady in zip(setups, ladders, strict=True)]
    stiffest = run_all(hardest, energy=True)
    found = zip(setups, ladders, booked[::2], booked[1::2], pairs, stiffest, strict=True)
    return [_row(setup, steady, two, pair, most) for setup, steady, *two, pair, most in found]


def _booked(setup: Setup, stiffness: float) -> Scene:
    """Makes the scene of 2.7 N s/m with a millionth of both inertias, whose books are a millionth of the full ones."""
    inertias = elements_of(KINDS[2], _UNFELT * BOOKED_KG) + elements_of(KINDS[3], _UNFELT * BOOKED_KG)
    return setup.scene(stiffness, elements_of(KINDS[1], BOOKED_DAMPING) + inertias)


def _stiffest(setup: Setup, steady: np.ndarray) -> Scene:
    """Makes the scene of the stiffest wall that some pair steadies, with the middle one of the sizes that steady it."""
    rows = np.flatnonzero(steady.any(axis=1))
    sizes = np.flatnonzero(steady[rows[-1]]) if len(rows) else np.arange(len(SIZES["both"]))
    size = SIZES["both"][int(sizes[len(sizes) // 2])]
    return setup.scene(max(largest(steady), STIFFNESSES[0]), elements_of("both", *size))


def _taken_J(result: Summary) -> np.ndarray:
    if "energy" not in result:
        return np.full(3, np.nan)
    return np.array([element["sampled_J"] for element in result["energy"]["elements"]])


def _row(setup: Setup, steady: Steady, booked: Sequence[Summary], pair: Summary, most: Summary) -> Row:
    of = {name: largest(steady[name]) for name in NAMES}
    taken = [_taken_J(result) / (1.0, _UNFELT, _UNFELT) for result in booked]
    counts = steady[KINDS[1]].sum(axis=1)
    counts = counts[counts > 0]
    two, one = (steady[kind][:, [size <= (LOW_KG,) for size in SIZES[kind]]] for kind in KINDS[2:])
    of_pair = _taken_J(most)
    damping, two_way, one_way, together = (of[name] for name in NAMES[1:])
    found = {
        "8 more": all(bool((one[1:] > one[0]).all() and one[0] > 0.0) for one in taken),
        "9 damping ends": damping <= 5000.0,
        "9 inertia": one_way >= 5500.0,
        "10 narrows": len(counts) > 1 and bool(counts[-1] < counts[0]),
        "10 damping 4.5": abs(damping - 4500.0) <= STEP_N_M,
        "10 bidirectional 4.5": abs(two_way - 4500.0) <= STEP_N_M,
        "10 helps": min(damping, two_way, one_way) > of[KINDS[0]],
        "10 larger": one_way > max(damping, two_way),
        "10 wider": bool(steady[KINDS[3]].sum() > steady[KINDS[2]].sum()),
        "10 exclusive": bool((two & ~one).any() and (one & ~two).any() and not (one & two).any()),
        "11 more": together > max(damping, one_way),
        "11 up to 6.3": abs(together - PAPER["both"]) <= STEP_N_M,
        "12 pair": is_steady(pair),
        "13 more": together > 0.0 and bool(of_pair[1] > of_pair[0]),
    }
    row = setup.as_dict() | {f"{name}_N_m": stiffness for name, stiffness in of.items()}
    for name, one in zip(("lower", "higher"), taken, strict=True):
        row |= {f"{name} {i}_J": float(one[i]) for i in range(3)}
    shortfalls = {name: float(not holds) for name, holds in found.items()}
    # Steps by which the four stiffnesses differ from the paper's, beyond one each.
    steps = sum(max(abs(of[name] - stiffness) / STEP_N_M - 1.0, 0.0) for name, stiffness in PAPER.items())
    return row | shortfalls | summed_up(shortfalls, CLAIMS, steps)


class Share(TypedDict):
    """Share of interpretations under which a claim holds, as text with its interval, and the likeliest option or ""."""

    share: float
    often: str
    likeliest: str


class Shares(TypedDict):
    """Content of ``SHARES``: the number of interpretations, and the share of them under which each claim holds."""

    small: bool
    interpretations: int
    claims: dict[str, Share]


def shares_of(rows: Sequence[Row], small: bool) -> str:
    """Returns as JSON how often each claim holds, and the option with which it is likeliest to hold."""
    there = options(rows, SPACE)
    kept: Shares = {"small": small, "interpretations": len(rows), "claims": {}}
    for name in CLAIMS:
        held, decides = interval(rows, name, SPACE), decider(there, name)
        likeliest = str(decides.best) if decides else ""
        kept["claims"][name] = {"share": held.value, "often": often(held), "likeliest": likeliest}
    return json.dumps(kept, indent=2, ensure_ascii=False) + "\n"


def shares_in(out: Path, small: bool) -> Shares | None:
    """Returns what figure 7 left in the directory; None if it was not made, or not with the same ``small``."""
    file = out / SHARES
    kept = json.loads(file.read_text(encoding="utf-8")) if file.exists() else None
    return kept if kept and kept["small"] == small else None


def nearest(answers: Answers) -> Setup:
    """Returns the nearest setup: the one that figure 7 left in the directory, else that of ``premium_press.toml``."""
    found = shares_in(answers.out, answers.small)
    return Setup.from_scene(load(answers.out / SCENE)) if found else nearest_of_scene_file()
