"""The three runs of Fig. 6 side by side, and the claims that need their logs: heat, what is felt, noise, phases."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from haploop.tools.figure.style import (
    GREY,
    INK,
    OF_THE_PLANT,
    SMALL,
    WALL,
    WALL_FILL,
    dress,
    element_colour,
    empty_figure,
    legend,
)
from haploop.tools.figure.time import extremes
from haploop.tools.render.units import amount
from haploop.tools.studies.choi2022.claims import Claim, Finding
from haploop.tools.studies.choi2022.scenes import faster_m, run, strongest_Hz
from haploop.tools.studies.choi2022.simulation.interpretation import BASE, NEAREST, OURS, scene_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from haploop.logger.log.recording import Recording

Run = tuple[dict[str, Any], dict[str, Any], "Recording"]
_PANELS = {
    "a": "(a) 0.08 N/mm alone",
    "b": "(b) 0.15 N/mm, damping 0.8 N s/m",
    "c": "(c) 0.15 N/mm, unidirectional inertia 10 g",
}
_BOOKS = ((".true", "-", 1.5), (".sampled", (0, (4, 2)), 1.0))
# Least amplitude of a vibration that is felt (Israr, Choi and Tan 2006): at 10 Hz, m.
_FELT_M = 26e-6
_SETTLED_S = 9.0
_HIGH_HZ = 50.0
_NEARLY_ALL = 0.9
_NAMES = {"base": OURS, "nearest": "the nearest"}


def panels(runs: Mapping[str, Run]) -> Figure:
    """Draws position, force and energy of three runs (scene, summary, log), by "a", "b" and "c"."""
    figure = empty_figure(14.0, 8.4)
    axes = figure.subplots(3, 3, sharex="col", squeeze=False)
    for column, (panel, (scene, summary, log)) in enumerate(runs.items()):
        verdict = f"{_PANELS[panel]}: {summary['verdict']}"
        _position(axes[0, column], scene, log, verdict)
        _force(axes[1, column], log)
        _energy(axes[2, column], log)
    for row in range(3):
        for ax in axes[row, 1:]:
            ax.set_ylabel("")
        if row < 2:
            for ax in axes[row]:
                ax.set_xlabel("")
    _same_view(axes[0], [run[0] for run in runs.values()])
    return figure


def _position(ax: Axes, scene: dict[str, Any], log: Recording, title: str) -> None:
    t, mm = log["/plant"]["t"], 1e3 * log["/plant"]["x"]
    kept = extremes(mm)
    ax.plot(t[kept], mm[kept], color=INK, linewidth=1.0, label="device")
    surface = 1e3 * scene["wall"]["position"]
    ax.axhspan(surface - 1e4, surface, color=WALL_FILL, zorder=0, linewidth=0)
    ax.axhline(surface, color=WALL, linewidth=1.0, zorder=1, label="wall")
    ax.set_xlim(0.0, float(t[-1]))
    dress(ax, title, "time (s)", "position (mm)")


def _same_view(axes: np.ndarray, scenes: list[dict[str, Any]]) -> None:
    """Sets one scale for all three, by where they swing in the second half: how they came there may run out of it."""
    surface = 1e3 * scenes[0]["wall"]["position"]
    ends = [_second_half(ax) for ax in axes]
    deepest, highest = min(float(end.min()) for end in ends), max(float(end.max()) for end in ends)
    room = max(3.0, 0.5 * (highest - deepest))
    for ax in axes:
        ax.set_ylim(min(deepest, surface) - room, max(highest, surface) + 2.0 * room)


def _second_half(ax: Axes) -> np.ndarray:
    t, mm = ax.lines[0].get_xdata(), np.asarray(ax.lines[0].get_ydata())
    return mm[np.asarray(t) >= float(np.max(t)) / 2.0]


def _force(ax: Axes, log: Recording) -> None:
    t, controller = log["/controller"]["timestamp"], log["/controller"]
    element = controller.get("dissipation.0")
    named = {"wall": (controller["wall"], WALL)} | (
        {"element": (element, element_colour(0))} if element is not None else {}
    )
    for name, (force, colour) in named.items():
        kept = extremes(force)
        ax.plot(t[kept], force[kept], color=colour, linewidth=0.8, label=name)
    dress(ax, "", "time (s)", "force on the device (N)")
    legend(ax)


def _energy(ax: Axes, log: Recording) -> None:
    t, energy = log["/energy"]["timestamp"], log["/energy"]
    names = [key.removesuffix(".true") for key in energy if key.endswith(".true")]
    for name in names:
        colour = WALL if name == "wall" else element_colour(0)
        for book, style, width in _BOOKS:
            curve = 1e3 * energy[f"{name}{book}"]
            kept = extremes(curve)
            label = ("wall" if name == "wall" else "element") if book == ".true" else "_"
            ax.plot(t[kept], curve[kept], color=colour, linestyle=style, linewidth=width, label=label)
    ax.plot(
        t, 1e3 * (energy["device_heat"] + energy["hand_heat"]), color=OF_THE_PLANT["hand"], linewidth=1.0, label="heat"
    )
    ax.axhline(0.0, color=GREY, linewidth=0.8, zorder=0)
    dress(ax, "", "time (s)", "energy taken (mJ)")
    legend(ax)
    ax.text(0.01, 1.02, "dashed: sampled books", transform=ax.transAxes, fontsize=SMALL, color=GREY, va="bottom")


def findings_on_logs(claims: Mapping[str, Claim], runs: Mapping[str, Mapping[str, Run]]) -> list[Finding]:
    """Tests the claims "heat", "felt", "noise" and "phases" on the runs of both interpretations."""

    def listed(values: Mapping[str, str]) -> str:
        return "; ".join(f"{_NAMES[name]} {value}" for name, value in values.items())

    settled = _heat_over_leak(run(scene_of(BASE, "a") | {"duration": _SETTLED_S})[1])
    swings = {name: of["a"][1]["window"]["oscillation_m"] for name, of in runs.items()}
    felt = {name: f"{amount(swings[name], 'm')} at {strongest_Hz(of['a'][2]):.0f} Hz" for name, of in runs.items()}
    fast = {name: [faster_m(of[panel][2], _HIGH_HZ) for panel in "bc"] for name, of in runs.items()}
    noise = {name: f"{amount(b, 'm')} with damping, {amount(c, 'm')} with inertia" for name, (b, c) in fast.items()}
    quieter = [name for name, (b, c) in fast.items() if c < b]
    phases = {name: _in_phase(of["c"][2]) for name, of in runs.items()}
    return [
        claims["heat"].holds_if(abs(settled - 1.0) < 0.05, settled_s=_SETTLED_S, ratio=settled),
        claims["felt"].holds_if(min(swings.values()) > _FELT_M, swings=listed(felt)),
        claims["noise"].holds_if(
            len(quieter) == len(fast),
            bool(quieter),
            high_Hz=_HIGH_HZ,
            noise=listed(noise),
            where=NEAREST if quieter == ["nearest"] else OURS,
        ),
        claims["phases"].holds_if(
            min(phases.values()) > _NEARLY_ALL,
            max(phases.values()) > _NEARLY_ALL,
            shares=listed({name: f"{100.0 * value:.1f} %" for name, value in phases.items()}),
        ),
    ]


def _in_phase(log: Any) -> float:
    """Returns the share of the ticks with a force at which the acceleration has the direction of motion."""
    force, v, a = (np.asarray(log["/controller"][name]) for name in ("dissipation.0", "v", "a"))
    return float(np.mean((v * a)[force != 0.0] >= 0.0))


def _heat_over_leak(log: Any) -> float:
    """Returns the heat of both dampers over what the wall gave beyond what it took, in whole swings of the last second.

    A swing begins where x rises through its mean.
    """
    energy, x = log["/energy"], np.asarray(log["/controller"]["x"])
    since = len(x) - round(1.0 / (energy["timestamp"][1] - energy["timestamp"][0]))
    above = x[since:] > x[since:].mean()
    rises = since + np.flatnonzero(above[1:] & ~above[:-1])
    first, last = int(rises[0]), int(rises[-1])
    heat, wall = energy["device_heat"] + energy["hand_heat"], energy["wall.true"]
    return float((heat[last] - heat[first]) / (wall[first] - wall[last]))
