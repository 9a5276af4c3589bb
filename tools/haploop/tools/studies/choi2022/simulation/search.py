"""The search for interpretations under which the paper's Fig. 6 comes out, and the report of it below the figure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from haploop.tools.render.terminal import markdown_table
from haploop.tools.render.units import amount
from haploop.tools.search.random import Effort, Point, evaluated, random_search
from haploop.tools.studies.choi2022.interpretations import Found, Row, holds, options, percent, share
from haploop.tools.studies.choi2022.search_report import (
    by_number_of_claims,
    claims_table,
    list_of_choices,
    pairs_never_together,
)
from haploop.tools.studies.choi2022.simulation.interpretation import ABOUT, BASE, BOUNDS, SPACE, describe
from haploop.tools.studies.choi2022.simulation.measure import ASIDE, CLAIMS, shortfalls
from haploop.tools.studies.choi2022.work import Work

SEED = 2022
WHOLE = Effort(structures=64, each=64, rounds=4, best=3, children=64, finalists=3, neighbours=64)
SMALL = Effort(structures=2, each=4, rounds=1, best=1, children=2, neighbours=2)


def search(work: Work, effort: Effort) -> Found[Point]:
    """Searches with the fixed seed; the same effort gives the same rows, whatever the number of workers.

    Stages are "base", "nearest" (its numbers rounded to three digits), "random", "refined" and "neighbour".
    """

    def evaluate_all(stage: str, *args: Any) -> list[Any]:
        return work.map_parallel(f"{stage} interpretations, in groups", *args)

    found = random_search(
        SPACE, shortfalls, effort, seed=SEED, distance=lambda row: row["distance"], evaluate_all=evaluate_all
    )
    nearest = found.best.point.rounded(3)
    ends = [
        *evaluated("base", shortfalls, [[BASE]], evaluate_all),
        *evaluated("nearest", shortfalls, [[nearest]], evaluate_all),
    ]
    return Found([trial.row for trial in [*ends, *found.trials, *found.neighbours]], nearest)


def write_table(rows: Sequence[dict[str, Any]], path: Path) -> bool:
    """Writes all interpretations as Parquet, one row each; returns False where pyarrow is missing.

    Numbers that an interpretation does not use are NaN; swings of runs that diverged are infinite.
    """
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        return False
    pyarrow.parquet.write_table(pyarrow.Table.from_pylist(list(rows)), path)
    return True


def notes(work: Work, found: Found[Point]) -> list[str]:
    """Returns the sections below the figure."""
    return [*_together(found), *_alone(found), *_nearest(found), *_method(work, found)]


def fullest(found: Found[Point]) -> Row:
    """Returns the interpretation with the most claims, of several the nearest to the paper."""
    return max(found.rows, key=lambda row: (row["holding"], -row["distance"]))


def _together(found: Found[Point]) -> list[str]:
    rows, refined, most = found.of("random"), found.of("refined"), fullest(found)
    lacks = ", ".join(f"*{name}*" for name in CLAIMS if not holds(most, name))
    limit = f"No interpretation of any kind has more than {most['holding']}; that one lacks {lacks}. " if lacks else ""
    never = pairs_never_together(rows, list(CLAIMS))
    both = f"Never both at random: {never}." if never else "Every two of them hold together somewhere."
    return [
        "#### All claims together",
        f"All hold for {sum(holds(row, 'all') for row in rows)} of {len(rows)} random interpretations and for "
        f"{sum(holds(row, 'all') for row in refined)} of {len(refined)} refined ones. {limit}{both} Random "
        f"interpretations by how many claims hold: {by_number_of_claims(rows, len(CLAIMS))}.",
    ]


def _alone(found: Found[Point]) -> list[str]:
    rows, [base], [nearest] = found.of("random"), found.of("base"), found.of("nearest")
    return [
        "#### Each claim alone",
        claims_table(
            CLAIMS | {"all": "all of the above"} | ASIDE,
            {"our interpretation": base, "nearest": nearest},
            {"its neighbours": found.of("neighbour"), "random interpretations": rows},
            options(rows, SPACE),
            "decided most by",
        ),
        f"Not counted in the distance of an interpretation: {', '.join(f'*{name}*' for name in ASIDE)}.",
    ]


def _nearest(found: Found[Point]) -> list[str]:
    [row], around = found.of("nearest"), found.of("neighbour")
    missed = ", ".join(f"*{name}* by {row[name]:.2g}" for name in CLAIMS if row[name] > 0.0)
    swings = ", ".join(
        f"{key.removeprefix('swing ').removesuffix('_m')} {amount(value, 'm')}"
        for key, value in row.items()
        if key.startswith("swing ")
    )
    verdict = f"It misses {missed}" if missed else "All claims hold for it"
    return [
        "#### The nearest interpretation",
        f"{describe(found.nearest)}. {verdict}; its distance is {row['distance']:.3g}. Swings in the last half "
        f"second: {swings}. Of its {len(around)} neighbours all claims hold for {percent(share(around, 'all'))}; on "
        f"average {np.mean([one['holding'] for one in around]):.1f} of {len(CLAIMS)} hold.",
    ]


def _method(work: Work, found: Found[Point]) -> list[str]:
    count = Counter(row["stage"] for row in found.rows)
    numbers = [
        [SPACE.label(key), SPACE.value(key, low), SPACE.value(key, high), ABOUT[key][1]]
        for key, (low, high) in BOUNDS.items()
    ]
    return [
        "#### How was searched",
        work.tell("method", seed=SEED, far=WHOLE.far, close=WHOLE.close, **count),
        list_of_choices(SPACE),
        markdown_table(["number, drawn evenly in its logarithm", "from", "to", "why"], numbers, numbers=(1, 2)),
        work.tell("distance"),
    ]
