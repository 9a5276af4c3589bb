"""What the search for readings found, in words and tables: the notes below Fig. 6."""

from __future__ import annotations

from collections import Counter

import numpy as np

from haploop.tools.amounts import amount
from haploop.tools.paper.reading import ABOUT, BOUNDS, CHOICES, words
from haploop.tools.paper.reading_runs import ASIDE, CLAIMS
from haploop.tools.paper.search import SEED, Found
from haploop.tools.paper.shares import decider, holds, never_together, options, percent, plain, share, yes


def notes(found: Found) -> list[str]:
    """What the search found, in words and tables."""
    return [*_how(found), *_alone(found), *_together(found), *_nearest(found)]


def _how(found: Found) -> list[str]:
    count = Counter(row["stage"] for row in found.rows)
    return [
        "#### The search",
        f"A reading chooses what the paper leaves open, and keeps all numbers that it gives. {count['random']} "
        f"readings were drawn with the seed {SEED}; one more was found beforehand, on a bare model of the loop. "
        f"Around the best of these {count['refined']} more were drawn in rounds, and {count['neighbour']} around the "
        "nearest, every number of it times e^(0.05 ξ), ξ normal. The 2 ms lie between sample and force; where in "
        "the round trip they sit changes no motion, only which book is seen: *sampled* is what a controller in "
        "front of them reads, *true* what acts on the device behind them. A low-pass over the position itself, as "
        "the paper's words could also mean, is not among the choices.",
        "\n".join(f"- {key}: {', '.join(map(str, names))}" for key, names in CHOICES.items()),
        "\n".join(
            ["| number, drawn evenly in its logarithm | from | to | why |", "|---|---:|---:|---|"]
            + [f"| {plain(key)} | {low:g} | {high:g} | {ABOUT[key][1]} |" for key, (low, high) in BOUNDS.items()]
        ),
        "The distance of a reading is the sum over the claims of how far each is from holding: ln of the factor "
        "that is missing (at most 3), 1 for a yes that is a no, 3 for a run that diverged. The claims, as they are "
        "tested:",
        "\n".join(f"- *{name}*: {about}" for name, about in CLAIMS.items()),
        "Beside them, in no distance:",
        "\n".join(f"- *{name}*: {about}" for name, about in ASIDE.items()),
    ]


def _alone(found: Found) -> list[str]:
    """A table of claims: how often, and what decides."""
    rows, [base], [nearest] = found.of("random"), found.of("base"), found.of("nearest")
    around = found.of("neighbour")
    there = options(rows)
    lines = [
        "| claim | our reading | nearest | its neighbours | random readings | decided most by |",
        "|---|---|---|---:|---:|---|",
    ]
    for name in [*CLAIMS, "all", *ASIDE]:
        decides = decider(there, name)
        by = ""
        if decides and decides.gap(name) > 0.0:
            best, worst = decides.best, decides.worst
            by = (
                f"{plain(best.dimension)}: {best.name} {percent(best.share(name))}, {worst.name} "
                f"{percent(worst.share(name))}"
            )
        cells = (
            name,
            yes(base, name),
            yes(nearest, name),
            percent(share(around, name)),
            percent(share(rows, name)),
            by,
        )
        lines.append(f"| {' | '.join(cells)} |")
    return ["#### Each claim alone", "\n".join(lines)]


def _together(found: Found) -> list[str]:
    rows = found.of("random")
    holding = Counter(row["holding"] for row in rows)
    counted = ", ".join(f"{count} of {len(CLAIMS)}: {holding[count]}" for count in sorted(holding, reverse=True))
    refined = [row for row in found.of("refined") if row["distance"] == 0.0]
    fullest = max(found.rows, key=lambda row: (row["holding"], -row["distance"]))
    lacks = ", ".join(f"*{name}*" for name in CLAIMS if not holds(fullest, name))
    most = f"No reading of any kind has more than {fullest['holding']}; that one lacks {lacks}. " if lacks else ""
    never = never_together(rows)
    pairs = "; ".join(f"*{first}* and *{second}*" for first, second in never)
    both = f"Never both at random: {pairs}." if never else "Every two of them hold together somewhere."
    return [
        "#### Together",
        f"Random readings by how many of the {len(CLAIMS)} claims hold: {counted}. All hold for "
        f"{sum(holds(row, 'all') for row in rows)} of {len(rows)} random readings and for {len(refined)} of "
        f"{len(found.of('refined'))} refined ones. {most}{both}",
    ]


def _nearest(found: Found) -> list[str]:
    [row], around = found.of("nearest"), found.of("neighbour")
    missed = [f"*{name}* by {row[name]:.2g}" for name in CLAIMS if row[name] > 0.0]
    swings = ", ".join(
        f"{key.removeprefix('swing ').removesuffix('_m')} {amount(value, 'm')}"
        for key, value in row.items()
        if key.startswith("swing ")
    )
    verdict = f"It misses {', '.join(missed)}" if missed else "All claims hold for it"
    return [
        "#### The nearest reading",
        f"{words(found.nearest)}. {verdict}; its distance is {row['distance']:.3g}. Swings in the last half second: "
        f"{swings}. Of its {len(around)} neighbours all claims hold for {percent(share(around, 'all'))}; on average "
        f"{np.mean([one['holding'] for one in around]):.1f} of {len(CLAIMS)} hold.",
    ]
