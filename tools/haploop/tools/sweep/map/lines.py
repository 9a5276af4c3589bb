"""The lines over a map that need no run: the exact limit of the linear loop, and analytic bounds."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from haploop.protocol.scene.paths import value_at
from haploop.tools.linear.bounds import Bound, bounds_of
from haploop.tools.linear.linearity import installed_kinds, left_out, why_not_linear
from haploop.tools.linear.one_tick import NotLinear, OneTickMap
from haploop.tools.sweep.map.axis import Ruler
from haploop.tools.sweep.map.data import STIFFNESS
from haploop.tools.sweep.map.plane import Plane

EXACT = "ρ(M) = 1"


@dataclass(frozen=True)
class MapLine:
    """A named line over a map.

    Attributes:
        name: what is written on it.
        words: what it says, and its source.
        pieces: points of each, values of the axes in SI, shape (n, axes).
    """

    name: str
    words: str
    pieces: list[np.ndarray]


def exact_limit(plane: Plane) -> MapLine:
    """Finds where rho(M) = 1 for the linear loop; without lines where it grows nowhere or everywhere.

    Raises:
        NotLinear: the loop of some place is no linear map; the message names what makes it none, in a few words.
    """
    scenes = plane.own_scenes()
    if any("wall" not in scene for scene in scenes):
        raise NotLinear("there is no wall")
    if curved := [reason for scene in scenes for reason in why_not_linear(scene)]:
        raise NotLinear(", ".join(dict.fromkeys(curved)))
    loops: dict[tuple[float, ...], OneTickMap] = {}

    def level(x: float, y: float) -> float:
        key = plane.but_for_stiffness(x, y)
        if key not in loops:
            loops[key] = OneTickMap.from_scene(plane.at(x, y))
        return math.log(loops[key].growth(plane.stiffness(x, y)))

    without = f", without {', '.join(left)}" if (left := left_out(plane.scene)) else ""
    return MapLine(EXACT, f"exact, linear loop in contact{without}", plane.zero_lines(level))


_MEANING = {"passivity": "passive, whatever passive hand holds it", "stability": "stable with the scene's own hand"}
_MOST_LOG = 50.0


def bound_lines(plane: Plane) -> list[MapLine]:
    """Finds for every bound that applies at some place of a panel the line on which the wall is as stiff as it allows.

    A bound that applies but allows no wall of the panel, or every one, has no lines.
    """
    if value_at(plane.scene, STIFFNESS) is None:
        return []
    known: dict[tuple[float, ...], dict[str, Bound]] = {}

    def bounds_at(x: float, y: float) -> dict[str, Bound]:
        key = plane.but_for_stiffness(x, y)
        if key not in known:
            known[key] = {bound.name: bound for bound in bounds_of(plane.at(x, y))}
        return known[key]

    first = {bound.name: bound for bound in bounds_of(plane.scene)}
    lines = {name: plane.zero_lines(_level(plane, bounds_at, name), whole_ticks=True) for name in first}
    applied = {name for bounds in known.values() for name, bound in bounds.items() if bound.applies}
    return [MapLine(name, _MEANING[bound.kind], lines[name]) for name, bound in first.items() if name in applied]


def _level(
    plane: Plane, bounds_at: Callable[[float, float], dict[str, Bound]], name: str
) -> Callable[[float, float], float]:
    """Returns the logarithm of the wall's stiffness over what a bound allows; NaN where the bound does not apply."""

    def level(x: float, y: float) -> float:
        allowed = bounds_at(x, y)[name].stiffness_N_m
        if allowed is None:
            return math.nan
        stiffness = plane.stiffness(x, y)
        if not allowed or not stiffness:
            return _MOST_LOG if stiffness > allowed else -_MOST_LOG
        return float(np.clip(math.log(stiffness / allowed), -_MOST_LOG, _MOST_LOG))

    return level


@dataclass
class PanelLines:
    """The lines over a panel, and their pieces as drawn by name; ``why_none`` where there is no exact limit."""

    lines: list[MapLine] = field(default_factory=list)
    why_none: str = ""
    drawn: dict[str, list[np.ndarray]] = field(default_factory=dict)


def find_lines(texts: Iterable[str | None], rulers: Sequence[Ruler], bounds: bool = True) -> PanelLines:
    """Finds the lines for the first scene there is among some of a panel, as TOML; none over names."""
    text = next((text for text in texts if text), None)
    if text is None:
        return PanelLines(why_none="none of its cells has a scene")
    if any(ruler.axis.names for ruler in rulers):
        return PanelLines()
    scene = tomllib.loads(text)
    elements = {table["kind"] for table in scene.get("dissipation", [])}
    if foreign := sorted(elements - set(installed_kinds())):
        return PanelLines(why_none=f"the element {foreign[0]} comes from a plugin")
    plane = Plane(scene, rulers)
    known = bound_lines(plane) if bounds else []
    try:
        return PanelLines([exact_limit(plane), *known])
    except NotLinear as error:
        return PanelLines(known, str(error))
