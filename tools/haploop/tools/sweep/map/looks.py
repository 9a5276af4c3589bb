"""The looks of verdicts, which can be told apart without colour as well, and of amplitudes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from haploop.protocol.amounts import amount
from haploop.tools.figure.style import GREY
from haploop.tools.figure.style import VERDICTS as COLOURS
from haploop.tools.sweep.map.data import Verdict

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axis import Axis as MatplotlibAxis
    from matplotlib.colors import Colormap, LogNorm


class Look(NamedTuple):
    """The fill of a cell, its hatching and the hatching's colour, and the marker of a point and its colour."""

    fill: str
    hatch: str
    hatch_colour: str
    marker: str
    colour: str


# From light to dark: steady, no contact, undecided, failed, the limit cycles' scale, growing, diverged.
LOOKS: dict[int, Look] = {
    Verdict.STEADY: Look("#D9EEF7", "", "", "o", COLOURS["steady"]),
    Verdict.NO_CONTACT: Look("#FFFFFF", "...", "#A8A8A8", "s", COLOURS["no-contact"]),
    Verdict.FAILED: Look("#BFBFBF", "xxx", "#666666", "x", "#222222"),
    Verdict.UNDECIDED: Look("#E6E6E6", "\\\\\\", "#8C8C8C", "P", COLOURS["undecided"]),
    Verdict.LIMIT_CYCLE: Look("#E0A030", "", "", "D", COLOURS["limit-cycle"]),
    Verdict.GROWING: Look("#7A2430", "+++", "#D0A0A8", "v", COLOURS["growing"]),
    Verdict.DIVERGED: Look("#3B0F1E", "///", "#A58090", "^", COLOURS["diverged"]),
}
# The look of cells that are steady with a proviso.
PROVISO = Look(LOOKS[Verdict.STEADY].fill, "//", "#A9CDDD", "o", COLOURS["steady"])
# Least over greatest of the amplitudes that have different colours.
_RANGE = 1e-5


def verdict_signs(
    counts: Mapping[int, int], word: Callable[[int], str], as_points: bool, with_proviso: int = 0
) -> list[Artist]:
    """Makes the sign of every verdict, a point or a cell, labelled with its word and the number of its cells.

    The steady cells ``with_proviso`` have a sign of their own where cells are shown.
    """
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    signs: list[Artist] = []
    for number, count in counts.items():
        look, label = LOOKS[number], f"{word(number)}: {count} {'cell' if count == 1 else 'cells'}"
        if as_points:
            signs.append(Line2D([], [], marker=look.marker, color=look.colour, linestyle="none", label=label))
        else:
            edge = look.hatch_colour or GREY
            signs.append(Patch(facecolor=look.fill, edgecolor=edge, hatch=look.hatch, linewidth=0.6, label=label))
        if number == Verdict.STEADY and with_proviso:
            fill, edge, label = PROVISO.fill, PROVISO.hatch_colour, f"of these with a condition: {with_proviso}"
            signs.append(Patch(facecolor=fill, edgecolor=edge, hatch=2 * PROVISO.hatch, linewidth=0.6, label=label))
    return signs


def amplitude_colours() -> Colormap:
    """Makes the colours from yellow to brown, without ends that could be taken for a steady or a diverged cell."""
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    return ListedColormap(colormaps["YlOrBr"](np.linspace(0.4, 0.9, 256)), name="amplitudes")


def amplitude_scale(amplitudes_m: np.ndarray) -> LogNorm | None:
    """Makes one logarithmic scale for some amplitudes, a large range cut at its lower end; None where none is known."""
    from matplotlib.colors import LogNorm

    known = amplitudes_m[np.isfinite(amplitudes_m) & (amplitudes_m > 0.0)]
    if not len(known):
        return None
    low, high = max(float(known.min()), _RANGE * float(known.max())), float(known.max())
    return LogNorm(low, high) if high > 2.0 * low else LogNorm(low / 1.5, high * 1.5)


def metres_along(axis: MatplotlibAxis, ratio: float, from_m: float = 0.0) -> None:
    """Puts numbers with suitable units along a logarithmic axis of metres that reaches over a ratio, from one on."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    few = {60.0: (1,), 12.0: (1, 3), 3.0: (1, 2, 5), 0.0: (1, 2, 3, 4, 6, 8)}
    axis.set_major_locator(LogLocator(subs=next(subs for least, subs in few.items() if ratio > least), numticks=7))
    axis.set_major_formatter(FuncFormatter(lambda value, _: amount(value, "m", digits=1) if value >= from_m else ""))
    axis.set_minor_formatter(NullFormatter())
