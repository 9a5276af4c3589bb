"""The verdict on what depends on values that nobody published: by the nearest reading, and by all that were tried."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import fields
from typing import Any

from haploop.launch.scene.file import load
from haploop.tools.studies.choi2022.claims import Claim, Finding
from haploop.tools.studies.choi2022.experiment.setup import Setup
from haploop.tools.studies.choi2022.experiment.setup import nearest as of_the_scene_file
from haploop.tools.studies.choi2022.simulation.shares import Option, Row, decider, holds, percent, share
from haploop.tools.studies.choi2022.work import Work

READING = "[the nearest reading of the device](#figure-7)"
SHARES, SCENE = "figure_7_shares.json", "figure_7.toml"


def nearest(work: Work) -> Setup:
    """The nearest reading: that which figure 7 left in the directory, else that of ``premium_press.toml``."""
    return Setup.of(load(work.out / SCENE)) if _shares(work) else of_the_scene_file()


def keep_shares(work: Work, claims: Sequence[str], rows: Sequence[Row], found: Sequence[Option]) -> None:
    """Leave for the figures that follow how often each claim holds, what it is likeliest with, and where it holds.

    Of the readings for which a claim holds the one nearest to the paper is kept.
    """
    kept: dict[str, Any] = {"small": work.small, "readings": len(rows), "claims": {}}
    for name in claims:
        decides, held = decider(found, name), [row for row in rows if holds(row, name)]
        best = min(held, key=lambda row: row["distance"], default=None)
        kept["claims"][name] = {
            "share": share(rows, name),
            "likeliest": str(decides.best) if decides else "",
            "nearest": {key.name: best[key.name] for key in fields(Setup)} if best else None,
        }
    work.path(SHARES).write_text(json.dumps(kept, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")


def holding(work: Work, tested: str) -> Setup | None:
    """The random reading nearest to the paper for which a claim of the search holds, if any does and is known."""
    kept = _shares(work)
    values = kept["claims"][tested]["nearest"] if kept else None
    return Setup(**values) if values else None


def judged(work: Work, claim: Claim, is_so: bool, numbers: str, tested: str = "", more: str = "") -> Finding:
    """Holds under the nearest reading (and what ``more`` asks for), else under others, else not at all.

    Args:
        is_so: whether it does under the nearest.
        numbers: what came of that.
        tested: what the search for readings calls the claim, where it tests it.
        more: what has to be so besides.
    """
    kept = _shares(work)
    said, likeliest = numbers, ""
    if tested and kept:
        found = kept["claims"][tested]
        said += f". In {percent(found['share'])} of {kept['readings']} random readings"
        likeliest = found["likeliest"] if found["share"] else ""
    if is_so:
        return claim.assuming(READING + more, said)
    return claim.assuming(f"another reading, likeliest with {likeliest}", said) if likeliest else claim.fails(said)


def _shares(work: Work) -> dict[str, Any]:
    """What ``keep_shares`` left, where it was made as this figure is."""
    file = work.out / SHARES
    kept = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
    return kept if kept.get("small") == work.small else {}
