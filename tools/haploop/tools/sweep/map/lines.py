"""The lines over a map that need no run: the exact limit of the linear loop and analytic bounds, and their drawing."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from textwrap import fill
from typing import TYPE_CHECKING, NamedTuple, NotRequired, TypedDict

import numpy as np

from haploop.protocol.scene.scene import Scene
from haploop.tools.figure.labels import LabelRoom
from haploop.tools.figure.style import INK
from haploop.tools.linear.bounds import bounds_of
from haploop.tools.linear.linearity import installed_kinds, left_out, why_not_linear
from haploop.tools.linear.one_tick import NotLinear, OneTickMap
from haploop.tools.sweep.map.axis import Axis
from haploop.tools.sweep.map.plane import Level, Plane

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

EXACT = "ρ(M) = 1"
_MEANING = {"passivity": "passive, whatever passive hand holds it", "stability": "stable with the scene's own hand"}
_MOST_LOG = 50.0
# Points of a straight line, so that there is room for its name.
_POINTS = 41
_DASHES = ((5, 2), (2, 1.5), (7, 2, 1.5, 2), (1, 1), (9, 3), (4, 1.5, 1, 1.5, 1, 1.5))
_COLOURS = ("#0B5FA5", "#7A1FA2", "#00664A", "#5B3A29", "#8A0F3C", "#3C3C8F")
_STAR = "#C00000"


@dataclass(frozen=True)
class MapLine:
    """A named line over a map.

    Attributes:
        words: its meaning and source.
        pieces: points of each, values of the axes in SI, shape (n, axes).
    """

    name: str
    words: str
    pieces: list[np.ndarray]


@dataclass
class PanelLines:
    """The lines over a panel, and their pieces as drawn, by name; ``why_none``: why there is no exact limit."""

    lines: list[MapLine] = field(default_factory=list)
    why_none: str = ""
    drawn: dict[str, list[np.ndarray]] = field(default_factory=dict)


def find_lines(texts: Iterable[str | None], axes: Sequence[Axis], bounds: bool = True) -> PanelLines:
    """Finds the lines for the first scene among some of a panel, given as TOML; none over an axis of names."""
    text = next((text for text in texts if text), None)
    if text is None:
        return PanelLines(why_none="none of its cells has a scene")
    if any(axis.names for axis in axes):
        return PanelLines()
    scene = Scene.from_dict(tomllib.loads(text))
    elements = {element.name for element in scene.dissipation}
    if foreign := sorted(elements - set(installed_kinds())):
        return PanelLines(why_none=f"the element {foreign[0]} comes from a plugin")
    plane = Plane(scene, axes)
    known = bound_lines(plane) if bounds else []
    try:
        return PanelLines([exact_limit(plane), *known])
    except NotLinear as error:
        return PanelLines(known, str(error))


def exact_limit(plane: Plane) -> MapLine:
    """Finds where rho(M) = 1 for the linear loop; no lines where it grows nowhere or everywhere.

    Raises:
        NotLinear: the loop at some place is not a linear map; the message names the reason in a few words.
    """
    scenes = plane.own_scenes()
    if any(scene.wall is None for scene in scenes):
        raise NotLinear("there is no wall")
    if curved := [reason for scene in scenes for reason in why_not_linear(scene)]:
        raise NotLinear(", ".join(dict.fromkeys(curved)))
    loop = plane.once_for_all_stiffnesses(OneTickMap.from_scene)
    without = f", without {', '.join(left)}" if (left := left_out(plane.scene)) else ""
    pieces = plane.zero_lines(lambda x, y: math.log(loop(x, y).growth(plane.stiffness(x, y))))
    return MapLine(EXACT, f"exact, linear loop in contact{without}", pieces)


def bound_lines(plane: Plane) -> list[MapLine]:
    """Finds, for every bound that applies somewhere in a panel, the line on which the wall is as stiff as it allows.

    A bound that applies but allows no wall of the panel, or every one, has no lines.
    """
    if plane.scene.wall is None:
        return []
    bounds = plane.once_for_all_stiffnesses(bounds_of)
    applied: set[str] = set()

    def stiffness_over(place: int) -> Level:
        """Makes the logarithm of the wall's stiffness over that which a bound allows; NaN where it does not apply."""

        def level(x: float, y: float) -> float:
            bound, stiffness = bounds(x, y)[place], plane.stiffness(x, y)
            if (allowed := bound.stiffness_N_m) is None:
                return math.nan
            applied.add(bound.name)
            if not allowed or not stiffness:
                return _MOST_LOG if stiffness > allowed else -_MOST_LOG
            return float(np.clip(math.log(stiffness / allowed), -_MOST_LOG, _MOST_LOG))

        return level

    known = bounds_of(plane.scene)
    lines = [plane.zero_lines(stiffness_over(place), whole_ticks=True) for place in range(len(known))]
    found = [MapLine(bound.name, _MEANING[bound.kind], line) for bound, line in zip(known, lines, strict=True)]
    return [line for line in found if line.name in applied]


