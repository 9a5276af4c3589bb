"""The search for a buzz in the windows of a recording."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from haploop.tools.dissipate.recording.samples import Floats, Samples
from haploop.tools.dissipate.swing.buzz import ABOVE_HZ, LASTS_S, LEAST_RATE_HZ, Buzz, Overtone, Word
from haploop.tools.dissipate.swing.fed import fed_W
from haploop.tools.dissipate.swing.lines import is_overtone, overtone_of, swing
from haploop.view.look.spectrum import Line, main_line

# The spectrum is that of windows so long, a quarter of it apart.
_WINDOW_S, _HOPS = 0.5, 4
_RESOLVED_HZ = 1.0 / _WINDOW_S
# So far from a multiple a line may be for an overtone where the frequency changes within the window.
_BLURRED_HZ = 0.3 * _RESOLVED_HZ
# It goes on to the end of a part whose last half second it swings through, this share of the window before as wide.
_GOES_ON = 0.9
# It does not decay below this share while it lasts: what is struck rings shorter.
_KEPT = 0.7
# A gap of no more than this, after so many times as many samples without one, is bridged by a straight line: the swing
# loses no more of its width than the gap is of a window.
_BRIDGED_S, _BETWEEN = 0.01, 10

# The first window that a swing fills which began within the first, by number; one before it is left out where it is
# less than ``_KEPT`` as wide. Of those left the first and the last may be empty for about a quarter; the third is full.
_FULL, _THIRD = _HOPS - 1, 2


class _Window(NamedTuple):
    """A window that swings.

    Attributes:
        from_s, to_s: where the swing began if this is the first of its stretch, and ended if it is the last.
    """

    from_s: float
    to_s: float
    line: Line
    fed: tuple[float, float] | None


class BuzzFinder:
    """Looks for a buzz in windows of half a second, in bounded memory but for a row a window.

    Args:
        delay_s: from a sample to its force, where one is recorded.

    Attributes:
        longest_s: the longest part without a gap that is not bridged.
        slow: the widest line slower than ``ABOVE_HZ``; None of a motion without one.
    """

    def __init__(self, period_s: float, delay_s: float = 0.0) -> None:
        self._delay_s = delay_s
        self._size = max(4, round(_WINDOW_S / period_s))
        self.rate_Hz = 1.0 / period_s
        self._t_s, self._motion = np.empty(0), np.empty((3, 0))
        self._begins_s = self.longest_s = 0.0
        self.slow: Line | None = None
        # Windows that swing, in stretches without one that does not or has another frequency.
        self._stretches: list[list[_Window]] = [[]]
        # Of the last window of a part without a gap, where a swing that ends in it did -> the end of the part.
        self._part_ends_s = dict[float, float]()
        # Where in what is kept, which begins with the last window, the next one does.
        self._next = 0
        # Samples since the last gap, bridged or not.
        self._whole = 0
        self._left_out: list[Overtone] = []

    def add(self, piece: Samples) -> None:
        """Takes a piece; its times tell a rate that its period is only about."""
        missing = self._bridged(float(piece.t_s[0])) if piece.begins else 0
        self._whole = len(piece.t_s) + (0 if piece.begins else self._whole)
        if piece.begins and not missing:
            self._part_ends_s |= self._end_of_part()
            self._next = 0
            self._t_s, self._motion = np.empty(0), np.empty((3, 0))
            self._begins_s = float(piece.t_s[0])
            self._stretches.append([])
        line = main_line(piece.x_m, self.rate_Hz)
        if line and line.frequency_Hz < ABOVE_HZ and (self.slow is None or line.width > self.slow.width):
            self.slow = line
        force = piece.force_N if piece.held_N is None else piece.held_N
        delay_s = self._delay_s if piece.held_N is None else 0.0
        force = np.full(len(piece.x_m), np.nan) if force is None else force
        rows = np.vstack([piece.t_s, piece.x_m, piece.true_x_m, force])
        if missing:
            before, after = np.append(self._t_s[-1], self._motion[:, -1])[:, None], rows[:, :1]
            filled = before + (after - before) * np.arange(1.0, missing + 1.0) / (missing + 1.0)
            filled[-1] = np.nan  # nothing is known of the force
            rows = np.hstack([filled, rows])
        self._t_s, self._motion = np.append(self._t_s, rows[0]), np.hstack([self._motion, rows[1:]])
        self.longest_s = max(self.longest_s, float(self._t_s[-1]) - self._begins_s)
        while len(self._t_s) >= self._next + self._size:
            self._t_s, self._motion = self._t_s[self._next :], self._motion[:, self._next :]
            x_m, true_x_m, force_N = self._motion[:, : self._size]
            self._look(self._t_s[: self._size], x_m, true_x_m, force_N, delay_s)
            self._next = self._size // _HOPS

    def _bridged(self, to_s: float) -> int:
        """Returns how many samples are missing in the gap up to this time; 0 where it is not bridged."""
        if not len(self._t_s):
            return 0
        missing = round((to_s - float(self._t_s[-1])) * self.rate_Hz) - 1
        return missing if missing <= min(_BRIDGED_S * self.rate_Hz, self._whole / _BETWEEN) else 0

    def _look(self, t_s: Floats, x_m: Floats, true_x_m: Floats, force_N: Floats, delay_s: float) -> None:
        from_s, to_s = float(t_s[0]), float(t_s[-1])
        inside_s = (to_s - from_s) / _HOPS
        rate_Hz = (len(t_s) - 1) / (to_s - from_s)
        line = swing(x_m, rate_Hz)
        if line and (slower := overtone_of(line, x_m, rate_Hz, _BLURRED_HZ)):
            self._left_out.append(Overtone(line, slower.frequency_Hz))
            line = None
        last = self._stretches[-1]
        if last and not (line and abs(line.frequency_Hz - last[-1].line.frequency_Hz) < _RESOLVED_HZ):
            last = []
            self._stretches.append(last)
        if line:
            begins_s = from_s if from_s == self._begins_s else from_s + inside_s
            fed = None if np.isnan(force_N).any() else fed_W(true_x_m, force_N, rate_Hz, line.frequency_Hz, delay_s)
            last.append(_Window(begins_s, to_s - inside_s, line, fed))

    def _end_of_part(self) -> dict[float, float]:
        """Returns the end of this part, by that of its last window, where it swings on to there; else nothing.

        The windows end up to a quarter of one earlier.
        """
        if not (last := self._stretches[-1]) or not self._next:
            return {}
        t_s, x_m = self._t_s[-self._size :], self._motion[0, -self._size :]
        line, before = swing(x_m, (len(t_s) - 1) / float(t_s[-1] - t_s[0])), last[-1].line
        if line is None or abs(line.frequency_Hz - before.frequency_Hz) >= _RESOLVED_HZ:
            return {}
        return {last[-1].to_s: float(t_s[-1])} if line.width >= _GOES_ON * before.width else {}

    def buzz(self) -> Buzz | None:
        """Returns the buzz; None where there was none, or nothing can be said.

        Where one stretch lasts, shorter ones at its frequencies count, too, as long as they are as wide.
        """
        lasting = [kept for stretch in self._stretches if (kept := self._lasting(stretch))]
        if not lasting:
            return None
        kept = [window for stretch in lasting for window in stretch]
        swings_Hz = [window.line.frequency_Hz for window in kept]
        least_Hz, most_Hz, width_m = min(swings_Hz), max(swings_Hz), max(window.line.width for window in kept)

        def is_alike(window: _Window) -> bool:
            is_near = least_Hz - _RESOLVED_HZ < window.line.frequency_Hz < most_Hz + _RESOLVED_HZ
            return is_near and window.line.width >= _KEPT * width_m

        shorter = [window for stretch in self._stretches for window in stretch if is_alike(window)]
        told = sorted({*kept, *shorter}, key=lambda window: window.to_s)
        fed = [window.fed for window in told if window.fed is not None]
        given_W, moved_W = np.mean(fed, axis=0).tolist() if fed else (None, 0.0)
        # What still swings at the end of a part goes on to it.
        ends_s = self._part_ends_s | self._end_of_part()
        return Buzz(
            float(np.median(swings_Hz)),
            0.5 * _RESOLVED_HZ,
            least_Hz,
            most_Hz,
            _joined([(window.from_s, ends_s.get(window.to_s, window.to_s)) for window in told]),
            width_m,
            told[min(_THIRD, len(told) - 1)].line.width,
            told[-1 if told[-1].to_s in ends_s else -min(_THIRD + 1, len(told))].line.width,
            given_W,
            moved_W,
        )

    def _lasting(self, stretch: list[_Window]) -> list[_Window]:
        """Returns the part of a stretch that lasts without decaying; none where it is an overtone of the motion."""
        widths = [window.line.width for window in stretch]
        needed = round(4 * (LASTS_S - _WINDOW_S) / _WINDOW_S)
        lasting = [i for i in range(len(widths) - needed) if widths[i + needed] >= _KEPT * max(widths[i : i + needed])]
        kept = stretch[lasting[0] : lasting[-1] + needed + 1] if lasting else []
        if kept and self.slow:
            frequency_Hz = float(np.median([window.line.frequency_Hz for window in kept]))
            if is_overtone(frequency_Hz, max(window.line.width for window in kept), self.slow):
                self._left_out += [Overtone(window.line, self.slow.frequency_Hz) for window in kept]
                return []
        return _filled(kept)

    def overtone(self) -> Overtone | None:
        """Returns the widest line that lasted and was left out for an overtone; None where there was none."""
        lasted = len(self._left_out) > round(4 * (LASTS_S - _WINDOW_S) / _WINDOW_S)
        return max(self._left_out, key=lambda each: each.line.width) if lasted else None

    def word(self) -> Word:
        """Returns whether the recording buzzes, as far as it can be said."""
        if self.buzz():
            return "buzzes"
        return "none seen" if self.longest_s >= LASTS_S - 1e-9 and self.rate_Hz >= LEAST_RATE_HZ else "cannot say"


def _filled(stretch: list[_Window]) -> list[_Window]:
    """Returns a stretch without the windows at its beginning of which the swing fills a part."""
    widths = [window.line.width for window in stretch]
    first = next((i for i, width in enumerate(widths) if width >= _KEPT * widths[min(_FULL, len(widths) - 1)]), 0)
    return stretch[first:]


def _joined(spans: list[tuple[float, float]]) -> tuple[tuple[float, float], ...]:
    """Joins spans of time that lie no further apart than a window, which tells no shorter pause."""
    joined: list[tuple[float, float]] = []
    for from_s, to_s in sorted(spans):
        if joined and from_s <= joined[-1][1] + _WINDOW_S:
            joined[-1] = joined[-1][0], max(joined[-1][1], to_s)
        else:
            joined.append((from_s, to_s))
    return tuple(joined)
