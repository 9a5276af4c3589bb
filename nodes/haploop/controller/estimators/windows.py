"""Differences over a window of ticks: of fixed length, or as long as the signal is a straight line."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from haploop.controller.estimators.base import Estimator, Sample
from haploop.protocol.arrays import where
from haploop.protocol.scene.scene import Scene


@dataclass(frozen=True)
class WindowDifference(Estimator):
    """(u[k] - u[k-w]) / (w T) with w = ``ticks``, or over all ticks so far while they are fewer; 0 at the first.

    Exact for a constant rate. Delays slow signals by w T / 2, as every moving average of w values does. White noise of
    standard deviation sigma in u becomes sqrt(2) sigma / (w T), and rounding to q becomes steps of q / (w T)
    (Brown, Schneider, Mulligan 1992).

    Memory: (the last w inputs, the newest first, the first input in place of those before it; ticks since the first,
    at most w).
    """

    name: ClassVar[str] = "window"
    does: ClassVar[str] = "a difference over a window"
    needs: ClassVar[tuple[str, ...]] = ("ticks",)
    ticks: int
    period_s: float

    @classmethod
    def from_scene(cls, scene: Scene, of: str, period_s: float) -> WindowDifference:
        return cls(scene.estimate(of).ticks or 1, period_s)

    def start(self, u: Any, sample: Sample) -> tuple[tuple[Any, ...], int]:
        return (u,) * self.ticks, 0

    def step(self, memory: tuple[tuple[Any, ...], Any], u: Any, sample: Sample) -> tuple[Any, Any]:
        recent, age = memory
        rate = (u - recent[-1]) / ((age + (age < 1)) * self.period_s)
        recent = (u,) + recent[:-1]  # noqa: RUF005 - in two thirds of the time
        return (recent, age + (age < self.ticks)), rate


# A deviation of exactly the bound, frequent in quantised signals, counts as within it, however it is rounded.
_ROUNDING = 1e-6


@dataclass(frozen=True)
class EndFit(Estimator):
    """(u[k] - u[k-i]) / (i T), i <= ``ticks`` the longest window that fits (Janabi-Sharifi et al. 2000, end-fit-FOAW).

    Window i fits when the line through its two ends passes within ``bound`` of every sample between:
    |u[k-j] - u[k] + (u[k] - u[k-i]) j / i| <= bound for 0 < j < i; window 1 always does. 0 at the first tick.

    Where the rate is constant and the noise stays within +-bound / 2 every window fits, so that the error is at
    most bound / (n T) with n = ``ticks``: rounding to q is such noise, hence the default bound of one count.
    Delays by i T / 2; white noise sigma becomes sqrt(2) sigma / (i T), each with the current i. Where the rate steps,
    noise apart, by more than 2 bound / T, the window is 1 in the tick after, 2 in the next, and grows with the new
    rate. A bound below the noise leaves little more than window 1.

    Memory: the last n inputs, the newest first; NaN in place of those before the first, so that no window that holds
    one fits.
    """

    name: ClassVar[str] = "foaw"
    does: ClassVar[str] = "the slope over the longest window that fits"
    needs: ClassVar[tuple[str, ...]] = ("ticks",)
    takes: ClassVar[tuple[str, ...]] = ("bound", "fit")
    needs_without: ClassVar[Mapping[str, tuple[str, ...]]] = {"bound": ("encoder",)}
    linear: ClassVar[bool] = False
    ticks: int
    bound: Any
    period_s: float

    @classmethod
    def from_scene(cls, scene: Scene, of: str, period_s: float) -> EndFit:
        """Makes the estimator that the scene's table asks for; a velocity's bound is one count unless it is given."""
        table = scene.estimate(of)
        count = scene.encoder.resolution if scene.encoder and of == "velocity" else 0.0
        bound = count if table.bound is None else table.bound
        return (BestFit if table.fit == "best" else EndFit)(table.ticks or 1, bound, period_s)

    def start(self, u: Any, sample: Sample) -> tuple[Any, ...]:
        return (u * math.nan,) * self.ticks

    def step(self, memory: tuple[Any, ...], u: Any, sample: Sample) -> tuple[tuple[Any, ...], Any]:
        recent = (u,) + memory[:-1]  # noqa: RUF005 - in two thirds of the time
        return recent, self.rate(u, memory)

    def rate(self, u: Any, recent: tuple[Any, ...]) -> Any:
        """Returns the slope from end to end of the longest window that fits."""
        rate, period_s = u - u, self.period_s
        for i, rise, fits in _windows(u, recent, self.bound):
            rate = where(fits, rise / (i * period_s), rate)
        return rate


@dataclass(frozen=True)
class BestFit(EndFit):
    """The least-squares slope over the window that ``EndFit`` finds (Janabi-Sharifi et al. 2000, best-fit-FOAW).

    With r[j] = u[k] - u[k-j]: 6 (sum of (2 j - i) r[j], j = 1..i) / (T i (i + 1) (i + 2)). Delays by i T / 2 as the
    end-fit does; white noise sigma becomes sqrt(12 / (i (i + 1) (i + 2))) sigma / T, less than with the end-fit from
    i = 3 on.
    (The authors' best fit also chooses its window by its own line; here one window serves both.)
    """

    def rate(self, u: Any, recent: tuple[Any, ...]) -> Any:
        rate = total = moment = u - u
        for i, rise, fits in _windows(u, recent, self.bound):
            total = total + rise
            moment = moment + i * rise
            slope = 6.0 * (2.0 * moment - i * total) / (i * (i + 1) * (i + 2) * self.period_s)
            rate = where(fits, slope, rate)
        return rate


def _windows(u: Any, recent: tuple[Any, ...], bound: Any) -> Iterator[tuple[int, Any, Any]]:
    """Yields every window i = 1, 2, ... with its rise u[k] - u[k-i], and whether its line fits.

    A line through u[k] passes within the bound of u[k-j] when its rise per tick is within (u[k] - u[k-j] +- bound) / j,
    so each sample narrows the range for the longer windows. All windows are tried: a longer one may fit where a shorter
    one does not, and the members of a batch each have their own longest.
    """
    reach = bound * (1.0 + _ROUNDING)
    least, most = -math.inf, math.inf
    for i, before in enumerate(recent, 1):
        rise = u - before
        slope = rise / i
        yield i, rise, (least <= slope) & (slope <= most)
        low, high = (rise - reach) / i, (rise + reach) / i
        least = where(low > least, low, least)
        most = where(high < most, high, most)
