"""What a finding is, and the wording that findings share."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from haploop.tools.cost.advice import rate
from haploop.tools.cost.data import Point, SceneCost
from haploop.tools.render.units import amount, fixed


@dataclass(frozen=True)
class Finding:
    """What it is about, and what was found."""

    about: str
    text: str


def name_of(scene: SceneCost) -> str:
    """What it is called among the scenes of this comparison."""
    name = scene.title.removeprefix("Accuracy: ")
    return name[:1].upper() + name[1:]


def length(metres: float) -> str:
    """With a prefix, or with a power of ten for what no device measures."""
    return amount(metres, "m") if metres == 0.0 or metres >= 1e-9 else f"{metres:.1e} m".replace("-", "−")


def of_scenes(count: int, whole: int) -> str:
    return f"{count} of {whole} scene{'s' * (whole != 1)}"


def span(values: Iterable[float]) -> str:
    """``1.2 to 6.9``, or one number."""
    found = list(values)
    low, high = fixed(min(found), 2), fixed(max(found), 2)
    return low if low == high else f"{low} to {high}"


def times(ratio: float) -> str:
    return f"{fixed(ratio, 2)} times"


def rates(points: list[Point]) -> str:
    rates = sorted({point.plant_rate for point in points})
    return rate(rates[0]) if len(rates) == 1 else f"{rate(rates[0])} to {rate(rates[-1])}"


def joined(words: list[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
