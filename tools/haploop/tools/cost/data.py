"""The contents of cost.json: errors, times and prices as ``haploop cost`` measured them."""

from __future__ import annotations

import dataclasses
import json
import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from haploop.tools.linear.stiffness_limit import StiffnessLimit

COST_FILE = "cost.json"


class CostFileError(ValueError):
    """A cost.json that cannot be read."""


@dataclass(frozen=True)
class Spread:
    """Repeated measurements of one quantity: their median, and an interval for the median of infinitely many.

    The interval lies between two order statistics, chosen so that it misses with a probability of at most 5 % whatever
    the distribution; with fewer than six values it spans all of them, and misses more often.
    """

    median: float
    low: float
    high: float

    @classmethod
    def from_values(cls, values: Sequence[float]) -> Spread:
        ranked, n = sorted(values), len(values)
        beyond = 0  # values left out on either side: P(fewer than that many below the median) is at most 2.5 %
        while sum(math.comb(n, k) for k in range(beyond + 1)) <= 0.025 * 2**n:
            beyond += 1
        beyond = max(0, beyond - 1)
        return cls(statistics.median(ranked), ranked[beyond], ranked[n - 1 - beyond])

    def overlaps(self, other: Spread) -> bool:
        return self.low <= other.high and other.low <= self.high


@dataclass(frozen=True, kw_only=True)
class Errors:
    """The distance of a run from its reference: in positions (pointwise), or in the swings alone; the others are None.

    Attributes:
        final_m, rms_m, max_m: of x - x_ref: at the end, root mean square over the ticks, largest.
        amplitude, frequency, energy_per_cycle: relative errors of the swings, >= 0, of their means over many starts;
            ``amplitude_m`` is absolute.
        doubt_m: half of the 95 % interval of ``amplitude_m``; 0 where positions are compared.
        residual: energy residual over the energy moved in total.
    """

    final_m: float | None = None
    rms_m: float | None = None
    max_m: float | None = None
    amplitude: float | None = None
    frequency: float | None = None
    energy_per_cycle: float | None = None
    amplitude_m: float | None = None
    doubt_m: float = 0.0
    residual: float | None = None

    @property
    def size_m(self) -> float:
        """The one number in metres that is drawn: rms_m, else amplitude_m; inf if none."""
        size = self.rms_m if self.rms_m is not None else self.amplitude_m
        return math.inf if size is None else size

    @property
    def at_most_m(self) -> float:
        """The number that is compared with a tolerance: the upper end of the interval."""
        return self.size_m + self.doubt_m


@dataclass(frozen=True)
class Point:
    """One method, as ``clock.integrator`` names it, at one plant rate in Hz.

    Attributes:
        error, failure: one of them is None; a failure is a sentence.
        time: of a simulated tick in one process, books on, no log, over that of the yardstick; for a run that diverged,
            of the ticks before its numbers became too large. None for a scene refused by the check.
    """

    method: str
    plant_rate: int
    error: Errors | None
    failure: str | None
    time: Spread | None = None

    @property
    def at_most_m(self) -> float:
        """Inf where the run failed."""
        return self.error.at_most_m if self.error else math.inf


@dataclass(frozen=True)
class ReferenceNote:
    """The reference that errors are against: how it was made, as a sentence; its own uncertainty.

    ``pointwise`` tells whether positions can be compared, or amplitudes only.
    """

    how: str
    error_m: float
    pointwise: bool


@dataclass(frozen=True)
class SceneCost:
    """Every point of one scene, its own method and rates in Hz, the ticks of a run, and the advice.

    ``compiled`` are points of methods with loops of machine code, which give the same bits: a long run in one process
    uses them if they are available; ``points`` are without.
    """

    name: str
    title: str
    own_method: str
    own_rate: int
    control_rate: int
    ticks: int
    reference: ReferenceNote
    points: list[Point]
    advice: str = ""
    compiled: list[Point] = field(default_factory=list)

    @property
    def own(self) -> Point | None:
        return self.point(self.own_method, self.own_rate)

    def point(self, method: str, plant_rate: int) -> Point | None:
        return next((p for p in self.points if (p.method, p.plant_rate) == (method, plant_rate)), None)

    @property
    def short_title(self) -> str:
        """The title without the words that all scenes of this comparison begin with."""
        title = self.title.removeprefix("Accuracy: ")
        return title[:1].upper() + title[1:]


@dataclass(frozen=True)
class Load:
    """The yardstick while times were taken: the median of its tick, µs, and (q3 - q1) / median; the load average.

    The average counts this program too, and is None if unknown.
    """

    yardstick_us: float
    variation: float
    average: float | None


@dataclass(frozen=True)
class Price:
    """The price of one thing that can be used or left out.

    Attributes:
        time: measured, in the unit of its group.
        adds: the time less the baseline's, repeat by repeat; None for the baseline.
        moves_m: how far the motion is from the baseline's, at most; None where that was not asked for.
        buys: the gain, in words.
        instructions_per_tick: bytecode instructions of plant and controller; None where they were not counted.
        stiffness: up to which a wall stays steady; None where that was not asked for.
    """

    what: str
    time: Spread
    adds: Spread | None
    buys: str
    moves_m: float | None = None
    instructions_per_tick: float | None = None
    stiffness: StiffnessLimit | None = None


@dataclass(frozen=True)
class PriceGroup:
    """Prices of one kind, such as "books" or "delay"; the first of them is the baseline.

    ``how`` tells whether in one process or as processes, which scene, and what is logged.
    """

    name: str
    title: str
    unit: str
    repeats: int
    how: str
    prices: list[Price]


@dataclass(frozen=True)
class Step:
    """A plant step of one method, no friction acting, all methods written and run alike.

    Attributes:
        operations: additions and multiplications of numbers.
        alone, arrays: time over that of the exact flow's step, step by step in Python, and in arrays of many motions.
    """

    method: str
    operations: int
    alone: Spread
    arrays: Spread


@dataclass(frozen=True)
class AlikeScene:
    """Steps of every method on the bodies of one scene of this name."""

    scene: str
    states: int
    steps: list[Step]


@dataclass(frozen=True)
class Cost:
    """All of cost.json; ``load`` is None where no time was measured.

    Times are divided by that of ``yardstick``, a sentence, taken before and after each of them.
    """

    machine: str
    versions: dict[str, str]
    commit: str
    repeats: int
    processes_repeats: int
    tolerance_m: float
    yardstick: str
    load: Load | None
    scenes: list[SceneCost]
    prices: list[PriceGroup] = field(default_factory=list)
    alike: list[AlikeScene] = field(default_factory=list)


def save(cost: Cost, directory: Path) -> Path:
    """Writes DIR/cost.json in one piece and returns its path; numbers that are not finite become null."""
    from haploop.logger.summary import write

    path = directory / COST_FILE
    write(dataclasses.asdict(cost), path)
    return path


def load(directory: Path) -> Cost:
    """Reads DIR/cost.json; raises CostFileError where there is none that this version of ``haploop cost`` wrote."""
    from pydantic import TypeAdapter, ValidationError

    path = directory / COST_FILE
    try:
        return TypeAdapter(Cost).validate_python(json.loads(path.read_text(encoding="utf-8")))
    except OSError as error:
        why = f"{path} could not be read: {error.strerror}. Run haploop cost --out {directory}."
        raise CostFileError(why) from error
    except (ValidationError, ValueError) as error:
        raise CostFileError(f"{path} is not a cost.json of this version: {error}") from error
