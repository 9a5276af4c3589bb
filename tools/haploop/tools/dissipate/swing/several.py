"""The search for swings at several frequencies at once in the windows of a recording."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from haploop.logger.verdict.spectrum import Line
from haploop.tools.dissipate.recording.samples import Floats
from haploop.tools.dissipate.swing.buzz import FAST, Overtone, Several
from haploop.tools.dissipate.swing.lines import Slower, Spectrum, is_overtone, swings

# This many windows in a row, a quarter of a window apart, last a second.
_LASTS = 5
# Meanwhile each line keeps this share of its width, so that neither a swing that was struck nor a passing one counts.
_KEPT = 0.7


class _Window(NamedTuple):
    from_s: float
    to_s: float
    lines: tuple[Line, ...]


class SeveralFinder:
    """Keeps the windows that swing at several frequencies, in stretches with as many lines at the same places."""

    def __init__(self) -> None:
        self._stretches: list[list[_Window]] = [[]]

    def part(self) -> None:
        """Begins a new stretch after a gap."""
        self._stretches.append([])

    def look(self, from_s: float, to_s: float, x_m: Floats, spectrum: Spectrum) -> None:
        """Takes a window; its times are those between which it may have swung."""
        window = _Window(from_s, to_s, swings(x_m, spectrum))
        last = self._stretches[-1]
        if last and not _is_alike(window.lines, last[-1].lines):
            last = []
            self._stretches.append(last)
        if window.lines:
            last.append(window)

    def found(self, slower: Sequence[Slower]) -> tuple[Several | None, list[Overtone]]:
        """Returns the swings that last longest without decaying, and lines left out as the shape of slower motions."""
        told, left_out = list[Several](), list[Overtone]()
        for windows in filter(None, map(_steady, self._stretches)):
            columns = zip(*(window.lines for window in windows), strict=True)
            lines = [Line(_median(of, 0), max(line.width for line in of), _median(of, 2)) for of in columns]
            shapes = [Overtone(line, of.line.frequency_Hz) for line in lines for of in slower if _is_shape(line, of)]
            alone = [line for line in lines if all(line is not each.line for each in shapes)]
            left_out += shapes
            if len(alone) > 1:
                width_m = sum(line.width for line in alone)
                widest = tuple((line.frequency_Hz, line.width) for line in sorted(alone, key=lambda line: -line.width))
                told.append(Several(widest, windows[0].from_s, windows[-1].to_s, width_m))
        return max(told, key=lambda each: each.to_s - each.from_s, default=None), left_out


def _median(lines: Sequence[Line], of: int) -> float:
    return float(np.median([line[of] for line in lines]))


def _is_shape(line: Line, of: Slower) -> bool:
    return is_overtone(line.frequency_Hz, line.width, of, 0.5 * FAST.resolved_Hz, of_jumps=True)


def _is_alike(some: tuple[Line, ...], others: tuple[Line, ...]) -> bool:
    near = [
        abs(one.frequency_Hz - other.frequency_Hz) < FAST.resolved_Hz for one, other in zip(some, others, strict=False)
    ]
    return len(some) == len(others) and all(near)


def _steady(stretch: list[_Window]) -> list[_Window]:
    """Returns the windows from the first to the last row of ``_LASTS`` in which every line keeps its width."""
    if len(stretch) < _LASTS:
        return []
    widths = np.array([[line.width for line in window.lines] for window in stretch])
    rows = np.lib.stride_tricks.sliding_window_view(widths, _LASTS, axis=0)
    first = np.flatnonzero((rows.min(axis=-1) >= _KEPT * rows.max(axis=-1)).all(axis=-1))
    return stretch[int(first[0]) : int(first[-1]) + _LASTS] if len(first) else []
