"""Simulated time, counted in whole plant steps and control ticks and never accumulated in floats."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass

from haploop.protocol.scene.scene import MOST_RATE_HZ, Clock, Run, Scene

# Decimal fractions such as 0.0003 s are not exact in binary; a whole number of steps is accepted within this.
_WHOLE_WITHIN = 1e-6
# The key of a scene by which the delay is set, also while a loop runs.
DELAY = "clock.round_trip_delay"
# The most that one run can hold in memory and finish: plant steps in a tick, commands on their way, ticks in all.
_MOST_STEPS, _MOST_ON_THEIR_WAY, _MOST_TICKS = 10_000, 100_000, 10**10
# Some 5 MB: a message of more than 64 MiB is refused, and all that is on its way is held in memory.
_MOST_STEPS_IN_A_BLOCK = 1 << 16


class TimebaseError(ValueError):
    """Raised where rates, delay or duration do not fall on whole steps and ticks."""


@dataclass(frozen=True)
class Timebase:
    """The integers all processes of a run share.

    Step ``s`` is at ``s / plant_rate`` seconds, tick ``k`` is step ``k * steps_per_tick``, and command ``k`` takes
    effect at step ``k * steps_per_tick + delay_steps``. *Interval* ``k`` is the steps from tick k to tick k + 1.

    Attributes:
        plant_rate: plant steps per second, Hz.
        control_rate: control ticks per second, Hz; divides ``plant_rate``.
        delay_steps: round-trip delay in plant steps.
        ticks: number of ticks in the run; it covers ``ticks * steps_per_tick`` steps.
    """

    plant_rate: int
    control_rate: int
    delay_steps: int
    ticks: int

    @classmethod
    def from_clock(cls, clock: Clock, duration: float) -> Timebase:
        """Makes the timebase of a scene's ``[clock]`` table and its duration in seconds.

        Raises:
            TimebaseError: the plant rate is not a whole multiple of the control rate, the delay is not a whole number
                of plant steps, or the duration is not a whole number of control ticks; one sentence for each that
                applies.
        """
        plant_rate, control_rate = clock.plant_rate, clock.control_rate
        delay = clock.round_trip_delay
        complaints = []
        if plant_rate % control_rate:
            complaints.append(_not_whole(plant_rate, control_rate))
        elif plant_rate > _MOST_STEPS * control_rate:
            complaints.append(
                f"plant_rate must be at most {_MOST_STEPS} times control_rate, since all steps of a tick are in "
                f"memory at once, but {plant_rate} Hz is {plant_rate // control_rate} times {control_rate} Hz."
            )
        delay_steps = whole_count(delay, plant_rate, "round_trip_delay", "plant steps", complaints)
        complaints += too_long("round_trip_delay", delay, control_rate)
        ticks = whole_count(duration, control_rate, "duration", "control ticks", complaints)
        if not complaints and ticks < 1:
            complaints.append(f"duration must cover at least one control tick, {1 / control_rate:g} s.")
        if ticks > _MOST_TICKS:
            complaints.append(
                f"duration must cover at most {_MOST_TICKS} control ticks, {_MOST_TICKS / control_rate:g} s, since a "
                "longer run would not finish."
            )
        if complaints:
            raise TimebaseError("\n".join(complaints))
        return cls(plant_rate, control_rate, delay_steps, ticks)

    @classmethod
    def from_scene(cls, scene: Scene) -> Timebase:
        """Makes the timebase of a scene; raises as ``from_clock`` does."""
        return cls.from_clock(scene.clock, scene.duration)

    def as_dict(self) -> dict[str, int]:
        """Returns the four integers, as they travel on the wire."""
        return asdict(self)

    @property
    def steps_per_tick(self) -> int:
        """Number n of plant steps in one control period."""
        return self.plant_rate // self.control_rate

    @property
    def step_s(self) -> float:
        """Plant step h, s."""
        return 1.0 / self.plant_rate

    @property
    def period_s(self) -> float:
        """Control period T, s."""
        return 1.0 / self.control_rate

    @property
    def lookahead_ticks(self) -> int:
        """Returns L, the whole control periods in the delay, floor(delay_steps / n).

        Interval k needs no command later than k - L, so L + 1 samples may go out before a reply is awaited.
        """
        return self.delay_steps // self.steps_per_tick

    def block_ticks(self, run: Run) -> int:
        """Returns the most ticks in a block: ``run.block_ticks``, or fewer where they would hold too many steps."""
        return min(run.block_ticks, _MOST_STEPS_IN_A_BLOCK // self.steps_per_tick)

    def window_ticks(self, run: Run) -> int:
        """Returns how many ticks the clock grants ahead of the slowest lossless node: ``run.window_blocks`` blocks."""
        return run.window_blocks * self.block_ticks(run)

    def tick_ns(self, tick: int) -> int:
        """Returns the time of a tick in whole nanoseconds, rounded down."""
        return tick * 1_000_000_000 // self.control_rate

    def first_tick_at(self, seconds: float) -> int:
        """Returns the first tick at or after a time in s, ceil(seconds * control_rate)."""
        return math.ceil(seconds * self.control_rate - _WHOLE_WITHIN)


def _not_whole(plant_rate: int, control_rate: int) -> str:
    """Returns the complaint about rates of which one does not divide the other, with the nearest of each that would."""
    times = plant_rate / control_rate
    rates = [n * control_rate for n in (math.floor(times), math.ceil(times)) if n]
    counts = range(math.ceil(times), _MOST_STEPS + 1), range(min(math.floor(times), _MOST_STEPS), 0, -1)
    legal = [next((plant_rate // n for n in some if plant_rate % n == 0), 0) for some in counts]
    controls, plants = (" or ".join(f"{rate} Hz" for rate in some if rate) for some in (legal, rates))
    return (
        f"control_rate must divide plant_rate, but {plant_rate} Hz is {times:.6g} times {control_rate} Hz; the "
        f"nearest legal values are a control_rate of {controls}, or a plant_rate of {plants}."
    )


def whole_count(seconds: float, rate: int, name: str, units: str, complaints: list[str]) -> int:
    """Returns ``seconds * rate`` as a whole number; if it is not one, appends a complaint that names the nearest two.

    Args:
        name: what the sentence begins with.
        units: what is counted, such as "plant steps".
    """
    count = seconds * rate
    nearest = round(count)
    if abs(count - nearest) > _WHOLE_WITHIN * max(1.0, abs(count) * 1e-6):
        legal = [n / rate for n in (math.floor(count), math.ceil(count)) if n or name != "duration"]
        named = " and ".join(f"{value:.9g} s" for value in legal)
        complaints.append(
            f"{name} must be a whole number of {units} at {rate} Hz, but {seconds:g} s is {count:.6g} of them; "
            + (f"the nearest legal values are {named}." if len(legal) > 1 else f"the least legal value is {named}.")
            + (_whole_at(seconds, rate) if units == "plant steps" else "")
        )
    return nearest


# A plant rate of up to this many times the given one is suggested.
_MOST_TIMES = 100


def _whole_at(seconds: float, rate: int) -> str:
    """Returns a sentence with the least multiple of a plant rate that makes a time whole steps; "" if there is none."""
    for times in range(2, min(_MOST_TIMES, MOST_RATE_HZ // rate) + 1):
        count = seconds * rate * times
        if abs(count - round(count)) <= _WHOLE_WITHIN:
            return f" With clock.plant_rate = {rate * times} it is {round(count)} of them."
    return ""


def too_long(name: str, delay_s: float, control_rate: int) -> list[str]:
    """Returns a complaint about a delay with more commands on their way than can be held; an empty list for others."""
    if delay_s * control_rate <= _MOST_ON_THEIR_WAY:
        return []
    most_s = _MOST_ON_THEIR_WAY / control_rate
    return [
        f"{name} must be at most {most_s:g} s at {control_rate} Hz: all commands on their way are in memory at once."
    ]


# With blocks that take no longer than this, a viewer, or the log of a killed run, is never far behind.
AT_MOST_S = 0.1
# A shorter block is not worth its messages: where time is granted tick by tick, this much wall time makes a block,
# which is what a page shows at once.
_WORTH_S = 0.03
# Ticks held back for a longer block are published anyway if nothing more is granted for this long.
HELD_S = 0.01
_FIRST_TICKS = 100


class BlockLength:
    """Adapts the length of blocks so that each takes 0.05 to 0.1 s of wall time, up to the scene's ``block_ticks``.

    No bit of a run depends on it.

    Args:
        least_ticks: the shortest block, where a shorter one would cost as much time.
    """

    def __init__(
        self, most_ticks: int, wall_clock: Callable[[], float] = time.perf_counter, least_ticks: int = 1
    ) -> None:
        self._most, self._least = most_ticks, min(least_ticks, most_ticks)
        self.ticks = max(min(most_ticks, _FIRST_TICKS), self._least)
        self._wall_clock = wall_clock
        self._began = wall_clock()

    def is_worth_it(self, ticks: int) -> bool:
        """Tells whether this many ticks make a block: it is full, or has taken 0.03 s."""
        return ticks >= self.ticks or self._wall_clock() - self._began >= _WORTH_S

    def next(self) -> None:
        """Ends a block; doubles the length after a fast one, halves it after a slow one."""
        now = self._wall_clock()
        took_s, self._began = now - self._began, now
        if took_s < AT_MOST_S / 2:
            self.ticks = min(2 * self.ticks, self._most)
        elif took_s > AT_MOST_S:
            self.ticks = max(self.ticks // 2, self._least)
