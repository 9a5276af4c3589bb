"""Fig. 6: the paper's simulation, in our interpretation of what it leaves open, and in the one nearest to the paper."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from haploop.launch.scene.toml_writer import inline
from haploop.logger.log.recording import Recording
from haploop.protocol.amounts import amount
from haploop.protocol.scene.scene import accelerometer_is_used
from haploop.protocol.scene.table import Table
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
from haploop.tools.figure.time import line
from haploop.tools.linear.one_tick import OneTickMap
from haploop.tools.render.terminal import told
from haploop.tools.search.random import Point
from haploop.tools.studies.choi2022.figures.claims import HOLDS, RARE_BELOW, Finding
from haploop.tools.studies.choi2022.figures.drawing import claims_table, columns_of, open_table, search_words
from haploop.tools.studies.choi2022.figures.work import Work
from haploop.tools.studies.choi2022.interpretations import (
    Found,
    Option,
    decider,
    holds,
    interval,
    often,
    options,
    share,
)
from haploop.tools.studies.choi2022.runs import Run, faster_m, hand_of, run, strongest_Hz, wall_of
from haploop.tools.studies.choi2022.simulation import (
    ASIDE,
    BASE,
    CLAIMS,
    SPACE,
    WHOLE,
    scene_of,
    search,
    used_numbers,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# The claims that the search tests under every interpretation, as it words them.
_TESTED = CLAIMS | ASIDE
_OURS, _NEAREST = "our interpretation", "[the nearest interpretation](#figure-6)"
# A claim that holds in this share of interpretations, and in our own, needs no assumption.
_ALWAYS = 0.9
_PANELS = {
    "a": "(a) 0.08 N/mm alone",
    "b": "(b) 0.15 N/mm, damping 0.8 N s/m",
    "c": "(c) 0.15 N/mm, unidirectional inertia 10 g",
}
# Least amplitude of a vibration that is felt (Israr, Choi and Tan 2006), at 10 Hz, m.
_FELT_M = 26e-6
_SETTLED_S, _HIGH_HZ, _NEARLY_ALL = 9.0, 50.0, 0.9


def make_6(work: Work) -> list[Finding]:
    """Runs both interpretations, and searches for the second."""
    found = search(work)
    runs: dict[str, dict[str, Run]] = {}
    for name, stem, one in ((_OURS, "figure_6", BASE), ("the nearest", "figure_6_nearest", found.nearest)):
        runs[name] = {panel: run(scene_of(one, panel)) for panel in "abc"}
        work.figure(_panels(runs[name]), stem, work.tell(f"seen_{stem}"))
        for panel, ran in runs[name].items():
            work.scene(f"{stem}_{panel}", ran.scene)
    for panel in "abc":
        work.text(f"fig6{panel}_nearest.toml", scene_text(work, found.nearest, panel))
    rows, there = found.of("random"), options(found.of("random"), SPACE)
    work.data("figure_6_interpretations", columns_of(found.rows))
    alone = {"ours": found.of("base")[0], "nearest": found.of("nearest")[0]}
    chosen = found.nearest.choices
    words = search_words(found, WHOLE, CLAIMS)
    table = claims_table(CLAIMS | {"all": "all of the above"} | ASIDE, SPACE, alone, found, there)
    described = SPACE.describe(chosen | found.nearest.numbers, [*chosen, *used_numbers(chosen)])
    aside = ", ".join(f"*{name}*" for name in ASIDE)
    work.notes = [work.tell("notes", **words, table=table, aside=aside, described=described, open=open_table(SPACE, 6))]
    smaller, beats = (interval(rows, name, SPACE) for name in ("c smaller", "c beats bidirectional"))
    decided = decider(there, "c beats bidirectional") or "–"
    supports = smaller.value >= RARE_BELOW
    work.conclude(supports=supports, smaller=often(smaller), beats=often(beats), decided=decided, **words)
    return [
        *(_verdict(work, name, found, there) for name in _TESTED if name in work.claims),
        *_on_logs(work, runs),
        _together(work, found),
    ]


def scene_text(work: Work, interpretation: Point, panel: str) -> str:
    """Returns the scene file of an interpretation, which extends the paper's scene of the panel."""
    scene = scene_of(interpretation, panel)
    hand, title = hand_of(scene), work.texts[f"scene_{panel}"]
    sensing = ("encoder", "noise", "velocity", "acceleration")
    tables = {"hand.force": hand.force} | {name: getattr(scene, name) for name in sensing}
    lines = [
        work.tell("about_scene", title=title).rstrip(),
        f"title = {inline(title)}",
        f'extends = "scenes/fig6{panel}.toml"',
        f"duration = {inline(scene.duration)}",
        f"seed = {inline(scene.seed)}",
        "",
        "[hand]",
        f"rest = {inline(hand.rest)}",
    ]
    for name, table in tables.items():
        lines += ["", f"[{name}]", *_lines(table)] if table else []
    for element in scene.dissipation:
        lines += ["", "[[dissipation]]", *_lines(element)]
    lines += ["", "[accelerometer]  # ideal: it has no key"] * accelerometer_is_used(scene)
    return "\n".join(lines) + "\n"


