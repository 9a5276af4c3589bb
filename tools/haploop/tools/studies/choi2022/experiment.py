"""The search for the interpretation of the experiments nearest to the paper, and verdicts on what hangs on values that
nobody published: by the nearest interpretation, and by all that were tried.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any, TypedDict

from haploop.launch.scene.file import load
from haploop.tools.search.random import Effort, Point, Row, Scale
from haploop.tools.studies.choi2022.claims import ASSUMING, FAILS, Claim, Finding
from haploop.tools.studies.choi2022.device import Setup
from haploop.tools.studies.choi2022.device import nearest as nearest_of_scene_file
from haploop.tools.studies.choi2022.experiment_measure import gap_N_m, measure
from haploop.tools.studies.choi2022.interpretations import (
    Found,
    InterpretationSpace,
    Option,
    decider,
    holds,
    interval,
    often,
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
    """Searches for the nearest; stages are those of the search, and "nearest".

    All are without friction, which takes some forty times as long to run.
    """
    found = searched(work, SPACE, evaluate, SMALL if work.small else WHOLE, tie=gap_N_m)
    rows = [trial.row for trial in [*found.trials, *found.neighbours]]
    return Found([*rows, found.best.row | {"stage": "nearest"}], setup_of(found.best.point))


def describe(setup: Setup) -> str:
    return SPACE.describe(setup.as_dict(), (*SPACE.choices, *SPACE.bounds))


class _Share(TypedDict):
    """How often a claim holds, and in words with its interval; what it is likeliest with, and the nearest setup where.

    What it is likeliest with is "" for nothing.
    """

    share: float
    often: str
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
            "often": often(interval(rows, name, SPACE)),
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


def often_of(work: Work, tested: str) -> str:
    """Returns how often a claim holds at random, with its interval; "an unknown share" where no search was run."""
    kept = _shares(work)
    return kept["claims"][tested]["often"] if kept else "an unknown share"


def findings(work: Work, claims: Mapping[str, Claim], holding: Mapping[str, bool], /, **computed: Any) -> list[Finding]:
    """Finds of some claims, given whether they hold under the nearest interpretation (``finding``)."""
    return [finding(work, claims[name], is_so, **computed) for name, is_so in holding.items()]


def finding(work: Work, claim: Claim, is_so: bool, /, **computed: Any) -> Finding:
    """Finds that a claim holds under the nearest interpretation, else under others, often or rarely, else not at all.

    Args:
        claim: its assumption is what is assumed besides the nearest interpretation.
        is_so: whether it holds under the nearest.
        computed: what the claim's words name, for the nearest.
    """
    kept, numbers = _shares(work), claim.numbers.format(**computed)
    here = NEAREST + claim.assumption.format(**computed) if is_so else ""
    if not (claim.tested and kept):
        return (
            Finding(claim, ASSUMING, numbers, f"{here}, the only one tested")
            if is_so
            else Finding(claim, FAILS, numbers)
        )
    found = kept["claims"][claim.tested]
    numbers += f". In {found['often']} of {kept['interpretations']} random interpretations"
    another = f"another interpretation, likeliest with {found['likeliest']}" if found["likeliest"] else ""
    return Finding.by_share(claim, numbers, found["share"], here or another)
