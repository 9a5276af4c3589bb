"""The contents of cost.json: errors, times and prices as ``haploop cost`` measured them."""

from __future__ import annotations

import dataclasses
import json
import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from haploop.tools.linear.stiffness_limit import StiffnessLimit
from haploop.tools.operations import AGAIN

COST_FILE = "cost.json"
# A machine on which nothing else runs: the calibration loop varies less, and no second process waits for a core.
QUIET_SPREAD, QUIET_LOAD = 0.05, 1.5


class CostFileError(ValueError):
    """A cost.json that cannot be read."""


@dataclass(frozen=True)
class Spread:
    """Repeated measurements of one time: median and quartiles, in the unit that the name of the entry gives."""

    median: float
    q1: float
    q3: float

    @classmethod
    def from_values(cls, values: Sequence[float]) -> Spread:
        if len(values) == 1:
            return cls(values[0], values[0], values[0])
        q1, median, q3 = statistics.quantiles(values, n=4, method="inclusive")
        return cls(median, q1, q3)


@dataclass(frozen=True, kw_only=True)
class Errors:
    """The distance of a run from its reference: in positions (pointwise), or in the swings alone; the others are None.

    Attributes:
        final_m, rms_m, max_m: of x - x_ref: at the end, root mean square over the ticks, largest.
        amplitude, frequency, energy_per_cycle: relative errors of the swings, >= 0; ``amplitude_m`` is absolute.
        residual: energy residual over the energy moved in total.
        verdict, verdict_right: the run's own, and whether it is the reference's.
    """

    final_m: float | None = None
    rms_m: float | None = None
    max_m: float | None = None
    amplitude: float | None = None
    frequency: float | None = None
    energy_per_cycle: float | None = None
    amplitude_m: float | None = None
    residual: float | None = None
    verdict: str
    verdict_right: bool

    @property
    def size_m(self) -> float:
        """The one number in metres that is drawn and held against a tolerance: rms_m, else amplitude_m; inf if none."""
        size = self.rms_m if self.rms_m is not None else self.amplitude_m
        return math.inf if size is None else size


@dataclass(frozen=True)
class Point:
    """One method, as ``clock.integrator`` names it, at one plant rate in Hz.

    Attributes:
        error, failure: one of them is None; a failure is a sentence.
        us_per_tick: time of a simulated tick in one process, books on, no log; of a run that diverged, of the ticks it
            has until its numbers are too large. None for a scene refused by the check.
        processes_us_per_tick: end to end as processes, every plant step logged; None where not measured.
        instructions_per_tick: bytecode instructions of plant and controller.
    """

    method: str
    plant_rate: int
    error: Errors | None
    failure: str | None
    us_per_tick: Spread | None = None
    processes_us_per_tick: Spread | None = None
    instructions_per_tick: float | None = None

    @property
    def size_m(self) -> float:
        """Inf where the run failed."""
        return self.error.size_m if self.error else math.inf

    @property
    def is_right(self) -> bool:
        """Whether the run went to its end with the reference's verdict."""
        return self.error is not None and self.error.verdict_right


@dataclass(frozen=True)
class ReferenceNote:
    """The reference that errors are against: how it was made, as a sentence; its own uncertainty; its verdict.

    ``pointwise`` tells whether positions can be compared, or amplitudes only.
    """

    how: str
    error_m: float
    pointwise: bool
    verdict: str


@dataclass(frozen=True)
class SceneCost:
    """Every point of one scene, the method and rate that the scene itself names, the ticks of a run, and the advice."""

    name: str
    title: str
    own_method: str
    own_rate: int
    ticks: int
    reference: ReferenceNote
    points: list[Point]
    advice: str = ""

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
    """The load of the machine while times were taken: the median of one-minute load averages, and a spread.

    The average counts this program too, and is None if unknown; the spread is (q3 - q1) / median of a fixed loop.
    """

    average: float | None
    calibration_spread: float

    @property
    def busy(self) -> bool:
        """True where something else seems to have run meanwhile."""
        return self.calibration_spread > QUIET_SPREAD or (self.average or 0.0) > QUIET_LOAD

    def __str__(self) -> str:
        seen = f"a fixed loop timed once a round varied by {100 * self.calibration_spread:.1f} %"
        average = f" and the load average was {self.average:.1f}" if self.average is not None else ""
        return f"The machine was {'busy meanwhile' if self.busy else 'quiet'}: {seen}{average}."


@dataclass(frozen=True)
class Price:
    """The price of one thing that can be had or left.

    Attributes:
        time: measured, in the unit of its group.
        ratio: the median over that of the group's baseline.
        costs: the median less the baseline's, in the unit of its group; of an effect, which is left out, the negative.
        buys: the gain, in words.
        instructions_per_tick: bytecode instructions of plant and controller; None where they were not counted.
        stiffness: up to where a wall stays steady; None where that was not asked for.
    """

    what: str
    time: Spread
    ratio: float
    costs: float
    buys: str
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


def price(
    what: str, times: Sequence[float], baseline: Spread | None, buys: str, is_left_out: bool = False, **more: Any
) -> Price:
    """Makes a price from repeated times; ``baseline`` is None for the baseline itself."""
    time = Spread.from_values(times)
    base = baseline or time
    added = time.median - base.median
    return Price(what, time, time.median / base.median, -added if is_left_out else added, buys, **more)


def chance_in(group: PriceGroup) -> float:
    """Returns the distance of the group's baseline measured twice, at least that of its quartiles: less is chance."""
    again = [abs(price.costs) for price in group.prices if price.what == AGAIN]
    return max([*again, group.prices[0].time.q3 - group.prices[0].time.q1])


@dataclass(frozen=True)
class Cost:
    """All of cost.json; ``load`` is None where no time was measured."""

    machine: str
    versions: dict[str, str]
    commit: str
    repeats: int
    processes_repeats: int
    tolerance_m: float
    load: Load | None
    scenes: list[SceneCost]
    prices: list[PriceGroup] = field(default_factory=list)


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
        raise CostFileError(f"{path} is no cost.json of this version: {error}") from error