class LineStyle(TypedDict):
    """The look of a line, as matplotlib takes it."""

    color: str
    linewidth: float
    dashes: NotRequired[tuple[float, ...]]


def line_styles(names: Sequence[str]) -> dict[str, LineStyle]:
    """Returns the look of every line by its name, each with different dashes; the exact limit is solid and black."""
    styles: dict[str, LineStyle] = {EXACT: {"color": INK, "linewidth": 2.0}} if EXACT in names else {}
    for number, name in enumerate(name for name in names if name != EXACT):
        turn = number % len(_COLOURS)
        styles[name] = {"color": _COLOURS[turn], "dashes": _DASHES[turn], "linewidth": 1.8}
    return styles


def line_signs(styles: Mapping[str, LineStyle], panels: Iterable[PanelLines]) -> list[Artist]:
    """Makes the sign of every line, labelled with its name and meaning."""
    from matplotlib.lines import Line2D

    words = {line.name: line.words for panel in panels for line in panel.lines}
    return [Line2D([], [], **style, label=fill(f"{name}: {words[name]}", 32)) for name, style in styles.items()]


def draw_line(ax: Axes, line: MapLine, axes: Sequence[Axis], style: LineStyle) -> list[np.ndarray]:
    """Draws all pieces of a line, and returns them in the coordinates of the panel.

    A piece that is one value of the only axis is drawn as a vertical line.
    """
    from matplotlib.patheffects import Normal, withStroke

    look = {
        **style,
        "zorder": 4 if len(axes) == 2 else 1.5,
        "path_effects": [withStroke(linewidth=style["linewidth"] + 1.8, foreground="white"), Normal()],
        "gid": f"boundary {line.name}",
        "solid_capstyle": "round",
    }
    drawn = []
    for piece in line.pieces:
        places = np.column_stack([axis.place(piece[:, number]) for number, axis in enumerate(axes)])
        if len(axes) == 1:
            for (x,) in places:
                ax.axvline(x, **look)
            low, high = np.log(ax.get_ylim())
            upper = np.exp(np.linspace(high, low + 0.75 * (high - low), _POINTS))
            places = np.column_stack([np.full(_POINTS, places[0, 0]), upper])
        else:
            if len(places) == 1:
                places = _across(places[0], axes)
            ax.plot(places[:, 0], places[:, 1], **look)
        drawn.append(places)
    return drawn


def _across(place: np.ndarray, axes: Sequence[Axis]) -> np.ndarray:
    """Returns a point as a line across the only cell along an axis."""
    points = np.tile(place, (_POINTS, 1))
    for number, axis in enumerate(axes):
        if len(axis.values) == 1:
            points[:, number] = np.linspace(axis.edges[0], axis.edges[-1], _POINTS)
    return points


class Star(NamedTuple):
    """The answer of a panel: the place of its star, in the coordinates of the panel, and its label, ever shorter.

    ``off`` are corners of the areas to which it does not apply, which the label keeps off.
    """

    x: float
    y: float
    texts: Sequence[str]
    off: Sequence[np.ndarray] = ()


def write_names(
    ax: Axes, panels: Sequence[PanelLines], styles: Mapping[str, LineStyle], star: Star | None, avoid_markers: bool
) -> None:
    """Draws the star and writes its label, and each line's name on its longest piece where the lines are of one panel.

    Call when the panel's place is fixed; a label without room is not written.
    """
    room = LabelRoom(ax)
    room.avoid_texts(ax.texts)
    if avoid_markers:
        room.avoid_markers()
    room.avoid_lines(piece for panel in panels for pieces in panel.drawn.values() for piece in pieces)
    if star:
        ax.plot(star.x, star.y, "*", color=_STAR, markersize=13, markeredgecolor="white", zorder=6, gid="star")
        room.beside(star.x, star.y, star.texts, _STAR, "star words", star.off)
    for name, pieces in panels[0].drawn.items() if len(panels) == 1 else ():
        if pieces:
            room.on_line(max(pieces, key=len), name, styles[name]["color"], "name of a line")
