"""Verdicts on what hangs on values that nobody published: by the nearest interpretation, and by all that were tried."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from haploop.launch.scene.file import load
from haploop.tools.studies.choi2022.claims import Claim, Finding
from haploop.tools.studies.choi2022.experiment.setup import Setup
from haploop.tools.studies.choi2022.experiment.setup import nearest as nearest_of_scene_file
from haploop.tools.studies.choi2022.interpretations import Option, Row, decider, holds, percent, share
from haploop.tools.studies.choi2022.work import Work

NEAREST = "[the nearest interpretation of the device](#figure-7)"
SHARES, SCENE = "figure_7_shares.json", "figure_7.toml"


def nearest(work: Work) -> Setup:
    """Returns the nearest setup: that which figure 7 left in the directory, else that of ``premium_press.toml``."""
    return Setup.from_scene(load(work.out / SCENE)) if _shares(work) else nearest_of_scene_file()


def keep_shares(work: Work, claims: Sequence[str], rows: Sequence[Row], options: Sequence[Option]) -> None:
    """Leaves for the figures that follow how often each claim holds, what it is likeliest with, and where it holds.

    Of the interpretations under which a claim holds the one nearest to the paper is kept.
    """
    kept: dict[str, Any] = {"small": work.small, "interpretations": len(rows), "claims": {}}
    for name in claims:
        decides = decider(options, name)
        best = min((row for row in rows if holds(row, name)), key=lambda row: row["distance"], default=None)
        kept["claims"][name] = {
            "share": share(rows, name),
            "likeliest": str(decides.best) if decides else "",
            "nearest": Setup.from_row(best).as_dict() if best else None,
        }
    work.text(SHARES, json.dumps(kept, indent=2, ensure_ascii=False) + "\n")


def nearest_with(work: Work, tested: str) -> Setup | None:
    """Returns the random setup nearest to the paper for which a claim of the search holds, if one is known."""
    kept = _shares(work)
    values = kept["claims"][tested]["nearest"] if kept else None
    return Setup(**values) if values else None


def verdict_under_assumptions(
    work: Work, claim: Claim, is_so: bool, tested: str = "", more: str = "", **computed: Any
) -> Finding:
    """Finds that a claim holds under the nearest interpretation, else under others, else not at all.

    Args:
        is_so: whether it holds under the nearest.
        tested: name of the claim in the search, where that tests it.
        more: what is assumed besides the nearest interpretation.
        computed: what the claim's numbers name, for the nearest.
    """
    kept, likeliest, numbers = _shares(work), "", claim.numbers.format(**computed)
    if tested and kept:
        found = kept["claims"][tested]
        numbers += f". In {percent(found['share'])} of {kept['interpretations']} random interpretations"
        likeliest = found["likeliest"] if found["share"] else ""
    if is_so:
        return claim.assuming(NEAREST + more, numbers)
    if likeliest:
        return claim.assuming(f"another interpretation, likeliest with {likeliest}", numbers)
    return claim.fails(numbers)


def _shares(work: Work) -> dict[str, Any]:
    """Returns what ``keep_shares`` left, where it was made as this figure is."""
    file = work.out / SHARES
    kept = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
    return kept if kept.get("small") == work.small else {}
