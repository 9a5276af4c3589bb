"""Fig. 9: damping at 5.0 N/mm against unidirectional inertia at 5.5 N/mm."""

from __future__ import annotations

import numpy as np

from haploop.tools.figure_file import empty_figure
from haploop.tools.figure_style import legend
from haploop.tools.paper.claims import Claim, Finding
from haploop.tools.paper.experiment.finding import under_the_reading
from haploop.tools.paper.experiment.press_figure import Press, draw_press
from haploop.tools.paper.experiment.setup import Setup, elements_of
from haploop.tools.paper.experiment.tuned import Tuned, tuned
from haploop.tools.paper.scenes import run
from haploop.tools.paper.work import Work

TITLE = "Damping alone at 5.0 N/mm, unidirectional inertia alone at 5.5 N/mm"
DAMPING = Claim(
    "V.B.2, Fig. 9(a)",
    "virtual damping cannot stabilize the haptic interaction with a VW of stiffness larger than 5.0 N/mm",
)
INERTIA = Claim(
    "V.B.2, Fig. 9(b)", "with the unidirectional virtual inertia, it is possible to stabilize the interaction [at 5.5]"
)
DISPLAYED = Claim(
    "V.B.2, Fig. 9(b)",
    "the mean of the displayed stiffness was 5.4968 N/mm, which was very close to the desired stiffness of 5.5 N/mm",
)
CLAIMS = (DAMPING, INERTIA, DISPLAYED)
_CASES = (
    ("damping", 5000.0, np.geomspace(0.5, 12.0, 10)),
    ("unidirectional-inertia", 5500.0, np.geomspace(2e-3, 0.06, 12)),
)


def make(work: Work) -> list[Finding]:
    """Each tuned without friction on a grid of sizes; the best of them run with the published friction."""
    figure = empty_figure(12.0, 6.4)
    axes = figure.subplots(2, 2, sharex=True)
    setup, columns, best = Setup().cheap(work.small), {}, {}
    for column, (kind, stiffness, sizes) in enumerate(_CASES):
        choices = [elements_of(kind, float(size)) for size in (sizes[::4] if work.small else sizes)]
        chosen = tuned(work, f"tuning {kind}", setup.cheap(), stiffness, choices)
        scene = setup.scene(stiffness, chosen.elements)
        summary, log = run(scene)
        best[kind] = Tuned(chosen.elements, summary)
        press = Press.of(scene, log)
        heading = f"{kind.replace('-', ' ')} at {stiffness / 1e3:g} N/mm: {summary['verdict']}"
        draw_press(axes[0, column], axes[1, column], press, heading, stiffness)
        key = kind.split("-")[0]
        columns |= press.columns(key)
        work.scene(f"figure_9_{key}", scene)
    legend(axes[0, 0], loc="upper right", ncols=3, framealpha=0.8, edgecolor="none")
    work.figure(figure, "figure_9")
    work.data("figure_9", columns)
    work.caption = "Forces as commanded, and their sum over the penetration, tick by tick; with the published friction."
    return _findings(best["damping"], best["unidirectional-inertia"])


def _findings(damping: Tuned, inertia: Tuned) -> list[Finding]:
    b, m = damping.elements[0]["damping"], inertia.elements[0]["mass"]
    shown = inertia.result["window"]["displayed_stiffness_N_m"]
    of_damping = f"best of its sizes {b:.2g} N s/m: {damping.result['verdict']}, {_mm(damping)} mm peak to peak"
    of_inertia = f"best of its sizes {1e3 * m:.1f} g: {inertia.result['verdict']}, {_mm(inertia)} mm peak to peak"
    off = abs(shown / 5500.0 - 1.0)
    return [
        under_the_reading(DAMPING, not damping.steady, of_damping),
        under_the_reading(INERTIA, inertia.steady, of_inertia),
        under_the_reading(
            DISPLAYED,
            inertia.steady and off < 0.01,
            f"{shown / 1e3:.4f} N/mm, {100 * off:.2f} % off; {of_inertia}",
        ),
    ]


def _mm(one: Tuned) -> str:
    return f"{1e3 * one.swing_m:.3f}"
