"""Fig. 9: damping at 5.0 N/mm against unidirectional inertia at 5.5 N/mm."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from haploop.logger.summary import Summary
from haploop.protocol.scene.scene import Scene
from haploop.tools.figure.style import ELEMENTS, INK, WALL, dress, empty_figure, legend
from haploop.tools.render.units import amount
from haploop.tools.studies.choi2022.claims import Finding, claims_of
from haploop.tools.studies.choi2022.device import Elements, elements_of
from haploop.tools.studies.choi2022.drawing import INSIDE
from haploop.tools.studies.choi2022.experiment import findings, nearest
from haploop.tools.studies.choi2022.experiment_measure import DAMPINGS, MASSES, is_steady
from haploop.tools.studies.choi2022.work import Run, Work, run, wall_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CLAIMS = claims_of(9)
# An encoder's step to either side; what is steady and swings wider is dying down.
_STEPS_M = 2.0 * 28.7e-6


def make(work: Work) -> list[Finding]:
    """Tunes each on a grid of sizes, and runs the best of them."""
    # The next stiffness beyond those that are drawn is for "larger than 5.0".
    cases = {
        "damping": ("damping at 5.0 N/mm", _tuned(work, "damping", 5000.0, DAMPINGS).scene),
        "unidirectional": (
            "unidirectional inertia at 5.5 N/mm",
            _tuned(work, "unidirectional-inertia", 5500.0, MASSES).scene,
        ),
    }
    damping, inertia = presses(work, "figure_9", cases)
    beyond = _tuned(work, "damping", 5500.0, DAMPINGS)
    shown = inertia.summary["window"]["displayed_stiffness_N_m"]
    off = abs(shown / 5500.0 - 1.0)
    here, ours = (Tuned(ran.scene, ran.summary) for ran in (damping, inertia))
    return findings(
        work,
        CLAIMS,
        {"damping": not beyond.steady, "inertia": ours.steady, "displayed": ours.steady and off < 0.01},
        inertia=f"{1e3 * ours.size('mass'):.3g} g: {ours.ended}",
        here=f"{here.size('damping'):.2g} N s/m, {here.ended}",
        beyond=f"{beyond.size('damping'):.2g} N s/m, {beyond.ended}",
        shown=shown / 1e3,
        off=100 * off,
    )


class Tuned(NamedTuple):
    """The scene of a wall with the elements with which it swings least, and what came of that run."""

    scene: Scene
    result: Summary

    def size(self, parameter: str) -> float:
        return next(e.parameters[parameter] for e in self.scene.dissipation if parameter in e.parameters)

    @property
    def steady(self) -> bool:
        return is_steady(self.result)

    @property
    def ended(self) -> str:
        if not self.swing_m:
            return f"{self.result['verdict']}, comes to rest"
        dying = ", dying down" if self.steady and self.swing_m > _STEPS_M else ""
        return f"{self.result['verdict']}, swings {amount(self.swing_m, 'm')} peak to peak{dying}"

    @property
    def swing_m(self) -> float:
        """Peak to peak over the last 0.5 s."""
        return self.result["window"]["oscillation_m"]


def tuned(work: Work, name: str, stiffness: float, choices: Sequence[Elements]) -> Tuned:
    """Returns of some elements those that are steady and swing least ("best tuned", Choi et al. 2022, V.B.1)."""
    scenes = [nearest(work).scene(stiffness, elements) for elements in choices]
    results = work.run_all(f"tuning {name}", scenes)
    tried = [Tuned(scene, result) for scene, result in zip(scenes, results, strict=True) if "window" in result]
    return min(tried, key=lambda one: (not one.steady, one.swing_m))


def _tuned(work: Work, kind: str, stiffness: float, sizes: np.ndarray) -> Tuned:
    return tuned(work, kind, stiffness, [elements_of(kind, float(one)) for one in sizes[:: 8 if work.small else 1]])


def presses(work: Work, name: str, cases: Mapping[str, tuple[str, Scene]]) -> list[Run]:
    """Runs presses on a wall, given heading and scene by key, and draws them side by side; returns the runs."""
    figure = empty_figure(12.0, 6.4)
    axes = figure.subplots(2, 2, sharex=True)
    columns, runs = {}, []
    for column, (key, (heading, scene)) in zip(axes.T, cases.items(), strict=True):
        runs.append(run(scene))
        press = Press.from_run(runs[-1])
        _draw(column[0], column[1], press, f"{heading}: {runs[-1].summary['verdict']}", wall_of(scene).stiffness)
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
