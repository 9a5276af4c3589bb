"""Fig. 6: the paper's simulation, in our interpretation of what it leaves open, and in that nearest to the paper."""

from __future__ import annotations

import numpy as np

from haploop.tools.linear.one_tick import OneTickMap
from haploop.tools.search.random import Point
from haploop.tools.studies.choi2022.claims import Finding, claims_of
from haploop.tools.studies.choi2022.interpretations import Found, decider, holds, options, percent, share, yes
from haploop.tools.studies.choi2022.scenes import run
from haploop.tools.studies.choi2022.search_report import share_map
from haploop.tools.studies.choi2022.simulation.interpretation import BASE, NEAREST, SPACE, scene_of, scene_text
from haploop.tools.studies.choi2022.simulation.measure import ASIDE
from haploop.tools.studies.choi2022.simulation.measure import CLAIMS as COUNTED
from haploop.tools.studies.choi2022.simulation.panels import Run, findings_on_logs, panels
from haploop.tools.studies.choi2022.simulation.search import SMALL, WHOLE, fullest, notes, search, write_table
from haploop.tools.studies.choi2022.work import Work

TABLE = "figure_6_readings.parquet"
CLAIMS = claims_of(6)
# The claims that the search tests under every interpretation, in its words.
TESTED = {name: (COUNTED | ASIDE)[name] for name in CLAIMS if name in COUNTED | ASIDE}
# A claim that holds as often as this, our own interpretation included, needs no assumption.
_ALWAYS = 0.9


def make(work: Work) -> list[Finding]:
    """Runs both interpretations, and searches for the second."""
    found = search(work, SMALL if work.small else WHOLE)
    interpretations = {"base": BASE, "nearest": found.nearest}
    runs: dict[str, dict[str, Run]] = {name: {} for name in interpretations}
    for name, stem in (("base", "figure_6"), ("nearest", "figure_6_nearest")):
        for panel in "abc":
            scene = scene_of(interpretations[name], panel)
            runs[name][panel] = (scene, *run(scene))
        work.figure(panels(runs[name]), stem, work.tell(f"seen_{name}"))
        work.data(stem, _columns(runs[name]))
        for panel, (scene, _, _) in runs[name].items():
            work.scene(f"{stem}_{panel}", scene)
    for panel in "abc":
        work.text(f"fig6{panel}_nearest.toml", scene_text(found.nearest, panel))
    rows = found.of("random")
    if there := options(rows, SPACE):
        work.figure(share_map(there, [*COUNTED, "all"], len(rows)), "figure_6_search", work.tell("seen_search"))
    if write_table(found.rows, work.out / TABLE):
        work.path(TABLE)
    work.notes = notes(work, found)
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
        alone = {key: table for key, table in scene_of(BASE, "b").items() if key != "dissipation"}
        growth = OneTickMap.from_scene(alone).growth(150.0)
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
    most = fullest(found)
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
