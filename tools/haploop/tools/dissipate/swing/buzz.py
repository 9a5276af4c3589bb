"""The buzz of a recording: a swing faster than a hand's, at one frequency, that lasts and is wide enough to be felt."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

from haploop.tools.dissipate.swing.fed import LEAST_FED
from haploop.view.look.spectrum import Line

# Slower swings are a hand's: voluntary ones end at some 8 Hz, tremor at 12 Hz.
ABOVE_HZ = 15.0
# A buzz lasts so long at least.
LASTS_S = 1.0
# Samples a second below which noise has too few lines for one to stand out.
LEAST_RATE_HZ = 200.0

Word = Literal["buzzes", "none seen", "cannot say"]


@dataclass(frozen=True)
class Buzz:
    """The buzz of a recording, in one stretch or more.

    Attributes:
        frequency_Hz, within_Hz: median of the windows', and half of what a window resolves.
        least_Hz, most_Hz: of the windows.
        stretches: (from, to) of each, a fifth of a second at most too early or late, s.
        width_m: of the widest window, peak to peak, of the sine at its frequency: to 1 % and a tenth of a count beside
            a drift, to 3 % beside a hand's motion fifteen times as wide. Overtones may add some percent.
        first_m, last_m: widths of the third window, which it fills, and of the last, or the last but two where it ends
            before the recording does.
        fed_W: mean power that a recorded force gave to the swing with its overtones, where it fills a window; negative
            where it took; None where none was recorded.
        moved_W: mean of what it would be were force and velocity in phase.
    """

    frequency_Hz: float
    within_Hz: float
    least_Hz: float
    most_Hz: float
    stretches: tuple[tuple[float, float], ...]
    width_m: float
    first_m: float
    last_m: float
    fed_W: float | None = None
    moved_W: float = 0.0

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


class Overtone(NamedTuple):
    """A line that was left out, near a multiple of a slower one."""

    line: Line
    slower_Hz: float

    @property
    def order(self) -> int:
        return round(self.line.frequency_Hz / self.slower_Hz)
