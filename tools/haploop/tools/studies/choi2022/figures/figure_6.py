"""Fig. 6: the paper's simulation, in our interpretation of what it leaves open, and in that nearest to the paper."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from haploop.logger.log.recording import Recording
from haploop.protocol.scene.scene import Scene
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
from haploop.tools.studies.choi2022.claims import Finding, claims_of
from haploop.tools.studies.choi2022.drawing import (
    by_number_of_claims,
    claims_table,
    list_of_choices,
    pairs_never_together,
    share_map,
)
from haploop.tools.studies.choi2022.interpretations import (
    SEED,
    Found,
    decider,
    holds,
    options,
    percent,
    share,
    yes,
)
from haploop.tools.studies.choi2022.simulation import (
    BASE,
    NEAREST,
    SPACE,
    describe,
    scene_of,
    scene_text,
)
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
_BOOKS = ((".true", "-", 1.5), (".sampled", (0, (4, 2)), 1.0))


def make(work: Work) -> list[Finding]:
    """Runs both interpretations, and searches for the second."""
    found = search(work)
    interpretations = {"base": BASE, "nearest": found.nearest}
    runs: dict[str, dict[str, Run]] = {name: {} for name in interpretations}
    for name, stem in (("base", "figure_6"), ("nearest", "figure_6_nearest")):
        for panel in "abc":
            runs[name][panel] = run(scene_of(interpretations[name], panel))
        work.figure(_panels(runs[name]), stem, work.tell(f"seen_{name}"))
        work.data(stem, _columns(runs[name]))
        for panel, one in runs[name].items():
            work.scene(f"{stem}_{panel}", one.scene)
    for panel in "abc":
        work.text(f"fig6{panel}_nearest.toml", scene_text(found.nearest, panel))
    rows = found.of("random")
    if there := options(rows, SPACE):
        work.figure(share_map(there, [*COUNTED, "all"], len(rows)), "figure_6_search", work.tell("seen_search"))
    work.table("figure_6_interpretations", found.rows)
    work.notes = _notes(work, found)
    decides = decider(there, "c beats bidirectional")
    work.answer = work.tell(
        "answer",
        smaller=percent(share(rows, "c smaller")),
        count=len(rows),
        holding=found.of("nearest")[0]["holding"],
        claims=len(COUNTED),
        beats=percent(share(rows, "c beats bidirectional")),
        decided=f", decided most by the {decides.describe('c beats bidirectional')}" if decides else "",
    )
    return [*(_verdict(name, found) for name in TESTED), *findings_on_logs(CLAIMS, runs), _together(found)]


def _columns(runs: dict[str, Run]) -> dict[str, np.ndarray]:
    """Returns what is drawn, by panel."""
    kept: dict[str, np.ndarray] = {}
    for panel, (_, _, log) in runs.items():
        ticks, energy = log["/controller"], log["/energy"]
        kept |= {f"{panel}_t_s": log["/plant"]["t"], f"{panel}_x_m": log["/plant"]["x"]}
        kept |= {f"{panel}_tick_s": ticks["timestamp"]}
        kept |= {f"{panel}_{name}_N": ticks[name] for name in ("wall", "dissipation.0") if name in ticks}
        kept |= {f"{panel}_{name}_J": energy[name] for name in energy if name.endswith((".true", ".sampled"))}
    return kept


def _verdict(name: str, found: Found[Point]) -> Finding:
    """Finds that a claim holds if it does in our interpretation and nearly all; under an assumption if in some."""
    rows, [base], [nearest] = found.of("random"), found.of("base"), found.of("nearest")
    often = share(rows, name)
    numbers = (
        f"{TESTED[name]}: in {percent(often)} of {len(rows)} random interpretations; ours: {yes(base, name)}, the "
        f"nearest: {yes(nearest, name)}"
    )
    if name == "wall unstable":
        growth = OneTickMap.from_scene(replace(scene_of(BASE, "b"), dissipation=())).growth(150.0)
        numbers += f". In contact the loop is linear and grows by a factor of {growth:.4f} a tick"
    holds_somewhere = any(holds(row, name) for row in found.rows)
    if often >= _ALWAYS and holds(base, name):
        return CLAIMS[name].holds(numbers)
    return CLAIMS[name].assuming(_assumption(name, found), numbers) if holds_somewhere else CLAIMS[name].fails(numbers)


def _assumption(name: str, found: Found[Point]) -> str:
    """Names the nearest interpretation where the claim holds in it, else what it is likeliest with."""
    if holds(found.of("nearest")[0], name):
        return NEAREST
    decides = decider(options(found.of("random"), SPACE), name)
    return f"an interpretation with {decides.best}" if decides else "another interpretation than ours or the nearest"


def _together(found: Found[Point]) -> Finding:
    """Finds whether all that the search counts hold together under one interpretation."""
    rows, held = found.of("random"), [row for row in found.rows if holds(row, "all")]
    most = _fullest(found)
    lacks = ", ".join(name for name in COUNTED if not holds(most, name))
    return CLAIMS["together"].holds_if(
        False,
        bool(held),
        claims=len(COUNTED),
        held=len(held),
        count=len(found.rows),
        random=len(rows),
        most=most["holding"],
        lacks=f", without: {lacks}" if lacks else "",
        nearest=found.of("nearest")[0]["holding"],
        ours=found.of("base")[0]["holding"],
    )


def _notes(work: Work, found: Found[Point]) -> list[str]:
    """Returns the sections below the figure."""
    rows, refined, around = (found.of(stage) for stage in ("random", "refined", "neighbour"))
    [base], [nearest], most = found.of("base"), found.of("nearest"), _fullest(found)
    lacks = ", ".join(f"*{name}*" for name in COUNTED if not holds(most, name))
    never = pairs_never_together(rows, list(COUNTED))
    missed = ", ".join(f"*{name}* by {nearest[name]:.2g}" for name in COUNTED if nearest[name] > 0.0)
    swings = {key.removeprefix("swing ").removesuffix("_m"): nearest[key] for key in nearest if key[:6] == "swing "}
    numbers = [
        [SPACE.label(key), SPACE.value(key, low), SPACE.value(key, high), SPACE.whys[key]]
        for key, (low, high) in SPACE.bounds.items()
    ]
    count = Counter(row["stage"] for row in found.rows)
    return [
        "#### All claims together",
        work.tell(
            "together",
            held=sum(holds(row, "all") for row in rows),
            count=len(rows),
            held_refined=sum(holds(row, "all") for row in refined),
            refined=len(refined),
            limit=work.tell("limit", most=most["holding"], lacks=lacks) if lacks else "",
            both=f"Never both at random: {never}." if never else "Every two of them hold together somewhere.",
            counts=by_number_of_claims(rows, len(COUNTED)),
        ),
        "#### Each claim alone",
        claims_table(
            COUNTED | {"all": "all of the above"} | ASIDE,
            {"our interpretation": base, "nearest": nearest},
            {"its neighbours": around, "random interpretations": rows},
            options(rows, SPACE),
            "decided most by",
        ),
        work.tell("not_counted", names=", ".join(f"*{name}*" for name in ASIDE)),
        "#### The nearest interpretation",
        work.tell(
            "nearest",
            described=describe(found.nearest),
            verdict=f"It misses {missed}" if missed else "All claims hold for it",
            distance=nearest["distance"],
            swings=", ".join(f"{name} {amount(value, 'm')}" for name, value in swings.items()),
            around=len(around),
            all=percent(share(around, "all")),
            mean=np.mean([one["holding"] for one in around]),
            claims=len(COUNTED),
        ),
        "#### How was searched",
        work.tell("method", seed=SEED, far=WHOLE.far, close=WHOLE.close, **count),
        list_of_choices(SPACE),
        markdown_table(["number, drawn evenly in its logarithm", "from", "to", "why"], numbers, numbers=(1, 2)),
        work.tell("distance"),
    ]


def _fullest(found: Found[Point]) -> Row:
    """Returns the interpretation with the most claims, of several the nearest to the paper."""
    return max(found.rows, key=lambda row: (row["holding"], -row["distance"]))


def _panels(runs: Mapping[str, Run]) -> Figure:
    """Draws position, force and energy of three runs, by "a", "b" and "c"."""
    figure = empty_figure(14.0, 8.4)
    axes = figure.subplots(3, 3, sharex="col", squeeze=False)
    for column, (panel, (scene, summary, log)) in enumerate(runs.items()):
        _position(axes[0, column], scene, log, f"{_PANELS[panel]}: {summary['verdict']}")
        _force(axes[1, column], log)
        _energy(axes[2, column], log)
    for row in range(3):
        for ax in axes[row, 1:]:
            ax.set_ylabel("")
        if row < 2:
            for ax in axes[row]:
                ax.set_xlabel("")
    _same_view(axes[0], 1e3 * wall_of(runs["a"].scene).position)
    return figure


def _position(ax: Axes, scene: Scene, log: Recording, title: str) -> None:
    t, mm = log["/plant"]["t"], 1e3 * log["/plant"]["x"]
    kept = extremes(mm)
    ax.plot(t[kept], mm[kept], color=INK, linewidth=1.0, label="device")
    surface = 1e3 * wall_of(scene).position
    ax.axhspan(surface - 1e4, surface, color=WALL_FILL, zorder=0, linewidth=0)
    ax.axhline(surface, color=WALL, linewidth=1.0, zorder=1, label="wall")
    ax.set_xlim(0.0, float(t[-1]))
    dress(ax, title, "time (s)", "position (mm)")


def _same_view(axes: np.ndarray, surface: float) -> None:
    """Sets one scale for all three, by where they swing in the second half: how they came there may run out of it."""
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
