"""The loops of Choi et al. 2022: force against position (Fig. 3) and momentum against velocity (Fig. 4)."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np

from haploop.protocol.register import UnknownKind
from haploop.protocol.walls.registry import make_wall
from haploop.tools.figure import style
from haploop.tools.figure.data import ElementSpan, Floats, RunData
from haploop.tools.figure.time import MM

if TYPE_CHECKING:
    from matplotlib.axes import Axes

GRAMS = 1e3
# Points of the curve of a wall that is not a spring.
_CURVE = 200


def force_position_loop(run: RunData, span_s: tuple[float, float]) -> tuple[Floats, Floats]:
    """Returns penetration (m, positive inside) and force out of the wall (N) at the plant steps of a stretch of time.

    The force is the one applied, the total of wall and elements, held while the position moves on. Where the loop runs
    counter-clockwise, the area within is energy given to the device (Choi et al. 2022, Fig. 3).
    """
    t, x, force = within(span_s, run.t_s, run.t_s, run.x_m, run.force_N)
    position, _ = run.wall_at(t)
    return (x - position) * run.history.into_wall, -force * run.history.into_wall


def momentum_loop(run: RunData, span: ElementSpan) -> tuple[Floats, Floats, Floats]:
    """Returns time, velocity v[k-1] and momentum m[k-1] v[k] of a virtual inertia at the ticks it covers.

    m[k] is the mass while the inertia is at work and 0 while it is not. The rectangles of width v[k-1] - v[k-2] and
    height m v[k] are the energy it takes in a step (Choi et al. 2022, eq. 8 and Fig. 4), so clockwise is dissipation.
    """
    times, force = run.element_force(span)
    at = np.searchsorted(run.ticks_s, times)
    v = run.controller["v"][at]
    mass = np.where(force != 0.0, span.element.parameters["mass"], 0.0)
    return times[1:], v[:-1], mass[:-1] * v[1:]


def draw_force_position(ax: Axes, run: RunData, span_s: tuple[float, float]) -> None:
    """Draws force against penetration, with pressing and releasing told apart, beside that of the ideal wall."""
    title = "Force against penetration"
    if not run.history.walls:
        _say(ax, title, "No wall in this scene, so there is no\nforce against penetration to show.")
        return
    early_depth, early_force = force_position_loop(run, run.early_s())
    depth, force = force_position_loop(run, span_s)
    if not any((loop > 0.0).any() for loop in (early_depth, depth)):
        _say(ax, title, "The device does not touch the wall.")
        return
    style.dress(ax, title, f"penetration{run.as_measured} (mm)", "force out of the wall (N)")
    early = {"color": style.EARLY, "linewidth": 0.8, "label": "first second of contact", "gid": "early"}
    ax.plot(early_depth * MM, early_force, **early)
    pressing = np.diff(depth, append=depth[-1:]) > 0
    for part, colour, label in ((pressing, style.PRESSING, "pressing"), (~pressing, style.RELEASING, "releasing")):
        # Each stretch continues to the point after it.
        drawn = part | np.concatenate([[False], part[:-1]]) if len(part) else part
        x, y = np.where(drawn, depth * MM, np.nan), np.where(drawn, force, np.nan)
        ax.plot(x, y, color=colour, linewidth=1.1, label=label, gid=label)
    in_contact = np.concatenate([d[(f != 0.0) | (d > 0.0)] for d, f in ((early_depth, early_force), (depth, force))])
    in_contact = in_contact[np.isfinite(in_contact)]
    deepest = in_contact.max(initial=0.0)
    with suppress(UnknownKind):  # for a kind from a package or file that is not here
        wall = make_wall(run.wall_table_at(span_s[1]))
        label, points = ("ideal spring", 2) if wall.kind == "spring" else ("ideal wall, at rest", _CURVE)
        line = np.linspace(0.0, deepest, points)
        ideal = {"color": style.INK, "linewidth": 1.0, "dashes": (4, 2), "label": label, "gid": "spring"}
        ax.plot(line * MM, wall.held(line), **ideal)
    low, high = in_contact.min(initial=0.0) * MM, deepest * MM
    margin = 0.06 * (high - low) or 0.01
    ax.set_xlim(low - margin, high + margin)
    style.corner_legend(ax)


def _say(ax: Axes, title: str, text: str) -> None:
    """Writes in place of a loop why there is none."""
    style.dress(ax, title, "", "")
    ax.set_axis_off()
    look: dict[str, Any] = {"fontsize": style.SMALL + 1, "color": style.GREY, "transform": ax.transAxes}
    ax.text(0.5, 0.5, text, ha="center", va="center", **look)


def draw_momentum(ax: Axes, run: RunData, span_s: tuple[float, float]) -> None:
    """Draws momentum against velocity of the virtual inertias at work in a stretch of time; without any, the motion."""
    loops = [
        (number, span, within(span_s, *momentum_loop(run, span)))
        for number, span in enumerate(run.history.elements)
        if "inertia" in span.element.name and "mass" in span.element.parameters
    ]
    loops = [loop for loop in loops if len(loop[2][0])]
    if not loops:
        about = f"position{run.as_measured} (mm)\n(no virtual inertia, so no momentum loop)"
        style.dress(ax, "Velocity against position", about, "velocity (m/s)")
        for stretch, colour, name in ((run.early_s(), style.EARLY, "early"), (span_s, style.INK, "motion")):
            x, v = within(stretch, run.t_s, run.x_m, run.v_m_s)
            ax.plot(x * MM, v, color=colour, linewidth=0.9, gid=name)
        style.few_ticks(ax)
        return
    style.dress(ax, "Virtual momentum against velocity", "velocity v[k−1] (m/s)", "momentum m v[k] (g m/s)")
    for number, span, (velocity, momentum) in loops:
        early_velocity, early_momentum = within(run.early_s(span.from_tick), *momentum_loop(run, span))
        dots = {"linestyle": "none", "marker": ".", "markersize": 5}
        ax.plot(early_velocity, early_momentum * GRAMS, color=style.EARLY, **dots)
        colour = style.element_colour(number)
        ax.plot(velocity, momentum * GRAMS, color=colour, linewidth=0.8, alpha=0.4)
        ax.plot(velocity, momentum * GRAMS, color=colour, label=span.name, gid=span.name, **dots)
        ends = np.array([velocity.min(), velocity.max()])
        ax.plot(ends, ends * span.element.parameters["mass"] * GRAMS, color=style.INK, linewidth=1.0, dashes=(4, 2))
    ax.plot([], [], color=style.INK, linewidth=1.0, dashes=(4, 2), label="ideal inertia")
    ax.axhline(0.0, color=style.FAINT, linewidth=0.8, zorder=0)
    style.corner_legend(ax)


def within(span_s: tuple[float, float], t_s: Floats, *series: Floats) -> list[Floats]:
    inside = (t_s >= span_s[0]) & (t_s <= span_s[1])
    return [values[inside] for values in series]
