"""Fig. 3: position against force of one contact with a virtual spring, ideal and discrete."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from haploop.controller.dissipation import registry
from haploop.launch.runs.in_batch import run_batch
from haploop.logger.summary import Summary
from haploop.protocol.amounts import amount
from haploop.protocol.scene.paths import without
from haploop.protocol.scene.scene import Encoder, Scene
from haploop.tools.figure.style import INK, PRESSING, RELEASING, SMALL, TEXT, dress, empty_figure, legend
from haploop.tools.studies.choi2022.figures.claims import Finding
from haploop.tools.studies.choi2022.figures.drawing import INSIDE, UPPER_LEFT
from haploop.tools.studies.choi2022.figures.work import Work
from haploop.tools.studies.choi2022.runs import fig6, run, wall_of
from haploop.tools.studies.choi2022.sampled import PERIOD_S, SPRING, STIFFNESS_N_M, forces, taken_J

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Coarse enough to be seen.
_RESOLUTION_M = 1e-4
_SPEED_M_S = 0.1
_PHASES, _GOLDEN = 256, 0.5 * (5.0**0.5 - 1.0)
_FILL = "#E8A0A0"


# Penetration in m, negative outside, and force out of the wall in N at every plant step.
Curve = tuple[np.ndarray, np.ndarray]


def make_3(work: Work) -> list[Finding]:
    """Runs three contacts: sampled and held, then with an encoder's steps as well, then with 2 ms of delay as well."""
    encoder = Encoder(resolution=_RESOLUTION_M)
    late = "One contact, sampled, held, quantised and delayed"
    scenes = {
        "sampled and held": single_contact("One contact, sampled and held"),
        "and 0.1 mm encoder steps": single_contact("One contact, sampled, held and quantised", encoder=encoder),
        "and 2 ms of delay": single_contact(late, delay_s=0.002, encoder=encoder),
    }
    curves, walls, columns = {}, {}, {}
    for number, (name, scene) in enumerate(scenes.items()):
        ran = run(scene)
        depth, force = wall_of(scene).position - ran.log["/plant"]["x"], ran.log["/plant"]["force"]
        curves[name], walls[name] = (depth, force), ran.summary["energy"]["wall"]
        columns |= {f"penetration_{number}_m": depth, f"force_{number}_N": force}
        work.scene(f"figure_3_{number}", scene)
    figure = empty_figure(13.0, 4.4)
    axes = figure.subplots(1, 3, sharey=True, sharex=True)
    for ax, (name, curve) in zip(axes, curves.items(), strict=True):
        _draw(ax, name, curve, walls[name])
    axes[0].set_ylabel("force out of the wall (N)", fontsize=TEXT, color=INK)
    work.figure(figure, "figure_3")
    work.data("figure_3", columns)
    leaks_J = {name: leaks_of_phases_J(scene, 16 if work.small else _PHASES) for name, scene in scenes.items()}
    work.data("figure_3_phases", {f"leak_{number}_J": leak for number, leak in enumerate(leaks_J.values())})
    sampled, quantised, delayed = map(_spread, leaks_J.values())
    supports = min(map(np.min, leaks_J.values())) > 0.0
    work.conclude(supports=supports, sampled=sampled, quantised=quantised, delayed=delayed)
    return _findings(work, curves, walls, leaks_J)


def single_contact(title: str, *, delay_s: float = 0.0, **tables: Any) -> Scene:
    """Returns a scene in which the device, hand attached but slack, coasts at 0.1 m/s into 0.15 N/mm and out again.

    It has no encoder, elements or estimators except those in ``tables``.
    """
    estimates = ("encoder", "noise", "dissipation", "velocity", "acceleration")
    scene = without(fig6("b"), *estimates, "hand.stiffness", "hand.damping", "hand.force")
    start = wall_of(scene).position + 0.0004
    device = replace(scene.device, position=start, velocity=-_SPEED_M_S, damping=0.0)
    clock = replace(scene.clock, round_trip_delay=delay_s)
    return replace(scene, title=title, duration=0.1, clock=clock, device=device, **tables)


def leaks_of_phases_J(scene: Scene, count: int) -> np.ndarray:
    """Returns the wall's leak in J over all phases: for entries spread over a tick, and walls spread over a count.

    In the scene as drawn the device covers exactly one count in a tick, and meets the wall at a tie of the rounding.
    """
    wall, way_m = wall_of(scene), _SPEED_M_S * PERIOD_S
    scenes = []
    for i in range(count):
        # The two phases are spread evenly together (Korobov's lattice by the golden ratio).
        shift, start = _RESOLUTION_M * (i * _GOLDEN % 1.0), way_m * (i + 0.5) / count
        device = replace(scene.device, position=scene.device.position + shift + start)
        scenes.append(replace(scene, device=device, wall=replace(wall, position=wall.position + shift)))
    return np.array([-one["energy"]["wall"]["true_J"] for one in run_batch(scenes, registry())])


def _spread(values_J: np.ndarray) -> str:
    """Returns mean and standard deviation: ``"95.1 ± 5.4 µJ"``."""
    return f"{1e6 * values_J.mean():.1f} ± {1e6 * values_J.std(ddof=1):.1f} µJ"


