"""Difference over a fixed window: quieter than over one tick, and later."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from haploop.controller.estimators.base import Estimator, Sample
from haploop.protocol.scene.scene import Scene


@dataclass(frozen=True)
class WindowDifference(Estimator):
    """(u[k] - u[k-w]) / (w T) with w = ``ticks``, over the ticks there are as long as they are fewer; 0 at the first.

    Exact for a constant rate. Delays slow signals by w T / 2, as every moving average of w values does. White noise of
    standard deviation sigma in u becomes sqrt(2) sigma / (w T), and a rounding to q steps of q / (w T)
    (Brown, Schneider, Mulligan 1992).

    Memory: (the last w inputs, the newest first, the first input in place of those that never were; ticks since the
    first, at most w).
    """

    name: ClassVar[str] = "window"
    does: ClassVar[str] = "a difference over a window"
    needs: ClassVar[tuple[str, ...]] = ("ticks",)
    ticks: int
    period_s: float

    @classmethod
    def from_scene(cls, scene: Scene, of: str, period_s: float) -> WindowDifference:
        """Makes the one of ``ticks`` in the scene's table."""
        return cls(scene.estimate(of).ticks or 1, period_s)

    def start(self, u: Any, sample: Sample) -> tuple[tuple[Any, ...], int]:
        """Returns a memory full of the first input."""
        return (u,) * self.ticks, 0

    def step(self, memory: tuple[tuple[Any, ...], Any], u: Any, sample: Sample) -> tuple[Any, Any]:
        """Returns the memory with u, and the rate from the oldest to u."""
        recent, age = memory
        rate = (u - recent[-1]) / ((age + (age < 1)) * self.period_s)
        recent = (u,) + recent[:-1]  # noqa: RUF005 - in two thirds of the time
        return (recent, age + (age < self.ticks)), rate
