"""The search for the interpretation of the experiments nearest to the paper, and verdicts on what hangs on values that
nobody published: by the nearest interpretation, and by all that were tried.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, TypedDict

from haploop.launch.scene.file import load
from haploop.tools.search.random import Effort, Point, Row, Scale
from haploop.tools.studies.choi2022.claims import ASSUMING, FAILS, Claim, Finding
from haploop.tools.studies.choi2022.device import FRICTION_N, Setup
from haploop.tools.studies.choi2022.device import nearest as nearest_of_scene_file
from haploop.tools.studies.choi2022.experiment_measure import gap_N_m, measure
from haploop.tools.studies.choi2022.interpretations import (
    Found,
    InterpretationSpace,
    Option,
    decider,
    holds,
    percent,
    searched,
    share,
)
from haploop.tools.studies.choi2022.work import Work

NEAREST = "[the nearest interpretation of the device](#figure-7)"
SHARES, SCENE = "figure_7_shares.json", "figure_7.toml"

SPACE = InterpretationSpace.from_words(
    7,
    # Delays are whole plant steps.
    scales={"delay_s": Scale(1e-4, 0.0, 2e-3)},
    # As a scene file has them: what is steady may hang on the fourth digit.
    digits=3,
    labels={"friction_N": "dry friction (N)", "acceleration": "acceleration of"},
)
WHOLE = Effort(structures=24, each=24, rounds=2, best=3, groups=3, children=8, neighbours=24, far=0.15, close=0.05)
SMALL = Effort(structures=1, each=2, rounds=1, best=1, children=1, neighbours=1, far=0.15)


def setup_of(point: Point) -> Setup:
    """Returns a point of the space as a setup, without friction."""
    return Setup(**point.numbers, **point.choices)


def evaluate(points: Sequence[Point]) -> list[Row]:
    return measure([setup_of(point) for point in points])


def search(work: Work) -> Found[Setup]:
    """Searches for the nearest; stages are those of the search, "nearest" and "friction".

    All are without friction, which takes some forty times as long to run; the nearest alone is run with it, too.
    """
    found = searched(work, SPACE, evaluate, SMALL if work.small else WHOLE, tie=gap_N_m)
    nearest = setup_of(found.best.point)
    rough = replace(nearest, friction_N=0.0 if work.small else FRICTION_N)
    [[with_friction]] = work.map_parallel("the nearest with friction", measure, [[rough]])
    ends = [found.best.row | {"stage": "nearest"}, with_friction | {"stage": "friction"}]
    return Found([*(trial.row for trial in [*found.trials, *found.neighbours]), *ends], nearest)


def describe(setup: Setup) -> str:
    return SPACE.describe(setup.as_dict(), (*SPACE.choices, *SPACE.bounds))


class _Share(TypedDict):
    """How often a claim holds, what it is likeliest with ("" for nothing), and the nearest setup where it does."""

    share: float
    likeliest: str
    nearest: Row | None


class _Shares(TypedDict):
    """What ``keep_shares`` leaves, as its JSON file holds it."""

    small: bool
    interpretations: int
    claims: dict[str, _Share]


def keep_shares(work: Work, claims: Sequence[str], rows: Sequence[Row], options: Sequence[Option]) -> None:
    """Leaves for the figures that follow how often each claim holds, what it is likeliest with, and where it holds.

    Of the interpretations under which a claim holds the one nearest to the paper is kept.
    """
    kept: _Shares = {"small": work.small, "interpretations": len(rows), "claims": {}}
    for name in claims:
        decides = decider(options, name)
        best = min((row for row in rows if holds(row, name)), key=lambda row: row["distance"], default=None)
        kept["claims"][name] = {
            "share": share(rows, name),
            "likeliest": str(decides.best) if decides else "",
            "nearest": Setup.from_row(best).as_dict() if best else None,
        }
    work.text(SHARES, json.dumps(kept, indent=2, ensure_ascii=False) + "\n")


def _shares(work: Work) -> _Shares | None:
    file = work.out / SHARES
    kept = json.loads(file.read_text(encoding="utf-8")) if file.exists() else None
    return kept if kept and kept["small"] == work.small else None


def nearest(work: Work) -> Setup:
    """Returns the nearest setup: that which figure 7 left in the directory, else that of ``premium_press.toml``."""
    return Setup.from_scene(load(work.out / SCENE)) if _shares(work) else nearest_of_scene_file()


def nearest_with(work: Work, tested: str) -> Setup | None:
    """Returns the random setup nearest to the paper for which a claim of the search holds, if one is known."""
    kept = _shares(work)
    values = kept["claims"][tested]["nearest"] if kept else None
    return Setup.from_row(values) if values else None


def findings(work: Work, claims: Mapping[str, Claim], holding: Mapping[str, bool], /, **computed: Any) -> list[Finding]:
    """Finds of some claims, given whether they hold under the nearest interpretation (``finding``)."""
    return [finding(work, claims[name], is_so, **computed) for name, is_so in holding.items()]


def finding(work: Work, claim: Claim, is_so: bool, /, **computed: Any) -> Finding:
    """Finds that a claim holds under the nearest interpretation, else under others, else not at all.

    Args:
        claim: its assumption is what is assumed besides the nearest interpretation.
        is_so: whether it holds under the nearest.
        computed: what the claim's words name, for the nearest.
    """
    kept, likeliest, numbers = _shares(work), "", claim.numbers.format(**computed)
    if claim.tested and kept:
        found = kept["claims"][claim.tested]
        numbers += f". In {percent(found['share'])} of {kept['interpretations']} random interpretations"
        likeliest = found["likeliest"] if found["share"] else ""
    if is_so:
        return Finding(claim, ASSUMING, numbers, NEAREST + claim.assumption.format(**computed))
    if likeliest:
        return Finding(claim, ASSUMING, numbers, f"another interpretation, likeliest with {likeliest}")
    return Finding(claim, FAILS, numbers)
