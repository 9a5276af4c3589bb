"""The search for a swing in the windows of a recording."""

from __future__ import annotations

import numpy as np

from haploop.logger.verdict.spectrum import Line, amplitudes, main_line
from haploop.tools.dissipate.recording.samples import Floats, Samples
from haploop.tools.dissipate.swing.buzz import (
    FAST,
    LASTS_S,
    LEAST_RATE_HZ,
    SLOWER,
    Band,
    Buzz,
    Overtone,
    Several,
    Word,
)
from haploop.tools.dissipate.swing.course import widths
from haploop.tools.dissipate.swing.fed import fed_W
from haploop.tools.dissipate.swing.hidden import HiddenFinder
from haploop.tools.dissipate.swing.lasting import HOPS, NEEDED, lasting, make_buzz
from haploop.tools.dissipate.swing.lines import Slower, fast_rms_m, overtone_of, swing, within_counts
from haploop.tools.dissipate.swing.several import SeveralFinder
from haploop.tools.dissipate.swing.windows import End, Window, widest_m

# A swing continues to the end of a part if it lasts through its last half second with at least this share of the width
# in the window before.
_GOES_ON = 0.9
# A gap no longer than this, s, after at least this many times as many samples without one, is bridged by a straight
# line: the share of its width that the swing loses is no more than the gap's share of a window.
_BRIDGED_S, _BETWEEN = 0.01, 10


