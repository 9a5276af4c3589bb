"""Fig. 13: what damping and unidirectional inertia take out, over one contact."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from haploop.protocol.scene.hand_force import Constant, Trace
from haploop.tools.figure.style import SMALL, WALL_FILL, dress, empty_figure
from haploop.tools.render.units import amount
from haploop.tools.studies.choi2022.claims import Finding, claims_of
from haploop.tools.studies.choi2022.device import KINDS
from haploop.tools.studies.choi2022.drawing import COLOURS
from haploop.tools.studies.choi2022.experiment import findings
from haploop.tools.studies.choi2022.figures.figure_12 import best_pair
from haploop.tools.studies.choi2022.work import Work, hand_of, run

CLAIMS = claims_of(13)
# The person lets go at this time, so that the contact has an end.
_RELEASED_S, _PULL_N = 0.6, 4.0
_EDGE_S, _DURATION_S = 0.06, 0.9


def make(work: Work) -> list[Finding]:
    """Runs a press of half a second with the best pair, after which the hand pulls back."""
    pressed = best_pair(work).scene
    hand = hand_of(pressed)
    assert isinstance(hand.force, Constant)
    push = hand.force.value
    force = Trace(time=(0.0, _RELEASED_S, _RELEASED_S + 0.05), force=(push, push, _PULL_N))
    scene = replace(pressed, duration=_DURATION_S, hand=replace(hand, force=force))
    log = run(scene).log
    energy, t, inside = log["/energy"], log["/controller"]["timestamp"], log["/controller"]["in_contact"] > 0
    books = {
        kind: np.asarray([energy[f"{name}.{kind}"] for name in ("damping", KINDS[3])]) for kind in ("sampled", "true")
    }
    figure = empty_figure(9.6, 4.4)
    ax = figure.subplots()
    for i, label in enumerate(("damping", "unidirectional inertia")):
        for book, style, width in (("sampled", "-", 1.4), ("true", "--", 1.0)):
            look = {"color": COLOURS[label.replace(" ", "-")], "linewidth": width, "label": f"{label}, {book}"}
            ax.plot(t, 1e3 * books[book][i][: len(t)], style, **look)
    ax.axvspan(t[inside][0], t[inside][-1], color=WALL_FILL, zorder=0, linewidth=0, label="in contact")
    dress(ax, "", "time (s)", "energy taken (mJ)")
    figure.legend(loc="outside lower center", ncols=5, frameon=False, fontsize=SMALL)
    work.figure(figure, "figure_13")
    work.data("figure_13", {"t_s": t, "in_contact": inside, **{f"{kind}_J": book for kind, book in books.items()}})
    work.scene("figure_13", scene)
    work.caption = work.tell("caption", released_s=_RELEASED_S)
    return _findings(work, books["sampled"], books["true"], t, inside)


def _findings(work: Work, sampled: np.ndarray, true: np.ndarray, t: np.ndarray, inside: np.ndarray) -> list[Finding]:
    took, left = sampled[:, -1], true[:, -1]
    ticks = np.flatnonzero(inside)
    first, last = t[ticks[0]], t[ticks[-1]]
    edge = (t < first + _EDGE_S) | (t > last - _EDGE_S)
    flows = np.diff(sampled[:, : len(t)], axis=1, prepend=0.0)
    shares = flows[:, edge].sum(axis=1) / np.where(took == 0.0, 1.0, took)
    middle = flows[:, ~edge].sum(axis=1)
    both = {"damping": took[0], "inertia": took[1], "true_damping": left[0], "true_inertia": left[1]}
    computed = {name: amount(float(energy), "J") for name, energy in both.items()}
    holding = {
        "larger": bool(took[1] > took[0]),
        "ends": bool(shares[0] > 0.8),
        "middle": bool(middle[1] > abs(middle[0])),
    }
    return findings(
        work,
        CLAIMS,
        holding,
        edge_ms=1e3 * _EDGE_S,
        shares=f"damping {100 * shares[0]:.0f} %, inertia {100 * shares[1]:.0f} %",
        between=f"damping {amount(float(middle[0]), 'J')}, inertia {amount(float(middle[1]), 'J')}",
        **computed,
    )
