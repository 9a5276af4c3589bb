"""Fig. 9: damping at 5.0 N/mm against unidirectional inertia at 5.5 N/mm."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple, Self

import numpy as np

from haploop.logger.summary import Summary
from haploop.protocol.scene.scene import Scene
from haploop.tools.figure.style import ELEMENTS, INK, WALL, dress, empty_figure, legend
from haploop.tools.render.units import amount
from haploop.tools.studies.choi2022.claims import Finding, claims_of
from haploop.tools.studies.choi2022.device import KINDS, Elements, elements_of
from haploop.tools.studies.choi2022.drawing import INSIDE
from haploop.tools.studies.choi2022.experiment import findings, nearest
from haploop.tools.studies.choi2022.steadiness import STIFFNESSES, is_steady, pressed, run_all, swing_m
from haploop.tools.studies.choi2022.tuning import reached, sizes_of
from haploop.tools.studies.choi2022.work import Run, Work, run, wall_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CLAIMS = claims_of(9)


def make(work: Work) -> list[Finding]:
    """Tunes each on a grid of sizes, runs the best of them, and inertia at the largest stiffness that it steadies."""
    setup = nearest(work)
    here, ours = _tuned(work, KINDS[1], 5000.0), _tuned(work, KINDS[3], 5500.0)
    cases = {
        "damping": ("damping at 5.0 N/mm", here.scene),
        "unidirectional": ("unidirectional inertia at 5.5 N/mm", ours.scene),
    }
    presses(work, "figure_9", cases)
    beyond = _tuned(work, KINDS[1], 5500.0)
    most = reached(work, setup, KINDS[3])
    # What all starts leave at rest.
    rest_N_m = min(most.steady)
    rests = Tuned.from_run(setup.scene(max(rest_N_m, STIFFNESSES[0]), elements_of(KINDS[3], *most.sizes)))
    shown, is_near = rests.displayed_N_m, abs(rests.displayed_N_m / rests.stiffness_N_m - 1.0) < 0.01
    holding = {"damping": not beyond.steady, "inertia": ours.steady, "displayed": rests.steady and is_near}
    return findings(
        work,
        CLAIMS,
        holding,
        inertia=f"{1e3 * ours.size('mass'):.3g} g: {ours.ended}",
        here=f"{here.size('damping'):.2g} N s/m: {here.ended}",
        beyond=f"{beyond.size('damping'):.2g} N s/m: {beyond.ended}",
        shown=shown / 1e3,
        there=ours.displayed_N_m / 1e3,
        off=100.0 * abs(shown / rests.stiffness_N_m - 1.0),
        rest=rests.stiffness_N_m / 1e3,
        rest_g=1e3 * rests.size("mass"),
        rest_ended=rests.ended,
        most=most.describe(),
    )


class Tuned(NamedTuple):
    """The scene of a wall with the elements with which it swings least, and what came of that run."""

    scene: Scene
    result: Summary

    @classmethod
    def from_run(cls, scene: Scene) -> Self:
        """Runs a press for as long as it takes to be looked at."""
        scene = pressed(scene)
        return cls(scene, run_all([scene])[0])

    def size(self, parameter: str) -> float:
        return next(e.parameters[parameter] for e in self.scene.dissipation if parameter in e.parameters)

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


def tuned(work: Work, name: str, stiffness: float, choices: Sequence[Elements]) -> Tuned:
    """Returns of some elements those with which a press swings least ("best tuned", Choi et al. 2022, V.B.1)."""
    scenes = [pressed(nearest(work).scene(stiffness, elements)) for elements in choices]
    results = run_all(scenes)
    return min((Tuned(*one) for one in zip(scenes, results, strict=True)), key=lambda one: swing_m(one.result))


def _tuned(work: Work, kind: str, stiffness: float) -> Tuned:
    sizes = sizes_of(kind, work.small)[:, 0]
    return tuned(work, kind, stiffness, [elements_of(kind, float(one)) for one in sizes])


def presses(work: Work, name: str, cases: Mapping[str, tuple[str, Scene]]) -> list[Run]:
    """Runs presses on a wall, given heading and scene by key, and draws them side by side; returns the runs."""
    figure = empty_figure(12.0, 6.4)
    axes = figure.subplots(2, 2, sharex=True)
    columns, runs = {}, []
    for column, (key, (heading, scene)) in zip(axes.T, cases.items(), strict=True):
        runs.append(run(scene))
        press = Press.from_run(runs[-1])
        word = "steady" if is_steady(runs[-1].summary) else "not steady"
        _draw(column[0], column[1], press, f"{heading}: {word}", wall_of(scene).stiffness)
        # Outside the wall the displayed stiffness is 0 there.
        columns |= {f"{key}_{name}": np.nan_to_num(column) for name, column in press._asdict().items()}
        work.scene(f"{name}_{key}", scene)
    legend(axes[0, 0], loc="upper right", ncols=3, **INSIDE)
    work.figure(figure, name)
    work.data(name, columns)
    return runs


class Press(NamedTuple):
    """The signals of a run that presses on a wall.

    Attributes:
        t_s: of the ticks.
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
