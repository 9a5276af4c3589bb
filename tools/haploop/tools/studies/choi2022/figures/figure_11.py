"""Fig. 11: damping swept with unidirectional inertia fixed, and the largest steady stiffness."""

from __future__ import annotations

import numpy as np

from haploop.tools.figure.style import INK, SMALL, dress, empty_figure
from haploop.tools.studies.choi2022.claims import Finding, claims_of
from haploop.tools.studies.choi2022.device import elements_of
from haploop.tools.studies.choi2022.experiment import findings, nearest
from haploop.tools.studies.choi2022.experiment_measure import PAIR, PAIR_AT_N_M, is_steady, largest
from haploop.tools.studies.choi2022.work import Work

CLAIMS = claims_of(11)
STIFFNESSES = np.arange(2500.0, 10001.0, 500.0)
_DAMPINGS = (0.0, 0.5, 1.0, 1.5, 2.15, 3.0, 4.0, 5.5, 7.5, 10.0)
_MASSES = (0.0, 0.003, 0.006, 0.009, 0.014, 0.02, 0.027, 0.035, 0.045)


def make(work: Work) -> list[Finding]:
    """Runs every pair at every stiffness."""
    dampings = np.array(_DAMPINGS[::3] if work.small else _DAMPINGS)
    masses = np.array(_MASSES[::4] if work.small else _MASSES)
    stiffnesses = STIFFNESSES[::3] if work.small else STIFFNESSES
    setup = nearest(work)
    cells = [(b, m, k) for b in dampings for m in masses for k in stiffnesses]
    results = work.run_all(
        "damping with inertia", [setup.scene(k, elements_of("both", float(b), float(m))) for b, m, k in cells]
    )
    steady = np.array([is_steady(result) for result in results]).reshape(len(dampings), len(masses), -1)
    reached = np.array([[largest(one[:, None], stiffnesses) for one in row] for row in steady])
    figure = empty_figure(8.6, 5.2)
    ax = figure.subplots()
    image = ax.imshow(reached / 1e3, origin="lower", aspect="auto", cmap="cividis")
    for (row, column), value in np.ndenumerate(reached):
        tone = "white" if value < 0.6 * reached.max() else INK
        text = f"{value / 1e3:.1f}" if value else "–"
        ax.text(column, row, text, ha="center", va="center", fontsize=SMALL, color=tone)
    dress(ax, "largest steady stiffness (N/mm)", "unidirectional inertia (g)", "damping (N s/m)")
    ax.grid(visible=False)
    ax.set_xticks(range(len(masses)), [f"{1e3 * mass:g}" for mass in masses])
    ax.set_yticks(range(len(dampings)), [f"{damping:g}" for damping in dampings])
    figure.colorbar(image, ax=ax, label="N/mm")
    work.figure(figure, "figure_11")
    grid = {"damping_N_s_m": dampings, "mass_kg": masses, "stiffness_N_m": stiffnesses}
    work.data("figure_11", grid | {"steady": steady})
    work.scene("figure_11", setup.scene(PAIR_AT_N_M, elements_of("both", *PAIR)))
    i, j = np.unravel_index(reached.argmax(), reached.shape)
    most, alone, damped = float(reached[i, j]), float(reached[0].max()), float(reached[:, 0].max())
    bears = np.flatnonzero(reached[0, 1:]) + 1
    helped = int((reached[1:, bears].max(axis=0) >= reached[0, bears] + 500.0).sum())
    computed = {"most": most / 1e3, "damping": dampings[i], "mass_g": 1e3 * masses[j], "helped": helped}
    computed |= {"damped": damped / 1e3, "alone": alone / 1e3, "bears": len(bears)}
    near = bool(
        abs(most - PAIR_AT_N_M) <= 500.0 and 0.5 <= dampings[i] / PAIR[0] <= 2.0 and 0.5 <= masses[j] / PAIR[1] <= 2.0
    )
    work.answer = work.tell("answer", **computed)
    holding = {"most": near, "more": most > max(alone, damped), "step": helped == len(bears)}
    return findings(work, CLAIMS, holding, **computed)
