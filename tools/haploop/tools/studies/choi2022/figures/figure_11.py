"""Fig. 11: damping swept with unidirectional inertia fixed, and the largest steady stiffness."""

from __future__ import annotations

import numpy as np

from haploop.tools.figure.style import INK, SMALL, dress, empty_figure
from haploop.tools.studies.choi2022.claims import Finding, claims_of
from haploop.tools.studies.choi2022.device import KINDS, elements_of
from haploop.tools.studies.choi2022.experiment import findings, nearest, often_of
from haploop.tools.studies.choi2022.experiment_measure import PAIR, PAIR_AT_N_M
from haploop.tools.studies.choi2022.steadiness import STEP_N_M, STIFFNESSES, WIDEST_M, held
from haploop.tools.studies.choi2022.tuning import beats, reached, sizes_of, tried
from haploop.tools.studies.choi2022.work import Work

CLAIMS = claims_of(11)


def make(work: Work) -> list[Finding]:
    """Runs every pair at every stiffness, and judges the best of each element and of both."""
    setup = nearest(work)
    grid = tried(work, setup, "both", sizes_of("both", work.small))
    dampings, masses = (np.unique(column) for column in grid.sizes.T)
    level = np.append(0.0, STIFFNESSES)
    steady = np.moveaxis(grid.swings_m <= WIDEST_M, -1, 0)
    bears = np.mean([level[held(one)] for one in steady], axis=0).reshape(len(dampings), -1)
    figure = empty_figure(10.4, 6.0)
    ax = figure.subplots()
    image = ax.imshow(bears / 1e3, origin="lower", aspect="auto", cmap="cividis")
    for (row, column), value in np.ndenumerate(bears):
        tone = "white" if value < 0.6 * bears.max() else INK
        text = f"{value / 1e3:.1f}" if value else "–"
        ax.text(column, row, text, ha="center", va="center", fontsize=SMALL, color=tone)
    dress(ax, "largest steady stiffness (N/mm)", "unidirectional inertia (g)", "damping (N s/m)")
    ax.grid(visible=False)
    ax.set_xticks(range(len(masses)), [f"{1e3 * mass:.2g}" for mass in masses])
    ax.set_yticks(range(len(dampings)), [f"{damping:.2g}" for damping in dampings])
    figure.colorbar(image, ax=ax, label="N/mm")
    work.figure(figure, "figure_11")
    sizes = {"damping_N_s_m": grid.sizes[:, 0], "mass_kg": grid.sizes[:, 1], "stiffness_N_m": STIFFNESSES}
    work.data("figure_11", sizes | {"swing_m": grid.swings_m})
    work.scene("figure_11", setup.scene(PAIR_AT_N_M, elements_of("both", *PAIR)))
    both = reached(work, setup, "both", grid)
    damped, inertia = (reached(work, setup, kind) for kind in (KINDS[1], KINDS[3]))
    # Inertias that steady a wall alone, and what damping adds to them.
    alone = np.flatnonzero(bears[0, 1:]) + 1
    helped = int((bears[1:, alone].max(axis=0) >= bears[0, alone] + STEP_N_M).sum())
    damping, mass = both.sizes
    computed = {
        "most": both.describe(),
        "damping": damping,
        "mass_g": 1e3 * mass,
        "damped": damped.describe(),
        "alone": inertia.describe(),
        "helped": helped,
        "bears": len(alone),
        "starts": len(both.steady),
        "twice": both.twice / 1e3,
    }
    is_near = 0.5 <= damping / PAIR[0] <= 2.0 and 0.5 <= mass / PAIR[1] <= 2.0
    is_more = beats(both, damped) and beats(both, inertia)
    row, column = np.unravel_index(bears.argmax(), bears.shape)
    beside = bears[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2]
    around = (beside.sum() - bears.max()) / (beside.size - 1) / 1e3
    reach = {"around": around, "often": often_of(work, "11 more")}
    work.conclude("more" if is_more else "no_more", supports=False, **computed, **reach)
    holding = {
        "most": abs(1e3 * both.mean.value - PAIR_AT_N_M) <= STEP_N_M and is_near,
        "more": is_more,
        "step": helped == len(alone) > 0,
    }
    return findings(work, CLAIMS, holding, **computed)
