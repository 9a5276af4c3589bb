"""The buzz in the windows that swing: which of them last, and what is reported of them together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from haploop.tools.dissipate.swing.buzz import Band, Buzz, Overtone, Span
from haploop.tools.dissipate.swing.course import course
from haploop.tools.dissipate.swing.lines import Slower, is_overtone
from haploop.tools.dissipate.swing.windows import THIRD, End, Window, along_m, is_seen

# The windows are a quarter of a window apart; this many after the first must swing as well for a swing to last.
HOPS = 4
NEEDED = HOPS
# A swing that lasts does not decay below this share meanwhile: what is struck rings for a shorter time.
_KEPT = 0.7
# Number of the first window that is filled by a swing which began within the first one; a window before it is left out
# where it is less than ``_KEPT`` as wide.
_FULL = HOPS - 1


def lasting(stretch: list[Window], slower: Sequence[Slower]) -> tuple[list[Window], list[Overtone]]:
    """Returns the part of a stretch that lasts without decaying; separately if it is an overtone of a slower motion."""
    widths = [window.line.width for window in stretch]
    decays = [widths[i + NEEDED] < _KEPT * max(widths[i : i + NEEDED]) for i in range(len(widths) - NEEDED)]
    whole = [i for i, of in enumerate(decays) if not of]
    kept = stretch[whole[0] : whole[-1] + NEEDED + 1] if whole else []
    if kept:
        frequency_Hz = float(np.median([window.line.frequency_Hz for window in kept]))
        width_m = max(window.line.width for window in kept)
        if of := next((of for of in slower if is_overtone(frequency_Hz, width_m, of)), None):
            return [], [Overtone(window.line, of.line.frequency_Hz) for window in kept]
    return _filled(kept), []


def make_buzz(
    parts: Sequence[Sequence[Window]], stretches: Sequence[Sequence[Window]], ends: Mapping[float, End], band: Band
) -> Buzz | None:
    """Returns the buzz of the parts of stretches that last; None without one.

    Where one stretch lasts, shorter ones at its frequencies count, too, if they are about as wide. A swing still there
    at the end of a part of the recording continues to that end, which ``ends`` gives by the end of its last window.
    """
    kept = [window for part in parts for window in part]
    if not kept:
        return None
    swings_Hz = [window.line.frequency_Hz for window in kept]
    least_Hz, most_Hz, width_m = min(swings_Hz), max(swings_Hz), max(window.line.width for window in kept)

    def is_alike(window: Window) -> bool:
        near_Hz = band.resolved_Hz
        is_near = least_Hz - near_Hz < window.line.frequency_Hz < most_Hz + near_Hz
        return is_near and window.line.width >= _KEPT * width_m

    shorter = [window for stretch in stretches for window in stretch if is_alike(window)]
    told = sorted({*kept, *shorter}, key=lambda window: window.to_s)
    fed = [window.fed for window in told if window.fed is not None]
    given_W, moved_W = np.mean(fed, axis=0).tolist() if fed else (None, 0.0)
    spans = _joined(told, ends, band)
    last = told[-1 if told[-1].to_s in ends else -min(THIRD + 1, len(told))]
    width_m, word = max(span.width_m for span in spans), None
    first_m, last_m = told[min(THIRD, len(told) - 1)].line.width, last.line.width
    least_m = min(window.line.width for window in told)
    if len(spans) == 1:
        found_m, error_m = along_m(told, ends)
        word = course(found_m, error_m) if is_seen(told, found_m) else None
        width_m = max(window.line.width for window in told)
        if word not in ("stayed", None):
            first_m, last_m, least_m = found_m[0], found_m[-1], found_m.min()
            width_m = max(width_m, found_m.max())
        spans = (spans[0]._replace(width_m=float(width_m)),)
    return Buzz(
        float(np.median(swings_Hz)),
        0.5 * band.resolved_Hz,
        least_Hz,
        most_Hz,
        spans,
        float(width_m),
        word,
        float(first_m),
        float(last_m),
        float(least_m),
        given_W,
        moved_W,
    )


def _joined(told: Sequence[Window], ends: Mapping[float, End], band: Band) -> tuple[Span, ...]:
    """Joins windows of about one frequency; no pause shorter than a window is reported."""
    spans = list[Span]()
    last_Hz = 0.0
    for window in told:
        end, at_Hz = ends.get(window.to_s), window.line.frequency_Hz
        to_s, width_m = end.to_s if end else window.to_s, max(window.width_m, end.width_m if end else 0.0)
        is_near = spans and window.from_s <= spans[-1].to_s + band.window_s
        if is_near and abs(at_Hz - last_Hz) < band.resolved_Hz:
            from_s, until_s, least_Hz, most_Hz, widest_m = spans[-1]
            joined = max(until_s, to_s), min(least_Hz, at_Hz), max(most_Hz, at_Hz), max(widest_m, width_m)
            spans[-1] = Span(from_s, *joined)
        else:
            spans.append(Span(window.from_s, to_s, at_Hz, at_Hz, width_m))
        last_Hz = at_Hz
    return tuple(spans)


def _filled(stretch: list[Window]) -> list[Window]:
    """Returns a stretch without the windows at its beginning that the swing fills only in part."""
    widths = [window.line.width for window in stretch]
    first = next((i for i, width in enumerate(widths) if width >= _KEPT * widths[min(_FULL, len(widths) - 1)]), 0)
    return stretch[first:]
