"""What the search for readings of the experiments found, in words and tables: the notes below Fig. 7."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

from haploop.tools.render.markdown import markdown_table
from haploop.tools.render.units import amount
from haploop.tools.studies.choi2022.experiment.reading_rows import CLAIMS, PAPER
from haploop.tools.studies.choi2022.experiment.reading_search import CLOSE, FAR, SEED, Found
from haploop.tools.studies.choi2022.experiment.readings import SPACE
from haploop.tools.studies.choi2022.experiment.setup import SCENE_FILE, Setup
from haploop.tools.studies.choi2022.experiment.stiffness_ladder import NAMES
from haploop.tools.studies.choi2022.simulation.shares import Option, decider, holds, never_together, percent, share, yes

# Claims that hold less often than this are in no pair that is told of.
_OFTEN = 0.05


def notes(found: Found, there: Sequence[Option]) -> list[str]:
    """What the search found, in words and tables."""
    return [*_nearest(found), *_alone(found, there), *_together(found), *_how(found)]


def _nearest(found: Found) -> list[str]:
    row, values = found.row, said(found.nearest)
    lacks = ", ".join(f"*{name}*" for name in CLAIMS if not holds(row, name))
    return [
        "#### The nearest reading",
        f"{values[:1].upper()}{values[1:]}: launch/scenes/{SCENE_FILE}, in which Figs. 8 to 13 are made. "
        f"{row['holding']} of the {len(CLAIMS)} claims hold for it; it lacks {lacks}. Largest steady stiffness "
        "in N/mm:",
        markdown_table(
            ("", "nothing", "damping", "bidirectional", "unidirectional", "damping with unidirectional"),
            [
                ("the paper", "", *(f"{stiffness / 1e3:.1f}" for stiffness in PAPER.values())),
                ("nearest reading", *_stiffnesses(row)),
                ("with friction of 48 mN", *_stiffnesses(found.with_friction)),
            ],
            numbers=range(1, 6),
        ),
        "The friction that Cavusoglu et al. 2002 found on one device steadies all the more, beyond what the paper "
        "reports; it is left out of the readings.",
    ]


def said(setup: Setup) -> str:
    """A reading in one line."""
    values = setup.as_dict()
    return ", ".join(f"{SPACE.label(key)} {SPACE.value(key, values[key])}" for key in (*SPACE.choices, *SPACE.bounds))


def _stiffnesses(row: dict[str, Any]) -> list[str]:
    return [f"{row[f'{name}_N_m'] / 1e3:.1f}" for name in NAMES]


def _alone(found: Found, there: Sequence[Option]) -> list[str]:
    rows = found.of("random")
    heads = ("claim", "as tested", "nearest", "its neighbours", "random readings", "likeliest with, and least with")
    lines = []
    for name, about in CLAIMS.items():
        decides = decider(there, name)
        cells = (
            f"*{name}*",
            about,
            yes(found.row, name),
            percent(share(found.of("neighbour"), name)),
            percent(share(rows, name)),
            decides.said(name) if decides else "",
        )
        lines.append(cells)
    bears = sum(max(row[f"{name}_N_m"] for name in PAPER) > 0.0 for row in rows)
    return [
        "#### Each claim alone",
        f"Of {len(rows)} random readings {bears} let any element steady a wall of 2.5 N/mm. Shares are of all.",
        markdown_table(heads, lines, numbers=(3, 4)),
    ]


def _together(found: Found) -> list[str]:
    rows = found.of("random")
    holding = Counter(row["holding"] for row in rows)
    counted = ", ".join(f"{count} of {len(CLAIMS)}: {holding[count]}" for count in sorted(holding, reverse=True))
    most = max(row["holding"] for row in found.rows)
    often = [name for name in CLAIMS if share(rows, name) >= _OFTEN]
    never = "; ".join(f"*{first}* and *{second}*" for first, second in never_together(rows, often))
    return [
        "#### All claims together",
        f"The most that hold under any reading, refined ones included, are {most}. Random readings by how many hold: "
        f"{counted}." + (f" Of those that hold in {percent(_OFTEN)} or more, never both: {never}." if never else ""),
    ]


def _how(found: Found) -> list[str]:
    count = Counter(row["stage"] for row in found.rows)
    papers = ", ".join(f"{name.replace('-', ' ')} {stiffness / 1e3:.1f}" for name, stiffness in PAPER.items())
    choices = [
        f"- {SPACE.label(key)}: {', '.join(SPACE.value(key, option) for option in some)}"
        for key, some in SPACE.choices.items()
    ]
    numbers = [
        f"- {SPACE.label(key)}: {SPACE.value(key, low)} to {SPACE.value(key, high)}"
        for key, (low, high) in SPACE.bounds.items()
    ]
    return [
        "#### How was searched",
        f"{count['random']} readings were drawn with the seed {SEED}, numbers evenly in their logarithm; in each every "
        "element was tried on walls from 2.5 to 7.5 N/mm in steps of 0.5, in 8 sizes (12 of the pair), until none was "
        "steady. A run is steady where over the last half second the position swings by no more than one encoder step "
        f"to either side, or what swings dies down. Around the three best {count['refined']} more were drawn in two "
        "rounds, every number times "
        f"e^(s ξ), ξ normal, s {FAR:g}, then {CLOSE:g}. {count['neighbour']} neighbours of the nearest, s {CLOSE:g}, "
        "show how much hangs on its numbers. Shares are of the random ones alone.",
        "How far a reading is from the paper: the number of claims that do not hold, and the steps of 0.5 N/mm, beyond "
        f"one, by which its largest stiffnesses differ from the paper's ({papers} N/mm).",
        "\n".join([*choices, *numbers]),
        "Where the unit sits: its own lag is in its setting (1046 Hz: 0.50 ms in all, 420 Hz: 1.38 ms, 218 Hz: 1.88 "
        f"ms), *ideal* has none; one encoder step is {amount(28.7e-6, 'm')}.",
    ]
