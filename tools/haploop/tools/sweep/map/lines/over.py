"""What is drawn over a panel without a run: the exact limit and the bounds, or why there is no exact limit."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from haploop.tools.linear.linearity import installed_kinds
from haploop.tools.linear.one_tick import NotLinear
from haploop.tools.sweep.map.axis import Ruler
from haploop.tools.sweep.map.lines.bounds import bound_boundaries
from haploop.tools.sweep.map.lines.limit import Boundary, exact_boundary
from haploop.tools.sweep.map.plane import Plane


@dataclass
class Over:
    """The boundaries of a panel, and where they run on the paper by name; ``why_none`` where there is no exact one."""

    boundaries: list[Boundary] = field(default_factory=list)
    why_none: str = ""
    drawn: dict[str, list[np.ndarray]] = field(default_factory=dict)


def over_scene(texts: Iterable[str | None], rulers: Sequence[Ruler], bounds: bool = True) -> Over:
    """The boundaries of the first scene there is among some of a panel, as TOML; none over names."""
    text = next((text for text in texts if text), None)
    if text is None:
        return Over(why_none="none of its cells has a scene")
    if any(ruler.axis.names for ruler in rulers):
        return Over()
    scene = tomllib.loads(text)
    elements = {table["kind"] for table in scene.get("dissipation", [])}
    if foreign := sorted(elements - set(installed_kinds())):
        return Over(why_none=f"the element {foreign[0]} comes from a plugin")
    plane = Plane(scene, rulers)
    known = bound_boundaries(plane) if bounds else []
    try:
        return Over([exact_boundary(plane), *known])
    except NotLinear as error:
        return Over(known, str(error))