def _draw(ax: Axes, name: str, curve: Curve, wall: Summary) -> None:
    depth, force = curve
    mm = 1e3 * depth
    deepest = int(np.argmax(mm))
    ax.fill(mm, force, color=_FILL, linewidth=0, alpha=0.7)
    reach = np.array([0.0, mm[deepest]])
    ax.plot(reach, STIFFNESS_N_M * reach / 1e3, color=INK, linewidth=1.6, label="ideal")
    way_in, way_out, held = slice(deepest + 1), slice(deepest, None), {"linewidth": 1.2, "drawstyle": "steps-post"}
    ax.plot(mm[way_in], force[way_in], color=PRESSING, label="pressing", **held)
    ax.plot(mm[way_out], force[way_out], color=RELEASING, label="releasing", **held)
    dress(ax, name, "penetration (mm)", "")
    ax.set_xlim(-0.45, None)
    took, gave = map(_J, _taken_and_given_J(depth, force))
    text = f"took {took}\ngave {gave}\nleak {_J(-wall['true_J'])}"
    ax.text(0.97, 0.06, text, transform=ax.transAxes, ha="right", va="bottom", fontsize=SMALL, color=INK)
    legend(ax, **UPPER_LEFT, **INSIDE)


def _taken_and_given_J(depth: np.ndarray, force: np.ndarray) -> tuple[float, float]:
    work = force[:-1] * np.diff(depth)
    return float(np.maximum(work, 0.0).sum()), float(np.maximum(-work, 0.0).sum())


def _findings(
    work: Work, curves: Mapping[str, Curve], walls: Mapping[str, Summary], leaks_J: Mapping[str, np.ndarray]
) -> list[Finding]:
    energies = {name: _taken_and_given_J(*one) for name, one in curves.items()}
    # -sum f dx: the force points out, so the energy it gives on the way out is positive: counter-clockwise.
    areas = [float(-np.sum(force[:-1] * np.diff(depth))) for depth, force in curves.values()]
    leaks = [-wall["true_J"] for wall in walls.values()]
    apart = max(abs(area / leak - 1.0) for area, leak in zip(areas, leaks, strict=True))
    leak = walls["and 2 ms of delay"]["leak"]
    causes = ("sampling_and_hold", "quantisation", "delay")
    # Penetration where the force begins, and where it ends.
    acting = ((depth, np.flatnonzero(force)) for depth, force in curves.values())
    edges = [(float(depth[there[0]]), float(depth[there[-1] + 1])) for depth, there in acting]
    late = [began > 0.0 > ended for began, ended in edges]
    levels = [len(np.unique(force)) for _, force in curves.values()]
    steps = [int(np.count_nonzero(force)) for _, force in curves.values()]
    exact, closed = _constant_speed()
    summed, formula = _telescoped()
    return [
        work.claims["generates"].holds_if(
            all(gave > took for took, gave in energies.values()) and min(map(np.min, leaks_J.values())) > 0.0,
            energies="; ".join(f"{name}: took {_J(took)}, gave {_J(gave)}" for name, (took, gave) in energies.items()),
            leaks="; ".join(f"{name} {_spread(leak)}" for name, leak in leaks_J.items()),
            count=len(leaks_J["sampled and held"]),
            exact=_J(exact),
            closed=_J(closed),
        ),
        work.claims["late"].holds_if(
            all(late),
            late[0],
            edges="; ".join(f"{1e3 * began:.2f} and {1e3 * end:.2f} mm".replace("-", "−") for began, end in edges),
        ),
        work.claims["staircase"].holds_if(
            all(level < count / 5 for level, count in zip(levels, steps, strict=True)) and levels[1] < levels[0],
            levels=" / ".join(map(str, levels)),
            steps=" / ".join(map(str, steps)),
            causes=", ".join(f"{cause.replace('_', ' ')} {_J(-leak[f'{cause}_J'])}" for cause in causes),
        ),
        work.claims["counterclockwise"].holds_if(min(areas) > 0.0 and apart < 1e-9, areas=", ".join(map(_J, areas))),
        work.claims["sum"].holds_if(abs(summed / formula - 1.0) < 1e-9, summed=_J(summed), formula=_J(formula)),
        work.claims["ideal"].holds_if(max(abs(wall["ideal_J"]) for wall in walls.values()) < 1e-12),
    ]


def _J(value: float) -> str:
    return amount(value, "J")


def _constant_speed() -> tuple[float, float]:
    """Returns the leak of a press to 2 mm and back at 0.1 m/s, in whole samples, and K x_max v T."""
    depth = np.concatenate([np.linspace(0.0, 2e-3, 21), np.linspace(2e-3, 0.0, 21)[1:]])
    x = -depth[:, None]
    return float(-taken_J(x, forces(x, SPRING)).sum()), STIFFNESS_N_M * 2e-3 * 0.1 * PERIOD_S


def _telescoped() -> tuple[float, float]:
    """Returns eq. 5 along a random closed path, and -(K / 2) sum (dx)^2, which summation by parts makes of it."""
    path = np.random.default_rng(3).normal(scale=1e-3, size=200).cumsum()
    x = np.append(path, path[0])[:, None]
    return float(taken_J(x, forces(x, SPRING)).sum()), float(-STIFFNESS_N_M / 2.0 * (np.diff(x, axis=0) ** 2).sum())
