"""Fig. 6: the paper's simulation, in our interpretation of what it leaves open, and in that nearest to the paper."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from haploop.logger.log.recording import Recording
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
from haploop.tools.linear.one_tick import OneTickMap
from haploop.tools.render.terminal import markdown_table
from haploop.tools.render.units import amount
from haploop.tools.search.random import Point, Row
from haploop.tools.studies.choi2022.claims import HOLDS, RARE_BELOW, Finding, claims_of
from haploop.tools.studies.choi2022.drawing import claims_table, search_words, share_map
from haploop.tools.studies.choi2022.interpretations import (
    Found,
    Option,
    decider,
    holds,
    interval,
    never_together,
    often,
    options,
    percent,
    share,
    yes,
)
from haploop.tools.studies.choi2022.simulation import BASE, NEAREST, SPACE, describe, scene_of, scene_text
from haploop.tools.studies.choi2022.simulation_measure import ASIDE, WHOLE, findings_on_logs, search
from haploop.tools.studies.choi2022.simulation_measure import CLAIMS as COUNTED
from haploop.tools.studies.choi2022.work import Run, Work, run, wall_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CLAIMS = claims_of(6)
# The claims that the search tests under every interpretation, in its words.
TESTED = {name: (COUNTED | ASIDE)[name] for name in CLAIMS if name in COUNTED | ASIDE}
# A claim that holds as often as this, our own interpretation included, needs no assumption.
_ALWAYS = 0.9
_PANELS = {
    "a": "(a) 0.08 N/mm alone",
    "b": "(b) 0.15 N/mm, damping 0.8 N s/m",
    "c": "(c) 0.15 N/mm, unidirectional inertia 10 g",
}
_ANOTHER = "another interpretation than ours or the nearest"


def make(work: Work) -> list[Finding]:
    """Runs both interpretations, and searches for the second."""
    found = search(work)
    runs: dict[str, dict[str, Run]] = {}
    for name, stem, one in (("base", "figure_6", BASE), ("nearest", "figure_6_nearest", found.nearest)):
        runs[name] = {panel: run(scene_of(one, panel)) for panel in "abc"}
        work.figure(_panels(runs[name]), stem, work.tell(f"seen_{name}"))
        work.data(stem, _columns(runs[name]))
        for panel, ran in runs[name].items():
            work.scene(f"{stem}_{panel}", ran.scene)
    for panel in "abc":
        work.text(f"fig6{panel}_nearest.toml", scene_text(found.nearest, panel))
    rows = found.of("random")
    if there := options(rows, SPACE):
        work.figure(share_map(there, [*COUNTED, "all"], len(rows)), "figure_6_search", work.tell("seen_search"))
    work.table("figure_6_interpretations", found.rows)
    work.notes = [_notes(work, found, there)]
    decides = decider(there, "c beats bidirectional")
    smaller, beats = (interval(rows, name, SPACE) for name in ("c smaller", "c beats bidirectional"))
    work.conclude(
        supports=smaller.value >= RARE_BELOW,
        smaller=often(smaller),
        count=len(rows),
        holding=found.of("nearest")[0]["holding"],
        claims=len(COUNTED),
        beats=often(beats),
        decided=f", decided most by the {decides.describe('c beats bidirectional')}" if decides else "",
    )
    return [*(_verdict(name, found) for name in TESTED), *findings_on_logs(CLAIMS, runs), _together(found)]


def _columns(runs: dict[str, Run]) -> dict[str, np.ndarray]:
    kept: dict[str, np.ndarray] = {}
    for panel, (_, _, log) in runs.items():
        plant, ticks, energy = log["/plant"], log["/controller"], log["/energy"]
        kept |= {f"{panel}_t_s": plant["t"], f"{panel}_x_m": plant["x"], f"{panel}_tick_s": ticks["timestamp"]}
        kept |= {f"{panel}_{name}_N": ticks[name] for name in ("wall", "dissipation.0") if name in ticks}
        kept |= {f"{panel}_{name}_J": energy[name] for name in energy if name.endswith((".true", ".sampled"))}
    return kept


def _verdict(name: str, found: Found[Point]) -> Finding:
    """Finds that a claim holds if it does in our interpretation and nearly all; under an assumption if in some.

    That is the nearest interpretation, or what the claim is likeliest with.
    """
    rows, [base], [nearest] = found.of("random"), found.of("base"), found.of("nearest")
    claim, shared = CLAIMS[name], interval(rows, name, SPACE)
    numbers = (
        f"{TESTED[name]}: in {often(shared)} of {len(rows)} random interpretations; ours: {yes(base, name)}, the "
        f"nearest, searched for by these claims: {yes(nearest, name)}"
    )
    if name == "wall unstable":
        growth = OneTickMap.from_scene(replace(scene_of(BASE, "b"), dissipation=())).growth(150.0)
        numbers += f". In contact the loop is linear and grows by a factor of {growth:.4f} a tick"
    if shared.value >= _ALWAYS and holds(base, name):
        return Finding(claim, HOLDS, numbers)
    where = NEAREST if holds(nearest, name) else ""
    if not where and any(holds(row, name) for row in found.rows):
        decides = decider(options(rows, SPACE), name)
        where = f"an interpretation with {decides.best}" if decides else _ANOTHER
    return Finding.by_share(claim, numbers, shared.value, where)


def _together(found: Found[Point]) -> Finding:
    rows, held = found.of("random"), [row for row in found.rows if holds(row, "all")]
    most = _fullest(found)
    lacks = ", ".join(name for name in COUNTED if not holds(most, name))
    numbers = CLAIMS["together"].numbers.format(
        claims=len(COUNTED),
        held=len(held),
        count=len(found.rows),
        random=len(rows),
        most=most["holding"],
        lacks=f", without: {lacks}" if lacks else "",
        nearest=found.of("nearest")[0]["holding"],
        ours=found.of("base")[0]["holding"],
    )
    where = CLAIMS["together"].assumption if held else ""
    return Finding.by_share(CLAIMS["together"], numbers, share(rows, "all"), where)


def _notes(work: Work, found: Found[Point], there: Sequence[Option]) -> str:
    rows, refined, around = (found.of(stage) for stage in ("random", "refined", "neighbour"))
    [base], [nearest], most = found.of("base"), found.of("nearest"), _fullest(found)
    lacks = ", ".join(f"*{name}*" for name in COUNTED if not holds(most, name))
    never = never_together(rows, list(COUNTED))
    missed = ", ".join(f"*{name}* by {nearest[name]:.2g}" for name in COUNTED if nearest[name] > 0.0)
    swings = {key.removeprefix("swing ").removesuffix("_m"): nearest[key] for key in nearest if key[:6] == "swing "}
    numbers = [
        [SPACE.label(key), SPACE.value(key, low), SPACE.value(key, high), SPACE.whys[key]]
        for key, (low, high) in SPACE.bounds.items()
    ]
    alone = claims_table(
        COUNTED | {"all": "all of the above"} | ASIDE,
        SPACE,
        {"ours": base, "nearest": nearest},
        around,
        rows,
        there,
    )
    return work.tell(
        "notes",
        **search_words(SPACE, WHOLE, found, COUNTED),
        held=sum(holds(row, "all") for row in rows),
        held_refined=sum(holds(row, "all") for row in refined),
        limit=work.tell("limit", most=most["holding"], lacks=lacks) if lacks else "",
        both=f"Never both at random: {never}." if never else "Every two of them hold together somewhere.",
        alone=alone,
        aside=", ".join(f"*{name}*" for name in ASIDE),
        described=describe(found.nearest),
        verdict=f"It misses {missed}" if missed else "All claims hold for it",
        distance=nearest["distance"],
        swings=", ".join(f"{name} {amount(value, 'm')}" for name, value in swings.items()),
        all=percent(share(around, "all")),
        mean=np.mean([one["holding"] for one in around]),
        numbers=markdown_table(["number, drawn evenly in its logarithm", "from", "to", "why"], numbers, numbers=(1, 2)),
    )


def _fullest(found: Found[Point]) -> Row:
    """Returns the one with the most claims, of several the nearest to the paper."""
    return max(found.rows, key=lambda row: (row["holding"], -row["distance"]))


def _panels(runs: Mapping[str, Run]) -> Figure:
    """Draws position, force and energy of three runs, by "a", "b" and "c".

    Positions have one scale, by where they swing in the second half: how they came there may run out of it.
    """
    figure = empty_figure(14.0, 8.4)
    axes = figure.subplots(3, 3, sharex="col", squeeze=False)
    ends = []
    for column, (panel, (scene, summary, log)) in zip(axes.T, runs.items(), strict=True):
        surface, t, mm = 1e3 * wall_of(scene).position, log["/plant"]["t"], 1e3 * log["/plant"]["x"]
        _position(column[0], surface, t, mm, f"{_PANELS[panel]}: {summary['verdict']}")
        _force(column[1], log)
        _energy(column[2], log)
        kept = extremes(mm)
        ends.append(mm[kept][t[kept] >= t[kept].max() / 2.0])
        deepest, highest = min(float(end.min()) for end in ends), max(float(end.max()) for end in ends)
        room = max(3.0, 0.5 * (highest - deepest))
        for ax in axes[0]:
            ax.set_ylim(min(deepest, surface) - room, max(highest, surface) + 2.0 * room)
    for ax in axes[:, 1:].ravel():
        ax.set_ylabel("")
    for ax in axes[:2].ravel():
        ax.set_xlabel("")
    return figure


def _curve(ax: Axes, t: np.ndarray, values: np.ndarray, **look: Any) -> None:
    kept = extremes(values)
    ax.plot(t[kept], values[kept], **look)


def _position(ax: Axes, surface: float, t: np.ndarray, mm: np.ndarray, title: str) -> None:
    _curve(ax, t, mm, color=INK, linewidth=1.0, label="device")
    ax.axhspan(surface - 1e4, surface, color=WALL_FILL, zorder=0, linewidth=0)
    ax.axhline(surface, color=WALL, linewidth=1.0, zorder=1, label="wall")
    ax.set_xlim(0.0, float(t[-1]))
    dress(ax, title, "time (s)", "position (mm)")


def _force(ax: Axes, log: Recording) -> None:
    ticks = log["/controller"]
    for name, label, colour in (("wall", "wall", WALL), ("dissipation.0", "element", element_colour(0))):
        if name in ticks:
            _curve(ax, ticks["timestamp"], ticks[name], color=colour, linewidth=0.8, label=label)
    dress(ax, "", "time (s)", "force on the device (N)")
    legend(ax)


def _energy(ax: Axes, log: Recording) -> None:
    t, energy = log["/energy"]["timestamp"], log["/energy"]
    for name in [key.removesuffix(".true") for key in energy if key.endswith(".true")]:
        label, colour = ("wall", WALL) if name == "wall" else ("element", element_colour(0))
        true, sampled = 1e3 * energy[f"{name}.true"], 1e3 * energy[f"{name}.sampled"]
        _curve(ax, t, true, color=colour, linestyle="-", linewidth=1.5, label=label)
        _curve(ax, t, sampled, color=colour, linestyle=(0, (4, 2)), linewidth=1.0, label="_")
    heat = 1e3 * (energy["device_heat"] + energy["hand_heat"])
    ax.plot(t, heat, color=OF_THE_PLANT["hand"], linewidth=1.0, label="heat")
    ax.axhline(0.0, color=GREY, linewidth=0.8, zorder=0)
    dress(ax, "", "time (s)", "energy taken (mJ)")
    legend(ax)
    ax.text(0.01, 1.02, "dashed: sampled books", transform=ax.transAxes, fontsize=SMALL, color=GREY, va="bottom")
