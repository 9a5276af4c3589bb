"""The panels over time: position against the wall, force by part, energy by element."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from haploop.protocol.amounts import prefix_for
from haploop.tools.figure import style
from haploop.tools.figure.data import Book, Floats, RunData

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MM = 1e3
# The approach is left out of the view when the whole motion is this many times as wide as that since contact.
_DWARFED = 3.0
# Events closer together than this share of the axis have one label.
_NEAR = 0.025


def line(ax: Axes, t: Floats, y: Floats, label: str, colour: str, held: bool = False, **look: Any) -> None:
    """Draws a line over time, reduced to its extremes; ``held`` for a value that holds until the next."""
    keep = extremes(y)
    steps = "steps-post" if held else "default"
    ax.plot(t[keep], y[keep], **{"linewidth": 1.2, "label": label, "color": colour, "drawstyle": steps, **look})


def position_panel(ax: Axes, run: RunData, span_s: tuple[float, float], title: str) -> None:
    """Draws position over time with the wall shaded, fitted to the motion in contact if the approach dwarfs it."""
    inside = (run.t_s >= span_s[0]) & (run.t_s <= span_s[1])
    t, x_mm = run.t_s[inside], np.stack([run.x_m, *run.bodies_m.values()])[:, inside] * MM
    name = ("motor" if "tip" in run.bodies_m else "device") + run.as_measured
    line(ax, t, x_mm[0], name, style.INK, gid="position")
    for body, position in zip(run.bodies_m, x_mm[1:], strict=True):
        line(ax, t, position, body, style.OF_THE_PLANT[body], linewidth=1.0, gid=body)
    ax.set_xlim(*span_s)
    low, high, left_out = _view_mm(run, t, x_mm)
    if run.history.walls:
        _shade_wall(ax, run, span_s, low, high)
    ax.set_ylim(low, high)
    style.dress(ax, title + left_out, "time (s)", "position (mm)")


def _view_mm(run: RunData, t: Floats, x_mm: Floats) -> tuple[float, float, str]:
    """Returns the limits of the position axis, and a note in brackets on what lies outside them.

    ``t`` are times in s, ``x_mm`` the positions of all bodies then, shape (bodies, times).
    """
    if not np.isfinite(x_mm).any():  # the log of a run that was killed may end before any of it
        return -0.01, 0.01, ""
    x_mm = np.where(np.isfinite(x_mm), x_mm, np.nan)
    low, high, note = np.nanmin(x_mm), np.nanmax(x_mm), ""
    contact = run.contact_s()
    since = t >= contact[0] if len(contact) else np.zeros(0, bool)
    if since.any():
        walls = run.wall_at(t[since])[0] * MM
        x_since = x_mm[:, since]
        near = min(np.nanmin(x_since), walls.min()), max(np.nanmax(x_since), walls.max())
        if high - low > _DWARFED * (near[1] - near[0]):
            note = " (approach not shown)"
            low, high = near
    margin = 0.08 * (high - low) or 0.01
    return float(low - margin), float(high + margin), note


def _shade_wall(ax: Axes, run: RunData, span_s: tuple[float, float], low: float, high: float) -> None:
    changes = [wall.from_tick / run.control_rate for wall in run.history.walls]
    edges = np.array([span_s[0], *(t for t in changes if span_s[0] < t < span_s[1]), span_s[1]])
    surface = run.wall_at(edges)[0] * MM
    far = low - (high - low) if run.history.into_wall < 0 else high + (high - low)
    look = {"color": style.WALL_FILL, "zorder": 0, "linewidth": 0, "label": "wall", "gid": "wall"}
    ax.fill_between(edges, surface, far, step="post", **look)
    ax.plot(edges, surface, drawstyle="steps-post", color=style.WALL, linewidth=1.0, zorder=1)


def force_panel(ax: Axes, run: RunData, span_s: tuple[float, float], title: str) -> None:
    """Draws the forces of wall and elements at every tick, and their sum, held from tick to tick."""
    style.dress(ax, title, "time (s)", "force on the device (N)")
    inside = (run.ticks_s >= span_s[0]) & (run.ticks_s <= span_s[1])
    t = run.ticks_s[inside]
    if run.history.elements:
        total = run.controller["total"][inside]
        line(ax, t, total, "total", style.INK, held=True, linewidth=2.4, alpha=0.35, gid="total")
    if run.history.walls:
        line(ax, t, run.controller["wall"][inside], "wall", style.WALL, held=True, gid="wall")
    for number, span in enumerate(run.history.elements):
        times, force = run.element_force(span)
        here = (times >= span_s[0]) & (times <= span_s[1])
        if here.any():
            colour = style.element_colour(number)
            line(ax, times[here], force[here], span.name, colour, held=True, linewidth=1.0, gid=span.name)
    at_steps = (run.t_s >= span_s[0]) & (run.t_s <= span_s[1])
    for name, force in run.plant_forces_N.items():
        # Drawn below the parts that it may equal, and wide enough to be seen beside them.
        look = {"linewidth": 2.8, "alpha": 0.5, "zorder": 1.9, "gid": name}
        line(ax, run.t_s[at_steps], force[at_steps], name, style.OF_THE_PLANT[name], **look)
    most = run.scene.actuator and run.scene.actuator.saturation
    if most is not None and np.abs(run.controller["total"][inside]).max(initial=0.0) > most:
        look = {"color": style.OF_THE_PLANT["actuator"], "linewidth": 0.8, "dashes": (1, 2), "zorder": 0}
        for limit in (-most, most):
            ax.axhline(limit, **look, gid="saturation")
    ax.set_xlim(*span_s)
    ax.axhline(0.0, color=style.FAINT, linewidth=0.8, zorder=0)


def energy_panel(ax: Axes, run: RunData, books: list[Book], colours: dict[str, str]) -> None:
    """Draws the energy taken out of the device: true books as solid lines, sampled ones dashed."""
    energies = np.concatenate([np.empty(0), *(curve for book in books for curve in (book.true_J, book.sampled_J))])
    factor, letter = prefix_for(np.abs(energies[np.isfinite(energies)]).max(initial=0.0, keepdims=True))
    style.dress(ax, "Energy out of the device (below 0: into it)", "time (s)", f"energy ({letter}J)")
    for book in books:
        line(ax, book.t_s, book.true_J / factor, book.name, colours[book.name], linewidth=1.6, gid=f"{book.name}.true")
        look = {"linewidth": 1.0, "dashes": (4, 2), "gid": f"{book.name}.sampled"}
        line(ax, book.t_s, book.sampled_J / factor, "_", colours[book.name], **look)
    for label, dashes in (("true", "-"), ("sampled", (0, (4, 2)))):
        ax.plot([], [], color=style.GREY, linestyle=dashes, linewidth=1.3, label=label)
    ax.axhline(0.0, color=style.GREY, linewidth=0.8, zorder=0)
    ax.set_xlim(*run.span_s)
    style.legend(ax, only=("true", "sampled"))


def mark_events(axes: list[Axes], run: RunData) -> None:
    """Draws a dotted line at each event, numbered from 1 at the top of the first panel."""
    first, last = run.span_s
    groups: list[tuple[float, list[int]]] = []
    for number, event in enumerate(run.events, start=1):
        t = float(event["timestamp"])
        for ax in axes:
            ax.axvline(t, color=style.GREY, linewidth=0.9, linestyle=(0, (1, 2)), gid="event")
        if groups and t - groups[-1][0] < _NEAR * (last - first):
            groups[-1][1].append(number)
        else:
            groups.append((t, [number]))
    for t, numbers in groups:
        label = f"{numbers[0]}" if len(numbers) == 1 else f"{numbers[0]}–{numbers[-1]}"
        axes[0].annotate(
            label, (t, 1.0), xycoords=("data", "axes fraction"), xytext=(0, -2), textcoords="offset points",
            ha="center", va="top", fontsize=style.SMALL, color="white", gid="event-label", annotation_clip=True,
            bbox={"boxstyle": "round,pad=0.25", "facecolor": style.GREY, "linewidth": 0},
        )  # fmt: skip


def extremes(y: np.ndarray, buckets: int = 1500) -> np.ndarray:
    """Finds the samples with which a line looks like the whole series: the smallest and the largest of each bucket.

    Buckets are stretches of equal length; samples that are not finite are skipped where a bucket has others.

    Returns:
        Indices in rising order, at most ``2 * buckets + 2``, with the first and the last; all of a short series.
    """
    samples = len(y)
    width = -(-samples // buckets)
    if width <= 2:
        return np.arange(samples)
    table = np.pad(y, (0, -samples % width), constant_values=np.nan).reshape(-1, width)
    finite = np.isfinite(table)
    starts = np.arange(len(table)) * width
    lowest = starts + np.where(finite, table, np.inf).argmin(axis=1)
    highest = starts + np.where(finite, table, -np.inf).argmax(axis=1)
    return np.unique(np.concatenate([[0, samples - 1], lowest, highest]))
