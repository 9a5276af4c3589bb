"""What the search for readings of Fig. 6 found, in words and tables: the notes below the figure."""

from __future__ import annotations

from collections import Counter

import numpy as np

from haploop.tools.render.markdown import markdown_table
from haploop.tools.render.units import amount
from haploop.tools.studies.choi2022.simulation.reading import ABOUT, BOUNDS, SPACE, words
from haploop.tools.studies.choi2022.simulation.reading_runs import ASIDE, CLAIMS
from haploop.tools.studies.choi2022.simulation.search import CLOSE, FAR, SEED, Found
from haploop.tools.studies.choi2022.simulation.shares import (
    decider,
    holds,
    never_together,
    options,
    percent,
    share,
    yes,
)


def notes(found: Found) -> list[str]:
    """What the search found, in words and tables."""
    return [*_together(found), *_alone(found), *_nearest(found), *_how(found)]


def _how(found: Found) -> list[str]:
    count = Counter(row["stage"] for row in found.rows)
    choices = [
        f"- {SPACE.label(key)}: {', '.join(SPACE.value(key, option) for option in some)}"
        for key, some in SPACE.choices.items()
    ]
    numbers = [
        (SPACE.label(key), SPACE.value(key, low), SPACE.value(key, high), ABOUT[key][1])
        for key, (low, high) in BOUNDS.items()
    ]
    return [
        "#### How was searched",
        f"A reading chooses what the paper leaves open, and keeps all numbers that it gives. {count['random']} "
        f"readings were drawn with the seed {SEED}. The search was then tuned to the distance below: around the best "
        f"of them, and in rounds around the best of all so far, {count['refined']} more were drawn, every number "
        f"times e^(s ξ), ξ normal, s from {FAR:g} down to {CLOSE:g}; {count['neighbour']} neighbours of the nearest "
        "show how much hangs on its numbers. Shares are of the random ones alone.",
        "The 2 ms lie between sample and force. Where in the round trip they sit changes no motion, only which book is "
        "seen: *sampled* is what a controller in front of them reads, *true* what acts on the device behind them. A "
        "low-pass over the position itself, as the paper's words could also mean, is not among the choices.",
        "\n".join(choices),
        markdown_table(("number, drawn evenly in its logarithm", "from", "to", "why"), numbers, numbers=(1, 2)),
        "The distance of a reading is the sum over the claims of how far each is from holding: ln of the factor "
        "that is missing (at most 3), 1 for a yes that is a no, 3 for a run that diverged.",
    ]


def _alone(found: Found) -> list[str]:
    """A table of claims: how often, and what decides."""
    rows, [base], [nearest] = found.of("random"), found.of("base"), found.of("nearest")
    around, there = found.of("neighbour"), options(rows, SPACE)
    heads = ("claim", "as tested", "our reading", "nearest", "its neighbours", "random readings", "decided most by")
    lines = []
    for name, about in [*CLAIMS.items(), ("all", "all of the above"), *ASIDE.items()]:
        decides = decider(there, name)
        cells = (
            f"*{name}*",
            about,
            yes(base, name),
            yes(nearest, name),
            percent(share(around, name)),
            percent(share(rows, name)),
            decides.said(name) if decides else "",
        )
        lines.append(cells)
    aside = ", ".join(f"*{name}*" for name in ASIDE)
    return [
        "#### Each claim alone",
        markdown_table(heads, lines, numbers=(4, 5)),
        f"Not counted in a reading's distance: {aside}.",
    ]


def _together(found: Found) -> list[str]:
    rows = found.of("random")
    holding = Counter(row["holding"] for row in rows)
    counted = ", ".join(f"{count} of {len(CLAIMS)}: {holding[count]}" for count in sorted(holding, reverse=True))
    refined = sum(holds(row, "all") for row in found.of("refined"))
    fullest = max(found.rows, key=lambda row: (row["holding"], -row["distance"]))
    lacks = ", ".join(f"*{name}*" for name in CLAIMS if not holds(fullest, name))
    most = f"No reading of any kind has more than {fullest['holding']}; that one lacks {lacks}. " if lacks else ""
    never = never_together(rows, list(CLAIMS))
    pairs = "; ".join(f"*{first}* and *{second}*" for first, second in never)
    both = f"Never both at random: {pairs}." if never else "Every two of them hold together somewhere."
    return [
        "#### All claims together",
        f"All hold for {sum(holds(row, 'all') for row in rows)} of {len(rows)} random readings and for {refined} of "
        f"{len(found.of('refined'))} refined ones. {most}{both} Random readings by how many claims hold: {counted}.",
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
