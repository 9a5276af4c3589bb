"""Fig. 9: damping at 5.0 N/mm against unidirectional inertia at 5.5 N/mm."""

from __future__ import annotations

from haploop.tools.figure.style import empty_figure, legend
from haploop.tools.studies.choi2022.claims import Finding, claims_of
from haploop.tools.studies.choi2022.drawing import INSIDE, Press, draw_press
from haploop.tools.studies.choi2022.experiment.setup import elements_of
from haploop.tools.studies.choi2022.experiment.tuning import DAMPINGS, MASSES, Tuned, tuned
from haploop.tools.studies.choi2022.experiment.verdicts import nearest, verdict_under_assumptions
from haploop.tools.studies.choi2022.scenes import run
from haploop.tools.studies.choi2022.work import Work

TITLE = "Damping alone at 5.0 N/mm, unidirectional inertia alone at 5.5 N/mm"
CLAIMS = claims_of(9)
# What is drawn, and the next stiffness up, for "larger than 5.0".
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
    work.caption = (
        "Each with the best of its sizes. Above the forces as commanded, below their sum over the penetration, tick by "
        "tick."
    )
    kind, stiffness, sizes = _BEYOND
    choices = [elements_of(kind, float(size)) for size in (sizes[::8] if work.small else sizes)]
    beyond = tuned(work, f"tuning {kind}", setup, stiffness, choices)
    return _findings(work, best["damping"], beyond, best["unidirectional-inertia"])


def _findings(work: Work, damping: Tuned, beyond: Tuned, inertia: Tuned) -> list[Finding]:
    b, over = (one.elements[0]["damping"] for one in (damping, beyond))
    m = inertia.elements[0]["mass"]
    shown = inertia.result["window"]["displayed_stiffness_N_m"]
    of_damping = (
        f"with the best of its sizes, 5.5 N/mm: {over:.2g} N s/m, {beyond.ended}; 5.0 N/mm: {b:.2g} N s/m, "
        f"{damping.ended}"
    )
    of_inertia = f"with the best of its sizes, {1e3 * m:.3g} g: {inertia.ended}"
    off = abs(shown / 5500.0 - 1.0)
    return [
        verdict_under_assumptions(work, CLAIMS["damping"], not beyond.steady, of_damping, "9 damping ends"),
        verdict_under_assumptions(work, CLAIMS["inertia"], inertia.steady, of_inertia, "9 inertia"),
        verdict_under_assumptions(
            work,
            CLAIMS["displayed"],
            inertia.steady and off < 0.01,
            f"{shown / 1e3:.4f} N/mm, {100 * off:.2f} % off; {of_inertia}",
        ),
    ]