class BuzzFinder:
    """Looks for a swing in windows, in memory that is bounded except for one row per window.

    Args:
        delay_s: time from a sample to its force, where one is recorded.
        band: the frequencies of the swing, and the length of a window.

    Attributes:
        longest_s: length of the longest part without a gap that is not bridged.
        short_s: total length of the parts without such a gap that were too short for a swing that lasts.
        slow: the widest line slower than the band; None without one.
        slower: in the search for a buzz, that for a swing just slower than a buzz.
        hidden: the search for swings that are no wider than a staircase of counts may be.
    """

    def __init__(self, period_s: float, delay_s: float = 0.0, band: Band = FAST) -> None:
        self._delay_s, self._band = delay_s, band
        self._size = max(4, round(band.window_s / period_s))
        self._several, self.hidden = SeveralFinder(), HiddenFinder(band)
        self.slower = BuzzFinder(period_s, delay_s, SLOWER) if band is FAST else None
        self.rate_Hz = 1.0 / period_s
        self._t_s, self._motion = np.empty(0), np.empty((3, 0))
        self._begins_s = self.longest_s = self._shorter_s = 0.0
        self.slow: Line | None = None
        # Windows that swing, in stretches; a window that does not, or has another frequency, ends a stretch.
        self._stretches: list[list[Window]] = [[]]
        # For parts without a gap: time at which a swing in the last window of the part ended -> the end of the part.
        self._part_ends = dict[float, End]()
        # Index of the next window in the samples kept, which begin with the last window.
        self._next = 0
        # Samples since the last gap, bridged or not.
        self._whole = 0
        self._left_out: list[Overtone] = []
        # R.m.s. motion of every window faster than the band's least frequency, m; 0 between parts.
        self._fast_m: list[float] = []

    def add(self, piece: Samples) -> None:
        """Takes a piece; its times give a rate to which the period is only approximate."""
        if self.slower:
            self.slower.add(piece)
        missing = self._bridged(float(piece.t_s[0])) if piece.begins else 0
        self._whole = len(piece.t_s) + (0 if piece.begins else self._whole)
        if piece.begins and not missing:
            self._part_ends |= self._end_of_part()
            self._shorter_s = self.short_s
            self._next = 0
            self._t_s, self._motion = np.empty(0), np.empty((3, 0))
            self._begins_s = float(piece.t_s[0])
            self._stretches.append([])
            self._several.part()
            self.hidden.end()
            self._fast_m.append(0.0)
        line = main_line(piece.x_m, self.rate_Hz)
        if line and line.frequency_Hz < self._band.above_Hz and (self.slow is None or line.width > self.slow.width):
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
            self._next = self._size // HOPS

    @property
    def short_s(self) -> float:
        lasts_s = float(self._t_s[-1] if len(self._t_s) else self._begins_s) - self._begins_s
        return self._shorter_s + (lasts_s if lasts_s < LASTS_S - 1e-9 else 0.0)

    def _bridged(self, to_s: float) -> int:
        """Returns how many samples are missing in the gap up to this time; 0 where it is not bridged."""
        if not len(self._t_s):
            return 0
        missing = round((to_s - float(self._t_s[-1])) * self.rate_Hz) - 1
        return missing if missing <= min(_BRIDGED_S * self.rate_Hz, self._whole / _BETWEEN) else 0

    def _look(self, t_s: Floats, x_m: Floats, true_x_m: Floats, force_N: Floats, delay_s: float) -> None:
        from_s, to_s = float(t_s[0]), float(t_s[-1])
        inside_s = (to_s - from_s) / HOPS
        rate_Hz = (len(t_s) - 1) / (to_s - from_s)
        line = swing(x_m, rate_Hz, self._band)
        if line and (count_m := within_counts(line, x_m)):
            self.hidden.look(line, count_m)
            line = None
        else:
            self.hidden.end()
        if self._band is FAST:
            spectrum = amplitudes(x_m, rate_Hz)
            self._fast_m.append(fast_rms_m(spectrum))
            since_s = from_s if from_s == self._begins_s else from_s + inside_s
            self._several.look(since_s, to_s - inside_s, x_m, spectrum)
        if line and (slower := overtone_of(line, x_m, rate_Hz, self._band)):
            self._left_out.append(Overtone(line, slower.frequency_Hz))
            line = None
        last = self._stretches[-1]
        if last and not (line and abs(line.frequency_Hz - last[-1].line.frequency_Hz) < self._band.resolved_Hz):
            last = []
            self._stretches.append(last)
        if line:
            begins = from_s == self._begins_s
            fed = None if np.isnan(force_N).any() else fed_W(true_x_m, force_N, rate_Hz, line.frequency_Hz, delay_s)
            along = widths(x_m, rate_Hz, line.frequency_Hz)
            begins_s, width_m = from_s if begins else from_s + inside_s, widest_m(line, along, begins)
            last.append(Window(begins_s, to_s - inside_s, line, fed, (from_s, to_s - from_s), along, width_m))

    def _end_of_part(self) -> dict[float, End]:
        """Returns the end of this part, by the end of its last window, where the swing continues to it; else nothing.

        The windows end up to a quarter of a window earlier.
        """
        if not (last := self._stretches[-1]) or not self._next:
            return {}
        t_s, x_m = self._t_s[-self._size :], self._motion[0, -self._size :]
        lasts_s = float(t_s[-1] - t_s[0])
        rate_Hz = (len(t_s) - 1) / lasts_s
        line, before = swing(x_m, rate_Hz, self._band), last[-1].line
        if (
            line is None
            or within_counts(line, x_m)
            or abs(line.frequency_Hz - before.frequency_Hz) >= self._band.resolved_Hz
        ):
            return {}
        if line.width < _GOES_ON * before.width:
            return {}
        along = widths(x_m, rate_Hz, line.frequency_Hz)
        width_m = widest_m(line, along, ends=True)
        return {last[-1].to_s: End(float(t_s[-1]), (float(t_s[0]), lasts_s), along, width_m)}

    def buzz(self) -> Buzz | None:
        """Returns the buzz; None where there was none, or nothing can be said."""
        lasting, _ = self._parted()
        return make_buzz(lasting, self._stretches, self._part_ends | self._end_of_part(), self._band)

    def _slower(self) -> list[Slower]:
        """Returns the slower motions of which a line may be an overtone."""
        found = [Slower(self.slow)] if self.slow else []
        if self.slower and (of := self.slower.buzz()):
            line = Line(0.5 * (of.least_Hz + of.most_Hz), of.width_m, 1.0)
            found.append(Slower(line, 0.5 * (of.most_Hz - of.least_Hz)))
        return found

    def _parted(self) -> tuple[list[list[Window]], list[Overtone]]:
        """Returns the part of each stretch that lasts, and the lines left out as overtones of a slower motion."""
        slower = self._slower()
        parts = [lasting(stretch, slower) for stretch in self._stretches]
        return [kept for kept, _ in parts if kept], [*self._left_out, *(one for _, left in parts for one in left)]

    def several(self) -> Several | None:
        """Returns the swings at several frequencies at once; None where there were none that last."""
        return self._several.found(self._slower())[0]

    def fast_rms_m(self) -> float:
        """Returns the largest r.m.s. motion above 15 Hz that all windows of a second reach; 0 for less than that."""
        rows = [min(self._fast_m[at : at + NEEDED + 1]) for at in range(len(self._fast_m) - NEEDED)]
        return max(rows, default=0.0)

    def overtone(self) -> Overtone | None:
        """Returns the widest line that lasted and was left out as an overtone; None where there was none."""
        _, left = self._parted()
        lasted = left if len(left) > NEEDED else []
        some = [*lasted, *self._several.found(self._slower())[1]]
        return max(some, key=lambda each: each.line.width, default=None)

    def word(self) -> Word:
        """Returns whether the recording buzzes, as far as that can be said."""
        if self.buzz():
            return "buzzes"
        if self.several():
            return "buzzes at several frequencies"
        if self.hidden.found:
            return "cannot say"
        return "none seen" if self.longest_s >= LASTS_S - 1e-9 and self.rate_Hz >= LEAST_RATE_HZ else "cannot say"
