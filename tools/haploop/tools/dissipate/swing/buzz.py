"""The buzz of a recording: a swing faster than a hand's, at one frequency, that lasts and is wide enough to be felt."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, NamedTuple

from haploop.tools.dissipate.swing.course import Course
from haploop.tools.dissipate.swing.fed import LEAST_FED
from haploop.view.look.spectrum import Line

# Slower swings are a hand's: voluntary ones end at some 8 Hz, tremor at 12 Hz.
ABOVE_HZ = 15.0
# A buzz lasts so long at least.
LASTS_S = 1.0
# Samples a second below which noise has too few lines for one to stand out.
LEAST_RATE_HZ = 200.0

Word = Literal["buzzes", "buzzes at several frequencies", "none seen", "cannot say"]


class Band(NamedTuple):
    """Frequencies among which a swing is looked for, in windows of a length; it lasts two of them at least.

    Attributes:
        share: it has so much of the variance of all that is faster than the least frequency.
        drift: degree of the polynomial that is left out of each window first, since a slow motion would leak.
    """

    above_Hz: float
    below_Hz: float
    window_s: float
    share: float
    drift: int

    @property
    def resolved_Hz(self) -> float:
        return 1.0 / self.window_s


# A buzz; and what is slower, as a tremor is: what lies at the border itself is in both.
FAST = Band(ABOVE_HZ, math.inf, 0.5 * LASTS_S, 0.8, 1)
SLOWER = Band(2.0, ABOVE_HZ + 1.0, LASTS_S, 0.5, 5)


class Span(NamedTuple):
    """A stretch in which it buzzes: from when to when, s, the windows' least and greatest frequency, the widest."""

    from_s: float
    to_s: float
    least_Hz: float
    most_Hz: float
    width_m: float


@dataclass(frozen=True)
class Buzz:
    """The buzz of a recording, in one stretch or more.

    Attributes:
        frequency_Hz, within_Hz: median of the windows', and half of what a window resolves.
        least_Hz, most_Hz: of the windows.
        spans: of each stretch, its ends a fifth of a second at most too early or late.
        width_m: of the widest window, peak to peak, of the sine at its frequency: to 1 % and a tenth of a count beside
            a drift, to 3 % beside a hand's motion fifteen times as wide. Overtones may add some percent. Where it
            changes within a window, that of its widest three periods, to some 5 %.
        course: whether it stayed as wide, or grew or died down all the way but for little, by a fifth at least; else
            its width varied, as that of two buzzes does that are too close to be told apart; None of several stretches,
            and of one that lasts hardly longer than a window, so that less than 0.4 of it is surely filled.
        first_m, last_m: widths where it begins and ends; where it stayed as wide those of the third window, which it
            fills, and of the last, or the last but two where it ends before the recording does.
        least_m: least width of what it fills.
        fed_W: mean power that a recorded force gave to the swing with its overtones, where it fills a window; negative
            where it took; None where none was recorded.
        moved_W: mean of what it would be were force and velocity in phase.
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
        """Returns what the force gave to the swing while it lasted; None where none was recorded."""
        return None if self.fed_W is None else self.fed_W * self.lasts_s

    @property
    def is_fed(self) -> bool:
        """Tells whether the force gave more to the swing than what may be rounding and noise."""
        return self.fed_W is not None and self.fed_W > LEAST_FED * self.moved_W


class Several(NamedTuple):
    """Swings faster than a hand's at two or three frequencies at once, in the stretch that lasts longest.

    Attributes:
        lines: (frequency, Hz, widest, m peak to peak) of each, the widest first.
        width_m: the most that they come to together, peak to peak.
    """

    lines: tuple[tuple[float, float], ...]
    from_s: float
    to_s: float
    width_m: float


class Overtone(NamedTuple):
    """A line that was left out, near a multiple of a slower one."""

    line: Line
    slower_Hz: float

    @property
    def order(self) -> int:
        return round(self.line.frequency_Hz / self.slower_Hz)