def _lines(table: Table) -> list[str]:
    return [f"{key} = {inline(value)}" for key, value in table.as_dict().items()]


def _verdict(work: Work, name: str, found: Found, there: Sequence[Option]) -> Finding:
    """Finds that a claim holds if it does in our interpretation and nearly all others; under an assumption if in some.

    The assumption is the nearest interpretation, or the option with which the claim is likeliest.
    """
    rows, [base], [nearest] = found.of("random"), found.of("base"), found.of("nearest")
    claim, shared, decides = work.claims[name], interval(rows, name, SPACE), decider(there, name)
    ours, searched = ("yes" if holds(row, name) else "no" for row in (base, nearest))
    computed = {"share": often(shared), "count": len(rows), "ours": ours, "nearest": searched}
    numbers = f"{_TESTED[name]}: {work.tell('tested', **computed)}"
    if name == "wall unstable":
        growth = OneTickMap.from_scene(replace(scene_of(BASE, "b"), dissipation=())).growth(150.0)
        numbers += claim.numbers.format(growth=growth)
    if shared.value >= _ALWAYS and holds(base, name):
        return Finding(claim, HOLDS, numbers)
    if holds(nearest, name):
        return Finding.by_share(claim, numbers, shared.value, _NEAREST)
    likeliest = work.tell("likeliest", option=decides.best) if decides else work.texts["another"]
    return Finding.by_share(claim, numbers, shared.value, likeliest * any(holds(row, name) for row in found.rows))


def _together(work: Work, found: Found) -> Finding:
    held = [row for row in found.rows if holds(row, "all")]
    most = max(found.rows, key=lambda row: (row["holding"], -row["distance"]))
    claim, [base] = work.claims["together"], found.of("base")
    numbers = claim.numbers.format(
        **search_words(found, WHOLE, CLAIMS),
        held=len(held),
        count=len(found.rows),
        without=", ".join(name for name in CLAIMS if not holds(most, name)) or "nothing",
        ours=base["holding"],
    )
    return Finding.by_share(claim, numbers, share(found.of("random"), "all"), claim.assumption if held else "")


def _on_logs(work: Work, runs: Mapping[str, Mapping[str, Run]]) -> list[Finding]:
    """Tests the claims "heat", "felt", "noise" and "phases" on the runs of both interpretations."""

    def listed(values: Mapping[str, str]) -> str:
        return "; ".join(f"{name} {value}" for name, value in values.items())

    settled = _heat_over_leak(run(replace(scene_of(BASE, "a"), duration=_SETTLED_S)).log)
    swings = {name: of["a"].summary["window"]["oscillation_m"] for name, of in runs.items()}
    felt = {name: f"{amount(swings[name], 'm')} at {strongest_Hz(of['a'].log):.0f} Hz" for name, of in runs.items()}
    fast = {name: [faster_m(of[panel].log, _HIGH_HZ) for panel in "bc"] for name, of in runs.items()}
    noise = {name: f"{amount(b, 'm')} with damping, {amount(c, 'm')} with inertia" for name, (b, c) in fast.items()}
    quieter = [name for name, (b, c) in fast.items() if c < b]
    where = _OURS if _OURS in quieter else _NEAREST
    phases = {name: _in_phase(of["c"].log) for name, of in runs.items()}
    shares = {name: f"{100.0 * value:.1f} %" for name, value in phases.items()}
    claims, always, once = work.claims, min(phases.values()) > _NEARLY_ALL, max(phases.values()) > _NEARLY_ALL
    return [
        claims["heat"].holds_if(abs(settled - 1.0) < 0.05, settled_s=_SETTLED_S, ratio=settled),
        claims["felt"].holds_if(min(swings.values()) > _FELT_M, swings=listed(felt)),
        claims["noise"].holds_if(len(quieter) == 2, bool(quieter), high_Hz=_HIGH_HZ, noise=listed(noise), where=where),
        claims["phases"].holds_if(always, once, shares=listed(shares)),
    ]


