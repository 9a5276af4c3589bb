"""Fig. 12: damping with unidirectional inertia at 6.3 N/mm."""

from __future__ import annotations

from typing import Any

import numpy as np

from haploop.tools.figure.style import empty_figure, legend
from haploop.tools.render.units import amount
from haploop.tools.studies.choi2022.claims import Finding, claims_of
from haploop.tools.studies.choi2022.drawing import INSIDE, Press, draw_press
from haploop.tools.studies.choi2022.experiment.setup import Elements, both
from haploop.tools.studies.choi2022.experiment.tuning import Tuned, tuned
from haploop.tools.studies.choi2022.experiment.verdicts import nearest, verdict_under_assumptions
from haploop.tools.studies.choi2022.scenes import run
from haploop.tools.studies.choi2022.work import Work

CLAIMS = claims_of(12)
STIFFNESS_N_M = 6300.0
_TUNED = ", and its own best parameters"
_PAPERS = both(2.15, 0.009)
_DAMPINGS, _MASSES = (1.0, 2.15, 3.0, 4.0, 5.5, 7.5), (0.009, 0.014, 0.02, 0.027, 0.035)


def best_pair(work: Work) -> tuple[dict[str, Any], Elements]:
    """Returns the scene of the pair that swings least, and its elements."""
    setup = nearest(work)
    choices = [both(b, m) for b in _DAMPINGS for m in _MASSES]
    chosen = tuned(work, "tuning damping with inertia", setup, STIFFNESS_N_M, choices[2::7] if work.small else choices)
    return setup.scene(STIFFNESS_N_M, chosen.elements), chosen.elements


def make(work: Work) -> list[Finding]:
    """Runs the paper's values, and the best of ours."""
    scene, elements = best_pair(work)
    b, m = elements[0]["damping"], elements[1]["mass"]
    cases = {
        f"{b:g} N s/m with {1e3 * m:g} g, the best here": (scene, "best"),
        "2.15 N s/m with 9 g, as in the paper": (nearest(work).scene(STIFFNESS_N_M, _PAPERS), "paper"),
    }
    figure = empty_figure(12.0, 6.4)
    axes = figure.subplots(2, 2, sharex=True)
    columns, tried, presses = {}, {}, {}
    for column, (heading, (case, key)) in enumerate(cases.items()):
        summary, log = run(case)
        tried[key] = Tuned(case["dissipation"], summary)
        presses[key] = press = Press.from_log(case, log)
        draw_press(axes[0, column], axes[1, column], press, f"{heading}: {summary['verdict']}", STIFFNESS_N_M)
        columns |= press.columns(key)
        work.scene(f"figure_12_{key}", case)
    legend(axes[0, 0], loc="upper right", ncols=3, **INSIDE)
    work.figure(figure, "figure_12")
    work.data("figure_12", columns)
    return _findings(work, tried["best"], tried["paper"], presses["best"])


def _findings(work: Work, best: Tuned, papers: Tuned, press: Press) -> list[Finding]:
    shown = best.result["window"]["displayed_stiffness_N_m"]
    off = abs(shown / STIFFNESS_N_M - 1.0)
    inside = press.displayed_N_m[press.output_N != 0.0]
    within = int(np.argmax(np.abs(inside / STIFFNESS_N_M - 1.0) < 0.5))
    last = press.output_N[len(press.output_N) // 2 :]
    sizes = {"damping": best.elements[0]["damping"], "mass_g": 1e3 * best.elements[1]["mass"]}
    return [
        verdict_under_assumptions(
            work,
            CLAIMS["displayed"],
            best.steady and off < 0.01,
            more=_TUNED,
            shown=shown / 1e3,
            off=100 * off,
            ended=best.ended,
            ripple=amount(float(np.ptp(last)), "N", 2),
            **sizes,
        ),
        verdict_under_assumptions(work, CLAIMS["values"], papers.steady, "12 pair", ended=papers.ended, **sizes),
        verdict_under_assumptions(
            work, CLAIMS["instant"], within <= 2, more=_TUNED, within=within, first=inside[0] / 1e3
        ),
    ]
