"""Fig. 9: damping at 5.0 N/mm against unidirectional inertia at 5.5 N/mm."""

from __future__ import annotations

from typing import Any

from haploop.tools.figure.style import empty_figure, legend
from haploop.tools.studies.choi2022.claims import Finding, claims_of
from haploop.tools.studies.choi2022.drawing import INSIDE, Press, draw_press
from haploop.tools.studies.choi2022.experiment.setup import elements_of
from haploop.tools.studies.choi2022.experiment.tuning import DAMPINGS, MASSES, Tuned, tuned
from haploop.tools.studies.choi2022.experiment.verdicts import nearest, verdict_under_assumptions
from haploop.tools.studies.choi2022.scenes import run
from haploop.tools.studies.choi2022.work import Work

CLAIMS = claims_of(9)
# The next stiffness beyond those that are drawn, for "larger than 5.0".
_BEYOND = ("damping", 5500.0, DAMPINGS)
_CASES = (("damping", 5000.0, DAMPINGS), ("unidirectional-inertia", 5500.0, MASSES))


def make(work: Work) -> list[Finding]:
    """Tunes each on a grid of sizes, and runs the best of them."""
    figure = empty_figure(12.0, 6.4)
    axes = figure.subplots(2, 2, sharex=True)
    setup, columns, best = nearest(work), {}, {}
    for column, (kind, stiffness, sizes) in enumerate(_CASES):
        choices = [elements_of(kind, float(size)) for size in (sizes[::8] if work.small else sizes)]
        chosen = tuned(work, f"tuning {kind}", setup, stiffness, choices)
        scene = setup.scene(stiffness, chosen.elements)
        summary, log = run(scene)
        best[kind] = Tuned(chosen.elements, summary)
        press = Press.from_log(scene, log)
        heading = f"{kind.replace('-', ' ')} at {stiffness / 1e3:.1f} N/mm: {summary['verdict']}"
        draw_press(axes[0, column], axes[1, column], press, heading, stiffness)
        key = kind.split("-")[0]
        columns |= press.columns(key)
        work.scene(f"figure_9_{key}", scene)
    legend(axes[0, 0], loc="upper right", ncols=3, **INSIDE)
    work.figure(figure, "figure_9")
    work.data("figure_9", columns)
    kind, stiffness, sizes = _BEYOND
    choices = [elements_of(kind, float(size)) for size in (sizes[::8] if work.small else sizes)]
    beyond = tuned(work, f"tuning {kind}", setup, stiffness, choices)
    return _findings(work, best["damping"], beyond, best["unidirectional-inertia"])


def _findings(work: Work, damping: Tuned, beyond: Tuned, inertia: Tuned) -> list[Finding]:
    shown = inertia.result["window"]["displayed_stiffness_N_m"]
    off = abs(shown / 5500.0 - 1.0)
    computed: dict[str, Any] = {
        "inertia": f"{1e3 * inertia.elements[0]['mass']:.3g} g: {inertia.ended}",
        "here": f"{damping.elements[0]['damping']:.2g} N s/m, {damping.ended}",
        "beyond": f"{beyond.elements[0]['damping']:.2g} N s/m, {beyond.ended}",
        "shown": shown / 1e3,
        "off": 100 * off,
    }
    return [
        verdict_under_assumptions(work, CLAIMS[name], is_so, tested, **computed)
        for name, is_so, tested in (
            ("damping", not beyond.steady, "9 damping ends"),
            ("inertia", inertia.steady, "9 inertia"),
            ("displayed", inertia.steady and off < 0.01, ""),
        )
    ]
