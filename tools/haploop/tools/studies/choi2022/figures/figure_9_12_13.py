"""Figs. 9, 12 and 13: presses on a wall. Damping at 5.0 N/mm against unidirectional inertia at 5.5 N/mm, both together
at 6.3 N/mm, and what each of the two takes out of that contact.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from haploop.logger.summary import Summary
from haploop.protocol.amounts import amount
from haploop.protocol.scene.hand_force import Constant, Trace
from haploop.protocol.scene.scene import Scene
from haploop.tools.figure.style import ELEMENTS, INK, SMALL, WALL, WALL_FILL, dress, empty_figure, legend
from haploop.tools.studies.choi2022.device import KINDS, elements_of
from haploop.tools.studies.choi2022.experiment import PAIR, PAIR_AT_N_M
from haploop.tools.studies.choi2022.figures.claims import Finding
from haploop.tools.studies.choi2022.figures.drawing import COLOURS, INSIDE
from haploop.tools.studies.choi2022.figures.work import Work
from haploop.tools.studies.choi2022.runs import Run, hand_of, run, wall_of
from haploop.tools.studies.choi2022.steadiness import (
    STIFFNESSES,
    is_steady,
    pressed,
    reached,
    run_all,
    sizes_of,
    swing_m,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# In Fig. 13 the person lets go at this time, so that the contact has an end.
_RELEASED_S, _PULL_N = 0.6, 4.0
_EDGE_S, _DURATION_S = 0.06, 0.9


class Tuned(NamedTuple):
    """The scene of a press on a wall, and its result."""

    scene: Scene
    result: Summary

    @property
    def sizes(self) -> dict[str, float]:
        """The parameters of its elements: ``damping`` in N s/m, ``mass`` in kg."""
        return {name: value for element in self.scene.dissipation for name, value in element.parameters.items()}

    @property
    def stiffness_N_m(self) -> float:
        return wall_of(self.scene).stiffness

    @property
    def displayed_N_m(self) -> float:
        """Mean of the force over the penetration, over the last 0.5 s."""
        return self.result["window"]["displayed_stiffness_N_m"]

    @property
    def steady(self) -> bool:
        return is_steady(self.result)

    @property
    def ended(self) -> str:
        word = "steady" if self.steady else "not steady"
        return f"{word}, swings {amount(swing_m(self.result), 'm')} peak to peak"


def make_9(work: Work) -> list[Finding]:
    """Tunes both on a grid of sizes, runs the best of each, and inertia at the largest stiffness that it steadies."""
    here, ours = tuned(work, KINDS[1], 5000.0), tuned(work, KINDS[3], 5500.0)
    cases = {
        "damping": ("damping at 5.0 N/mm", here.scene),
        "unidirectional": ("unidirectional inertia at 5.5 N/mm", ours.scene),
    }
    _presses(work, cases)
    beyond, most = tuned(work, KINDS[1], 5500.0), reached(work, work.nearest, KINDS[3])
    # The wall on which all starts come to rest.
    rest_N_m = max(min(most.steady), float(STIFFNESSES[0]))
    at_rest = pressed(work.nearest.scene(rest_N_m, elements_of(KINDS[3], *most.sizes)))
    rests = Tuned(at_rest, run_all([at_rest])[0])
    off = abs(rests.displayed_N_m / rests.stiffness_N_m - 1.0)
    holding = {"damping": not beyond.steady, "inertia": ours.steady, "displayed": rests.steady and off < 0.01}
    return work.findings(
        holding,
        inertia=f"{1e3 * ours.sizes['mass']:.3g} g: {ours.ended}",
        here=f"{here.sizes['damping']:.2g} N s/m: {here.ended}",
        beyond=f"{beyond.sizes['damping']:.2g} N s/m: {beyond.ended}",
        shown=rests.displayed_N_m / 1e3,
        there=ours.displayed_N_m / 1e3,
        off=100.0 * off,
        rest=rests.stiffness_N_m / 1e3,
        rest_g=1e3 * rests.sizes["mass"],
        rest_ended=rests.ended,
        most=most.describe(),
    )


def make_12(work: Work) -> list[Finding]:
    """Runs the paper's values, and our best ones."""
    chosen = tuned(work, "both", PAIR_AT_N_M)
    b, mass_g = chosen.sizes["damping"], 1e3 * chosen.sizes["mass"]
    of_paper = pressed(work.nearest.scene(PAIR_AT_N_M, elements_of("both", *PAIR)))
    cases = {
        "best": (f"{b:.2g} N s/m with {mass_g:.2g} g, the best here", chosen.scene),
        "paper": ("2.15 N s/m with 9 g, as in the paper", of_paper),
    }
    runs = _presses(work, cases)
    (best, paper), press = (Tuned(ran.scene, ran.summary) for ran in runs), Press.from_run(runs[0])
    off = abs(best.displayed_N_m / PAIR_AT_N_M - 1.0)
    inside = press.displayed_N_m[press.output_N != 0.0]
    # How soon the stiffness is displayed; damping and inertia may display more at first.
    rises, settles = (int(np.argmax(of)) for of in (inside > 0.5 * PAIR_AT_N_M, abs(inside / PAIR_AT_N_M - 1.0) < 0.5))
    holding = {"displayed": best.steady and off < 0.01, "values": paper.steady, "instant": rises <= 2}
    return work.findings(
        holding,
        shown=best.displayed_N_m / 1e3,
        off=100 * off,
        ended=best.ended,
        papers=paper.ended,
        ripple=amount(float(np.ptp(press.output_N[len(press.output_N) // 2 :])), "N", 2),
        damping=b,
        mass_g=mass_g,
        rises=rises,
        settles=settles,
        first=inside[0] / 1e3,
    )


def make_13(work: Work) -> list[Finding]:
    """Runs a press of half a second with the best pair, after which the hand pulls back."""
    best = tuned(work, "both", PAIR_AT_N_M).scene
    hand = hand_of(best)
    assert isinstance(hand.force, Constant)
    push = hand.force.value
    force = Trace(time=(0.0, _RELEASED_S, _RELEASED_S + 0.05), force=(push, push, _PULL_N))
    scene = replace(best, duration=_DURATION_S, hand=replace(hand, force=force))
    log = run(scene).log
    energy, t, inside = log["/energy"], log["/controller"]["timestamp"], log["/controller"]["in_contact"] > 0
    books = {
        kind: np.asarray([energy[f"{name}.{kind}"] for name in ("damping", KINDS[3])]) for kind in ("sampled", "true")
    }
    figure = empty_figure(9.6, 4.4)
    ax = figure.subplots()
    for i, label in enumerate(("damping", "unidirectional inertia")):
        for book, style, width in (("sampled", "-", 1.4), ("true", "--", 1.0)):
            look = {"color": COLOURS[KINDS[1 + 2 * i]], "linewidth": width, "label": f"{label}, {book}"}
            ax.plot(t, 1e3 * books[book][i][: len(t)], style, **look)
    ax.axvspan(t[inside][0], t[inside][-1], color=WALL_FILL, zorder=0, linewidth=0, label="in contact")
    dress(ax, "", "time (s)", "energy taken (mJ)")
    figure.legend(loc="outside lower center", ncols=5, frameon=False, fontsize=SMALL)
    work.figure(figure, "figure_13")
    work.data("figure_13", {"t_s": t, "in_contact": inside, **{f"{kind}_J": book for kind, book in books.items()}})
    work.scene("figure_13", scene)
    work.caption = work.tell("caption", released_s=_RELEASED_S)
    return _on_books(work, books["sampled"], books["true"], t, inside)


def _on_books(work: Work, sampled: np.ndarray, true: np.ndarray, t: np.ndarray, inside: np.ndarray) -> list[Finding]:
    took, left = sampled[:, -1], true[:, -1]
    first, last = t[inside][0], t[inside][-1]
    edge = (t < first + _EDGE_S) | (t > last - _EDGE_S)
    flows = np.diff(sampled[:, : len(t)], axis=1, prepend=0.0)
    shares = flows[:, edge].sum(axis=1) / np.where(took == 0.0, 1.0, took)
    middle = flows[:, ~edge].sum(axis=1)
    holding = {
        "larger": bool(took[1] > took[0]),
        "ends": bool(shares[0] > 0.8),
        "middle": bool(middle[1] > abs(middle[0])),
    }
    energies = {"damping": took[0], "inertia": took[1], "true_damping": left[0], "true_inertia": left[1]}
    energies |= {"middle_damping": middle[0], "middle_inertia": middle[1]}
    computed = {name: amount(float(energy), "J") for name, energy in energies.items()}
    return work.findings(holding, edge_ms=1e3 * _EDGE_S, ends=100.0 * shares, **computed)


def tuned(work: Work, kind: str, stiffness: float) -> Tuned:
    """Returns the size with which a press swings least ("best tuned", Choi et al. 2022, V.B.1); of "both" none is 0."""
    sizes = [size for size in sizes_of(kind, work.small).tolist() if kind != "both" or all(size)]
    scenes = [pressed(work.nearest.scene(stiffness, elements_of(kind, *size))) for size in sizes]
    halves = [scenes[: len(scenes) // 2], scenes[len(scenes) // 2 :]]
    one, other = work.map_parallel(f"tuning {kind.replace('-', ' ')}", run_all, halves)
    return min(map(Tuned, scenes, [*one, *other]), key=lambda one: swing_m(one.result))


def _presses(work: Work, cases: Mapping[str, tuple[str, Scene]]) -> list[Run]:
    """Runs presses on a wall, given heading and scene by key, and draws them side by side; returns the runs."""
    name, figure = f"figure_{work.number}", empty_figure(12.0, 6.4)
    axes = figure.subplots(2, 2, sharex=True)
    columns, runs = {}, []
    for column, (key, (heading, scene)) in zip(axes.T, cases.items(), strict=True):
        runs.append(run(scene))
        press = Press.from_run(runs[-1])
        word = "steady" if is_steady(runs[-1].summary) else "not steady"
        _draw(column[0], column[1], press, f"{heading}: {word}", wall_of(scene).stiffness)
        # The displayed stiffness is written as 0 outside the wall.
        columns |= {f"{key}_{name}": np.nan_to_num(column) for name, column in press._asdict().items()}
        work.scene(f"{name}_{key}", scene)
    legend(axes[0, 0], loc="upper right", ncols=3, **INSIDE)
    work.figure(figure, name)
    work.data(name, columns)
    return runs


class Press(NamedTuple):
    """The signals of a run that presses on a wall.

    Attributes:
        t_s: times of the ticks.
        origin_N, element_N, output_N: force of the wall's spring, of all elements, and their sum.
        displayed_N_m: output over penetration, NaN outside the wall (Choi et al. 2022, V.B.2).
    """

    t_s: np.ndarray
    origin_N: np.ndarray
    element_N: np.ndarray
    output_N: np.ndarray
    displayed_N_m: np.ndarray

    @classmethod
    def from_run(cls, ran: Run) -> Press:
        ticks = ran.log["/controller"]
        depth = wall_of(ran.scene).position - ticks["x"]
        wall, total = ticks["wall"], ticks["total"]
        inside = ticks["in_contact"] > 0
        displayed = np.full(len(depth), np.nan)
        displayed[inside] = total[inside] / depth[inside]
        return cls(np.arange(len(depth)) / ran.scene.clock.control_rate, wall, total - wall, total, displayed)


def _draw(forces: Axes, stiffness: Axes, press: Press, heading: str, wanted_N_m: float) -> None:
    """Draws forces and displayed stiffness as in the paper's Figs. 9 and 12, one above the other."""
    forces.plot(press.t_s, press.output_N, color=INK, linewidth=0.9, label="output")
    forces.plot(press.t_s, press.origin_N, color=WALL, linewidth=0.9, label="wall spring")
    forces.plot(press.t_s, press.element_N, color=ELEMENTS[0], linewidth=0.9, label="elements")
    dress(forces, heading, "", "force (N)")
    stiffness.plot(press.t_s, press.displayed_N_m / 1e3, ".", color=INK, markersize=2.0)
    stiffness.axhline(wanted_N_m / 1e3, color=WALL, linewidth=1.0, label="asked for")
    dress(stiffness, "", "time (s)", "displayed stiffness (N/mm)")
    stiffness.set_ylim(-0.5 * wanted_N_m / 1e3, 2.5 * wanted_N_m / 1e3)
    legend(stiffness)
