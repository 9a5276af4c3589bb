"""How verdicts look in a map: by lightness and hatching, so that they are told apart without colour as well."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from haploop.tools.figure.style import VERDICTS as COLOURS
from haploop.tools.render.units import amount
from haploop.tools.sweep.map.data import DIVERGED, FAILED, LIMIT_CYCLE, NO_CONTACT, STEADY, VERDICTS

if TYPE_CHECKING:
    from matplotlib.axis import Axis as MatplotlibAxis
    from matplotlib.colors import Colormap, LogNorm


class Look(NamedTuple):
    """Fill of a cell, hatching and its colour, marker of a point and its colour."""

    fill: str
    hatch: str
    hatch_colour: str
    marker: str
    colour: str


# From light to dark: steady, no contact, the limit cycles' scale, failed between, diverged.
LOOKS = {
    STEADY: Look("#D9EEF7", "", "", "o", COLOURS["steady"]),
    NO_CONTACT: Look("#FFFFFF", "...", "#A8A8A8", "s", COLOURS["no-contact"]),
    FAILED: Look("#BFBFBF", "xxx", "#666666", "x", "#222222"),
    LIMIT_CYCLE: Look("#E0A030", "", "", "D", COLOURS["limit-cycle"]),
    DIVERGED: Look("#3B0F1E", "///", "#A58090", "^", COLOURS["diverged"]),
}
# Of amplitudes that have colours of their own, the least over the greatest.
_RANGE = 1e-5
WORDS = {LIMIT_CYCLE: "limit cycle", NO_CONTACT: "no contact"}


def words_of(verdict: int) -> str:
    """A verdict as people write it."""
    return WORDS.get(verdict, VERDICTS[verdict])


def amplitude_colours() -> Colormap:
    """From yellow to brown, without the ends that could be taken for a steady or a diverged cell."""
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    return ListedColormap(colormaps["YlOrBr"](np.linspace(0.4, 0.9, 256)), name="amplitudes")


def amplitude_scale(amplitudes_m: np.ndarray) -> LogNorm | None:
    """One logarithmic scale for some amplitudes, of a great range for its upper end; None where none is known."""
    from matplotlib.colors import LogNorm

    known = amplitudes_m[np.isfinite(amplitudes_m) & (amplitudes_m > 0.0)]
    if not len(known):
        return None
    low, high = max(float(known.min()), _RANGE * float(known.max())), float(known.max())
    return LogNorm(low, high) if high > 2.0 * low else LogNorm(low / 1.5, high * 1.5)


def metres_along(axis: MatplotlibAxis, ratio: float) -> None:
    """Numbers with their own unit along a logarithmic axis of metres that reaches over a ratio."""
    from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

    log = LogLocator(subs=(1.0,) if ratio > 60.0 else (1.0, 3.0), numticks=7)
    axis.set_major_locator(log if ratio > 12.0 else MaxNLocator(4))
    axis.set_major_formatter(FuncFormatter(lambda value, _: amount(value, "m", digits=1)))
    axis.set_minor_formatter(NullFormatter())
