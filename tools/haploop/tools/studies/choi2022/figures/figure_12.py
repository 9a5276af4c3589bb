"""Fig. 12: damping with unidirectional inertia at 6.3 N/mm."""

from __future__ import annotations

import numpy as np

from haploop.tools.render.units import amount
from haploop.tools.studies.choi2022.claims import Finding, claims_of
from haploop.tools.studies.choi2022.device import elements_of
from haploop.tools.studies.choi2022.experiment import findings, nearest
from haploop.tools.studies.choi2022.experiment_measure import PAIR, PAIR_AT_N_M
from haploop.tools.studies.choi2022.figures.figure_9 import Press, Tuned, presses, tuned
from haploop.tools.studies.choi2022.steadiness import pressed
from haploop.tools.studies.choi2022.tuning import sizes_of
from haploop.tools.studies.choi2022.work import Work

CLAIMS = claims_of(12)


def best_pair(work: Work) -> Tuned:
    """Returns the pair that swings least at 6.3 N/mm, of those that are tried for the largest steady stiffness."""
    choices = [elements_of("both", float(b), float(m)) for b, m in sizes_of("both", work.small) if b and m]
    return tuned(work, "damping with inertia", PAIR_AT_N_M, choices)


def make(work: Work) -> list[Finding]:
    """Runs the paper's values, and the best of ours."""
    chosen = best_pair(work)
    b, mass_g = chosen.size("damping"), 1e3 * chosen.size("mass")
    of_paper = pressed(nearest(work).scene(PAIR_AT_N_M, elements_of("both", *PAIR)))
    cases = {
        "best": (f"{b:.2g} N s/m with {mass_g:.2g} g, the best here", chosen.scene),
        "paper": ("2.15 N s/m with 9 g, as in the paper", of_paper),
    }
    runs = presses(work, "figure_12", cases)
    (best, paper), press = (Tuned(ran.scene, ran.summary) for ran in runs), Press.from_run(runs[0])
    shown = best.displayed_N_m
    off = abs(shown / PAIR_AT_N_M - 1.0)
    inside = press.displayed_N_m[press.output_N != 0.0]
    within = int(np.argmax(np.abs(inside / PAIR_AT_N_M - 1.0) < 0.5))
    holding = {"displayed": best.steady and off < 0.01, "values": paper.steady, "instant": within <= 2}
    return findings(
        work,
        CLAIMS,
        holding,
        shown=shown / 1e3,
        off=100 * off,
        ended=best.ended,
        papers=paper.ended,
        ripple=amount(float(np.ptp(press.output_N[len(press.output_N) // 2 :])), "N", 2),
        damping=b,
        mass_g=mass_g,
        within=within,
        first=inside[0] / 1e3,
    )