def _in_phase(log: Recording) -> float:
    """Returns the share of the ticks with a force at which the acceleration is in the direction of motion."""
    force, v, a = (log["/controller"][name] for name in ("dissipation.0", "v", "a"))
    return float(np.mean((v * a)[force != 0.0] >= 0.0))


def _heat_over_leak(log: Recording) -> float:
    """Returns the heat of both dampers over the net energy that the wall gave, in whole swings of the last second.

    A swing begins where x rises through its mean.
    """
    energy, x = log["/energy"], log["/controller"]["x"]
    since = len(x) - round(1.0 / (energy["timestamp"][1] - energy["timestamp"][0]))
    above = x[since:] > x[since:].mean()
    rises = since + np.flatnonzero(above[1:] & ~above[:-1])
    first, last = int(rises[0]), int(rises[-1])
    heat, wall = energy["device_heat"] + energy["hand_heat"], energy["wall.true"]
    return float((heat[last] - heat[first]) / (wall[first] - wall[last]))


def _panels(runs: Mapping[str, Run]) -> Figure:
    """Draws position, force and energy of three runs, by "a", "b" and "c".

    All positions have one scale, chosen by the swing in the second half: the motion before may run out of it.
    """
    figure = empty_figure(14.0, 8.4)
    axes = figure.subplots(3, 3, sharex="col", squeeze=False)
    ends = []
    for column, (panel, (scene, summary, log)) in zip(axes.T, runs.items(), strict=True):
        surface, t, mm = 1e3 * wall_of(scene).position, log["/plant"]["t"], 1e3 * log["/plant"]["x"]
        _position(column[0], surface, t, mm, f"{_PANELS[panel]}: {told(summary)}")
        _force(column[1], log)
        _energy(column[2], log)
        ends.append(mm[t >= t[-1] / 2.0])
        deepest, highest = min(float(end.min()) for end in ends), max(float(end.max()) for end in ends)
        room = max(3.0, 0.5 * (highest - deepest))
        for ax in axes[0]:
            ax.set_ylim(min(deepest, surface) - room, max(highest, surface) + 2.0 * room)
    for ax in axes[:, 1:].ravel():
        ax.set_ylabel("")
    for ax in axes[:2].ravel():
        ax.set_xlabel("")
    return figure


def _position(ax: Axes, surface: float, t: np.ndarray, mm: np.ndarray, title: str) -> None:
    line(ax, t, mm, "device", INK, linewidth=1.0)
    ax.axhspan(surface - 1e4, surface, color=WALL_FILL, zorder=0, linewidth=0)
    ax.axhline(surface, color=WALL, linewidth=1.0, zorder=1, label="wall")
    ax.set_xlim(0.0, float(t[-1]))
    dress(ax, title, "time (s)", "position (mm)")


def _force(ax: Axes, log: Recording) -> None:
    ticks = log["/controller"]
    for name, label, colour in (("wall", "wall", WALL), ("dissipation.0", "element", element_colour(0))):
        if name in ticks:
            line(ax, ticks["timestamp"], ticks[name], label, colour, linewidth=0.8)
    dress(ax, "", "time (s)", "force on the device (N)")
    legend(ax)


def _energy(ax: Axes, log: Recording) -> None:
    t, energy = log["/energy"]["timestamp"], log["/energy"]
    for name in [key.removesuffix(".true") for key in energy if key.endswith(".true")]:
        label, colour = ("wall", WALL) if name == "wall" else ("element", element_colour(0))
        line(ax, t, 1e3 * energy[f"{name}.true"], label, colour, linewidth=1.5)
        line(ax, t, 1e3 * energy[f"{name}.sampled"], "_", colour, linewidth=1.0, dashes=(4, 2))
    heat = 1e3 * (energy["device_heat"] + energy["hand_heat"])
    ax.plot(t, heat, color=OF_THE_PLANT["hand"], linewidth=1.0, label="heat")
    ax.axhline(0.0, color=GREY, linewidth=0.8, zorder=0)
    dress(ax, "", "time (s)", "energy taken (mJ)")
    legend(ax)
    ax.text(0.01, 1.02, "dashed: sampled books", transform=ax.transAxes, fontsize=SMALL, color=GREY, va="bottom")
