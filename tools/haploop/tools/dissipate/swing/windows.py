"""The windows of a recording that swing, and how wide the swing is along them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from haploop.logger.verdict.spectrum import Line
from haploop.tools.dissipate.recording.samples import Floats
from haploop.tools.dissipate.swing.course import PLACES, Widths

# Places in the middle quarter of a window; those up to its end, and those from its beginning on.
_MIDDLE = slice(3 * PLACES // 8, 5 * PLACES // 8)
_TO_MIDDLE, _FROM_MIDDLE = slice(_MIDDLE.stop), slice(_MIDDLE.start, PLACES)
# Of a swing hardly longer than a window, less than this share is seen: whether it dies down is not reported.
_SEEN = 0.4
# The first and the last window of a swing may be empty for about a quarter; the third is full.
THIRD = 2


class Window(NamedTuple):
    """A window that swings.

    Attributes:
        from_s, to_s: where the swing began if this is the first of its stretch, and ended if it is the last.
        at_s: start and length of the window.
        width_m: greatest width, peak to peak: that of the window's sine or, where it changes within the window, of its
            widest part.
    """

    from_s: float
    to_s: float
    line: Line
    fed: tuple[float, float] | None
    at_s: tuple[float, float]
    widths: Widths
    width_m: float


class End(NamedTuple):
    """The end of a part without a gap to which a swing continues, and its widths in the window before."""

    to_s: float
    at_s: tuple[float, float]
    widths: Widths
    width_m: float


def widest_m(line: Line, along: Widths, begins: bool = False, ends: bool = False) -> float:
    """Returns the width of a window; its ends, which a swing may not fill, count only where a part begins or ends."""
    first, last = begins and along.fills(_TO_MIDDLE), ends and along.fills(_FROM_MIDDLE)
    places = slice(0 if first else PLACES // 4, PLACES if last else -PLACES // 4)
    return max(line.width, float(along.width_m[places].max())) if along.varies(places) else line.width


def along_m(told: list[Window], ends: Mapping[float, End]) -> tuple[Floats, float]:
    """Returns the widths of the part that a swing fills, in the order of time, and their standard error, m.

    Each window gives those of its middle quarter; the first of a part also those before, and the last those after. A
    swing without such a beginning or end may fill its first two or last two windows only in part.
    """
    begins, end = told[0].from_s == told[0].at_s[0] and told[0].widths.fills(_TO_MIDDLE), ends.get(told[-1].to_s)
    some = told[0 if begins else THIRD : len(told) if end else -THIRD] or told[len(told) // 2 :][:1]
    pieces = [(window.at_s, window.widths, _MIDDLE) for window in some]
    if begins:
        pieces[0] = (*pieces[0][:2], _TO_MIDDLE)
    if end and end.widths.fills(_FROM_MIDDLE):
        pieces.append((end.at_s, end.widths, _FROM_MIDDLE))
    found_m = list[Floats]()
    last_s = -np.inf
    for (from_s, lasts_s), along, places in pieces:
        at_s = from_s + (np.arange(PLACES)[places] + 0.5) / PLACES * lasts_s
        is_later = at_s > last_s
        found_m.append(along.width_m[places][is_later])
        last_s = max(last_s, float(at_s[-1]))
    return np.concatenate(found_m), float(np.median([window.widths.error_m for window in some]))


def is_seen(told: list[Window], width_m: Floats) -> bool:
    """Tells whether widths of ``along_m`` cover enough of a swing to say how it went."""
    lasts_s = told[-1].to_s - told[0].from_s
    return len(width_m) / PLACES * told[0].at_s[1] >= _SEEN * lasts_s
