"""Fig. 6: the paper's simulation, in our reading of what it leaves open, and in the one nearest to the paper."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np

from haploop.tools.linear.one_tick import OneTickMap
from haploop.tools.studies.choi2022.claims import Claim, Finding
from haploop.tools.studies.choi2022.simulation import contact_tests
from haploop.tools.studies.choi2022.simulation.panels import Run, panels
from haploop.tools.studies.choi2022.simulation.reading import BASE, NEAREST, SPACE, Reading, scene_of
from haploop.tools.studies.choi2022.simulation.reading_files import scene_text, write_table
from haploop.tools.studies.choi2022.simulation.reading_runs import ASIDE
from haploop.tools.studies.choi2022.simulation.reading_runs import CLAIMS as MEASURE
from haploop.tools.studies.choi2022.simulation.scenes import run
from haploop.tools.studies.choi2022.simulation.search import SMALL, WHOLE, Found, search
from haploop.tools.studies.choi2022.simulation.search_figure import share_map
from haploop.tools.studies.choi2022.simulation.search_notes import notes
from haploop.tools.studies.choi2022.simulation.shares import decider, holds, options, percent, share, yes
from haploop.tools.studies.choi2022.work import Work

READINGS = "figure_6_readings.parquet"
TITLE = "The simulation of a slight contact with a soft wall"
ITEM = "V.A, item {} and Fig. 6({})"
# Claims that the measure tests under every reading, by the names it has for them.
MEASURED = {
    "wall unstable": Claim(
        "V.A",
        "the stiffness of the VW used in these simulations (0.15 N/mm) was already sufficiently high to make the "
        "interaction unstable",
    ),
    "a cycles": Claim(ITEM.format(1, "a"), "there were high-frequency limit cycles"),
    "a bounded": Claim(ITEM.format(1, "a"), "the contact did not become completely unstable"),
    "a small": Claim(ITEM.format(1, "a"), "the amplitude of the limit cycles was small"),
    "b bounded": Claim(ITEM.format(2, "b"), "the haptic interaction did not diverge"),
    "b large": Claim(ITEM.format(2, "b"), "the amplitude of the limit cycles was significantly large"),
    "b leaves": Claim(ITEM.format(2, "b"), "it pushed the HO out of the wall"),
    "b helps": Claim(
        ITEM.format(2, "b"), "The VW damping value was then tuned to 0.0008 Ns/mm to stabilize the system"
    ),
    "b best": Claim(
        ITEM.format(2, "b"),
        "This was the best-tuned damping value, and any change resulted in the behavior becoming worse",
    ),
    "c steadied": Claim(
        ITEM.format(3, "c"), "the unidirectional virtual inertia rather than damping stabilized the interaction"
    ),
    "c smaller": Claim(
        ITEM.format(3, "c"), "and considerably reduced the amplitude of the high-frequency oscillations"
    ),
    "c passive": Claim(
        ITEM.format(3, "c"), "The energy plot shows that the unidirectional virtual inertia was a passive element"
    ),
    "c monotone": Claim(
        "IV, Fig. 6(c)", "vanishing the inertia after absorbing energy without returning it to the system"
    ),
    "c truly passive": Claim(ITEM.format(3, "c"), "and aided in dissipating excess energy to stabilize the system"),
    "c beats bidirectional": Claim(
        "III", "this undesired energy leak impedes the use of inertia as an energy dissipation element"
    ),
}
TOGETHER = Claim(
    "V.A, Fig. 6", "Simulation results with various dissipative elements [all of the above in one simulation]"
)
CLAIMS = (*MEASURED.values(), *contact_tests.CLAIMS, TOGETHER)

_SEEN = {
    "base": (
        "Our own reading of what the paper leaves open (launch/scenes/fig6a.toml to fig6c.toml). From top: position, "
        "with the wall shaded, forces, and energy taken out of the device."
    ),
    "nearest": "The nearest reading that was found (launch/scenes/paper/fig6a_nearest.toml to fig6c_nearest.toml).",
}
# A claim that holds as often as this, our own reading included, needs no assumption.
_ALWAYS = 0.9


def make(work: Work) -> list[Finding]:
    """Both readings, and the search for the second."""
    found = search(SMALL if work.small else WHOLE, work.workers, work.stage)
    readings = {"base": BASE, "nearest": found.nearest}
    runs = {name: {panel: _run(reading, panel) for panel in "abc"} for name, reading in readings.items()}
    for name, of_panels in runs.items():
        stem = "figure_6" if name == "base" else "figure_6_nearest"
        work.figure(panels(of_panels), stem, _SEEN[name])
        work.data(stem, _columns(of_panels))
        for panel, (scene, _, _) in of_panels.items():
            work.scene(f"{stem}_{panel}", scene)
    for panel in "abc":
        work.path(f"fig6{panel}_nearest.toml").write_text(scene_text(found.nearest, panel), encoding="utf-8")
    rows = found.of("random")
    if there := options(rows, SPACE):
        seen = "How often each claim holds under which choice; what the claims say is told in the table below."
        work.figure(share_map(there, [*MEASURE, "all"], len(rows)), "figure_6_search", seen)
    if write_table(found.rows, work.out / READINGS):
        work.path(READINGS)
    work.notes = notes(found)
    work.answer = _answer(found)
    return [*_measured(found), *contact_tests.on_runs(runs), _together(found)]


def _answer(found: Found) -> str:
    rows, [nearest] = found.of("random"), found.of("nearest")
    decides = decider(options(rows, SPACE), "c beats bidirectional")
    return (
        "**Inertia against damping in a slight contact: it depends on the signals, not on the element alone.** The "
        f"paper's picture of it, inertia swinging at most half as wide as damping, comes out in "
        f"{percent(share(rows, 'c smaller'))} of {len(rows)} readings, and {nearest['holding']} of its {len(MEASURE)} "
        "claims together in the nearest. Unidirectional inertia swings no more than bidirectional of the same mass in "
        f"{percent(share(rows, 'c beats bidirectional'))}"
        + (f", decided most by the {decides.said('c beats bidirectional')}" if decides else "")
    )


def _run(reading: Reading, panel: str) -> Run:
    scene = scene_of(reading, panel)
    return scene, *run(scene)


def _columns(runs: dict[str, Run]) -> dict[str, np.ndarray]:
    """What was drawn, by panel."""
    kept: dict[str, np.ndarray] = {}
    for panel, (_, _, log) in runs.items():
        kept |= {f"{panel}_t_s": log["/plant"]["t"], f"{panel}_x_m": log["/plant"]["x"]}
        kept |= {f"{panel}_tick_s": log["/controller"]["timestamp"]}
        for name in ("wall", "dissipation.0"):
            if name in log["/controller"]:
                kept[f"{panel}_{name}_N"] = log["/controller"][name]
        kept |= {
            f"{panel}_{name}_J": log["/energy"][name] for name in log["/energy"] if name.endswith((".true", ".sampled"))
        }
    return kept


def _measured(found: Found) -> list[Finding]:
    """The claims that the search tests."""
    return [_verdict(claim, name, found) for name, claim in MEASURED.items()]


def _verdict(claim: Claim, name: str, found: Found) -> Finding:
    """holds: in our own reading and nearly all; under an assumption: in some; else not."""
    rows = found.of("random")
    often = share(rows, name)
    [base], [nearest] = found.of("base"), found.of("nearest")
    numbers = (
        f"{(MEASURE | ASIDE)[name]}: in {percent(often)} of {len(rows)} random readings; ours: {yes(base, name)}, the "
        f"nearest: {yes(nearest, name)}"
    )
    if name == "wall unstable":
        growth = OneTickMap.of(_wall_alone()).growth(150.0)
        numbers += f". In contact the loop is linear and grows by a factor of {growth:.4f} a tick"
    if often >= _ALWAYS and holds(base, name):
        return claim.holds(numbers)
    if any(holds(row, name) for row in found.rows):
        return claim.assuming(_assumption(name, found), numbers)
    return claim.fails(numbers)


def _together(found: Found) -> Finding:
    """Whether one reading has all that the search tests."""
    rows, held = found.of("random"), [row for row in found.rows if holds(row, "all")]
    fullest = max(found.rows, key=lambda row: (row["holding"], -row["distance"]))
    lacks = ", ".join(name for name in MEASURE if not holds(fullest, name))
    numbers = (
        f"all {len(MEASURE)} that the search tests hold for {len(held)} of {len(found.rows)} readings ({len(rows)} "
        "of them at random); the most that do in any are "
        f"{fullest['holding']}{f', without: {lacks}' if lacks else ''}; in the nearest "
        f"{found.of('nearest')[0]['holding']}, in our own {found.of('base')[0]['holding']}"
    )
    if not held:
        return TOGETHER.fails(numbers)
    return TOGETHER.assuming("what the paper leaves open is as in one of these readings", numbers)


def _assumption(name: str, found: Found) -> str:
    """The nearest reading where it holds there, else what it is likeliest with."""
    if holds(found.of("nearest")[0], name):
        return NEAREST
    decides = decider(options(found.of("random"), SPACE), name)
    return f"a reading with {decides.best}" if decides else "another reading than ours or the nearest"


def _wall_alone() -> dict[str, Any]:
    scene = copy.deepcopy(scene_of(BASE, "b"))
    scene.pop("dissipation")
    return scene
