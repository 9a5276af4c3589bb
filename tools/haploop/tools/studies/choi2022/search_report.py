"""Tables, lists and a picture of a search among interpretations."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from haploop.tools.figure.style import INK, SMALL, TEXT, empty_figure
from haploop.tools.render.terminal import markdown_table
from haploop.tools.studies.choi2022.interpretations import (
    InterpretationSpace,
    Option,
    Row,
    decider,
    never_together,
    percent,
    share,
    yes,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def claims_table(
    claims: Mapping[str, str],
    alone: Mapping[str, Row],
    shares: Mapping[str, Sequence[Row]],
    found: Sequence[Option],
    decided: str,
) -> str:
    """Returns a table with a row a claim: where it holds, how often, and what decides it.

    Args:
        claims: what is tested, by name.
        alone: interpretations with a column of yes or no, by heading.
        shares: sets of interpretations with a column of shares, by heading.
        found: options that may decide.
        decided: heading of the column of options.
    """
    rows = []
    for name, about in claims.items():
        decides = decider(found, name)
        rows.append(
            [
                f"*{name}*",
                about,
                *(yes(row, name) for row in alone.values()),
                *(percent(share(some, name)) for some in shares.values()),
                decides.describe(name) if decides else "",
            ]
        )
    return markdown_table(
        ["claim", "as tested", *alone, *shares, decided],
        rows,
        numbers=range(2 + len(alone), 2 + len(alone) + len(shares)),
    )


def by_number_of_claims(rows: Sequence[Row], claims: int) -> str:
    """Returns how many interpretations have how many of the claims: ``"3 of 13: 20, 2 of 13: 7"``."""
    holding = Counter(row["holding"] for row in rows)
    return ", ".join(f"{count} of {claims}: {holding[count]}" for count in sorted(holding, reverse=True))


def pairs_never_together(rows: Sequence[Row], claims: Sequence[str]) -> str:
    """Returns the pairs of claims that never hold both; empty if there are none."""
    return "; ".join(f"*{first}* and *{second}*" for first, second in never_together(rows, claims))


def list_of_choices(space: InterpretationSpace) -> str:
    """Returns a list item for each choice with its options."""
    return "\n".join(
        f"- {space.label(key)}: {', '.join(space.value(key, option) for option in some)}"
        for key, some in space.choices.items()
    )


def share_map(found: Sequence[Option], claims: Sequence[str], count: int) -> Figure:
    """Draws a row an option, a column a claim, the share of interpretations as colour and number."""
    shares = np.array([[option.share(claim) for claim in claims] for option in found])
    starts = [i == 0 or option.dimension != found[i - 1].dimension for i, option in enumerate(found)]
    figure = empty_figure(11.5, 2.0 + 0.2 * len(found))
    ax = figure.subplots()
    ax.pcolormesh(shares, cmap="YlGnBu", vmin=0.0, vmax=1.0, edgecolors="white", linewidth=0.5)
    for (row, column), value in np.ndenumerate(shares):
        text = percent(float(value)).removesuffix(" %")
        colour = "white" if value > 0.55 else INK
        ax.text(column + 0.5, row + 0.5, text, ha="center", va="center", fontsize=SMALL - 1, color=colour)
    ax.set_xticks(np.arange(len(claims)) + 0.5, claims, rotation=40, ha="left", fontsize=SMALL)
    ax.xaxis.tick_top()
    names = [
        f"{option.dimension}: {option.name}" if start else option.name
        for option, start in zip(found, starts, strict=True)
    ]
    ax.set_yticks(np.arange(len(found)) + 0.5, names, fontsize=SMALL)
    ax.invert_yaxis()
    for i in np.flatnonzero(starts)[1:]:
        ax.axhline(i, color=INK, linewidth=0.7)
    ax.tick_params(length=0)
    for spine in ax.spines.values():
        spine.set_visible(False)
    ax.set_xlabel(f"% of {count} random interpretations under which the claim holds", fontsize=TEXT, color=INK)
    return figure
