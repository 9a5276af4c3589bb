"""The buzz of a recording: a swing faster than a hand's, at one frequency, that lasts and is wide enough to be felt."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, NamedTuple

from haploop.logger.verdict.spectrum import Line
from haploop.tools.dissipate.swing.course import Course
from haploop.tools.dissipate.swing.fed import LEAST_FED

# Slower swings are a hand's: voluntary ones end at some 8 Hz, tremor at 12 Hz.
ABOVE_HZ = 15.0
# A buzz lasts at least this long.
LASTS_S = 1.0
# Samples a second below which noise has too few spectral lines for one to stand out.
LEAST_RATE_HZ = 200.0

Word = Literal["buzzes", "buzzes at several frequencies", "none seen", "cannot say"]


class Band(NamedTuple):
    """Frequencies among which a swing is looked for, in windows of one length; it lasts at least two of them.

    Attributes:
        share: least share of the swing in the variance of all motion faster than the least frequency.
        drift: degree of the polynomial that is first taken out of each window, since a slow motion would leak.
    """

    above_Hz: float
    below_Hz: float
    window_s: float
    share: float
    drift: int

    @property
    def resolved_Hz(self) -> float:
        return 1.0 / self.window_s


# A buzz; and slower swings, such as a tremor: one at the border itself is in both bands.
FAST = Band(ABOVE_HZ, math.inf, 0.5 * LASTS_S, 0.8, 1)
SLOWER = Band(2.0, ABOVE_HZ + 1.0, LASTS_S, 0.5, 5)


class Span(NamedTuple):
    """A stretch in which it buzzes: start and end, s, the windows' least and greatest frequency, and largest width."""

    from_s: float
    to_s: float
    least_Hz: float
    most_Hz: float
    width_m: float


@dataclass(frozen=True)
class Buzz:
    """The buzz of a recording, in one stretch or more.

    Attributes:
        frequency_Hz, within_Hz: median frequency of the windows, and half of what a window resolves.
        least_Hz, most_Hz: least and greatest frequency of the windows.
        spans: one for each stretch, with ends at most a fifth of a second too early or late.
        width_m: peak-to-peak width, in the widest window, of the sine at its frequency: to 1 % and a tenth of a count
            beside a drift, to 3 % beside a hand's motion fifteen times as wide. Overtones may add some percent. Where
            the width changes within a window, that of its widest three periods, to some 5 %.
        course: whether it stayed as wide, or grew or died down almost all the way, by at least a fifth; else its width
            varied, as that of two buzzes too close to be told apart does; None for several stretches, and for one
            hardly longer than a window, so that less than 0.4 of it is surely filled.
        first_m, last_m: widths where it begins and ends; where it stayed as wide, those of the third window, which it
            fills, and of the last window, or the last but two where it ends before the recording does.
        least_m: least width in the part that it fills.
        fed_W: mean power that a recorded force gave to the swing with its overtones, where it fills a window; negative
            where the force took power; None where none was recorded.
        moved_W: mean of the power that it would be if force and velocity were in phase.
    """

    frequency_Hz: float
    within_Hz: float
    least_Hz: float
    most_Hz: float
    spans: tuple[Span, ...]
    width_m: float
    course: Course | None
    first_m: float
    last_m: float
    least_m: float
    fed_W: float | None = None
    moved_W: float = 0.0

    @property
    def stretches(self) -> tuple[tuple[float, float], ...]:
        """Returns (from, to) of each stretch, s."""
        return tuple((span.from_s, span.to_s) for span in self.spans)

    @property
    def lasts_s(self) -> float:
        return sum(to_s - from_s for from_s, to_s in self.stretches)

    @property
    def fed_J(self) -> float | None:
        """Returns the energy that the force gave to the swing while it lasted; None where no force was recorded."""
        return None if self.fed_W is None else self.fed_W * self.lasts_s

    @property
    def is_fed(self) -> bool:
        """Tells whether the force gave more to the swing than may be rounding and noise."""
        return self.fed_W is not None and self.fed_W > LEAST_FED * self.moved_W


class Several(NamedTuple):
    """Swings faster than a hand's at two or three frequencies at once, in the stretch that lasts longest.

    Attributes:
        lines: (frequency, Hz, greatest width, m peak to peak) of each, the widest first.
        width_m: the most that their widths add up to, peak to peak.
    """

    lines: tuple[tuple[float, float], ...]
    from_s: float
    to_s: float
    width_m: float


class Overtone(NamedTuple):
    """A line that was left out, since it lies near a multiple of a slower one."""

    line: Line
    slower_Hz: float

    @property
    def order(self) -> int:
        return round(self.line.frequency_Hz / self.slower_Hz)
