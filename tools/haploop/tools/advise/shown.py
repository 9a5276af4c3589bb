"""Scenes that show an advice: the advised wall, and the case that breaks first."""

from __future__ import annotations

from dataclasses import replace

from haploop.launch.runs.in_process import run_in_process
from haploop.launch.stability.judge import judge_scene
from haploop.protocol.scene.scene import Scene
from haploop.tools.advise.search import Found
from haploop.tools.advise.subject import Subject
from haploop.tools.advise.walls.cases import Case, is_ideal, slowness
from haploop.tools.advise.walls.felt import buzz, felt_force_N
from haploop.tools.advise.walls.loops import LoneLoop
from haploop.tools.advise.walls.trial import STRETCH_S
from haploop.tools.linear.linearity import installed_kinds
from haploop.tools.render.units import format_stiffness

# Walls on which the case that breaks first is shown, as multiples of the wall that broke.
_STIFFER, _UNSTEADY = (1.0, 1.05, 1.1, 1.2, 1.4, 1.7, 2.0), ("limit-cycle", "growing", "diverged")


def advised_scene(subject: Subject, loop: Scene, found: Found) -> Scene | None:
    """Returns the scene of the advised wall and its element, titled an upper bound if it is one; None on no wall."""
    return _shown(subject, loop, found, found.stiffness_N_m, Case(1.0), "upper bound, " if is_ideal(loop) else "")


def provisos_of(scene: Scene) -> tuple[str, ...]:
    """Returns the provisos in the verdict of a run of the advised scene."""
    return tuple(run_in_process(scene, installed_kinds()).get("stability", {}).get("provisos", ()))


def _shown(
    subject: Subject, loop: Scene, found: Found, stiffness_N_m: float, case: Case, called: str = ""
) -> Scene | None:
    """Returns the scene of a case on a wall with the advised element, ``called`` so in its title; None on no wall."""
    if not stiffness_N_m:
        return None
    best, scene = found.advised, case.scene(loop)
    wall_words = f"{called}{format_stiffness(stiffness_N_m)}"
    title = f"{subject.name}: {wall_words} with {best.family.phrase(best.values)}, {case.words}"
    assert scene.wall
    wall = replace(scene.wall, stiffness=stiffness_N_m)
    elements = best.family.elements(best.values)
    return replace(scene, title=title, wall=wall, dissipation=elements, run=subject.scene.run)


def breaking(subject: Subject, loop: Scene, found: Found) -> Scene | None:
    """Returns the case that breaks first, on the softest wall on which it is not steady, from the one that broke on.

    If a run calls all of these steady, the scene is of the wall that broke and ends with the stretch in which it was
    seen to break; None if no hand would feel what a run does there.
    """
    if not found.breaks or not (case := found.breaks[1].tried):
        return None
    judged = replace(subject, scene=replace(subject.scene, run=replace(subject.scene.run, verdict="pushed")))
    shown = [_shown(judged, loop, found, found.breaks[0] * share, case) for share in _STIFFER]
    kinds = installed_kinds()
    unsteady = (scene for scene in shown if scene and judge_scene(scene, kinds).word in _UNSTEADY)
    return next(unsteady, None) or (ending_with(shown[0], loop, found.breaks[1].at_s) if shown[0] else None)


def ending_with(scene: Scene, loop: Scene, at_s: float) -> Scene | None:
    """Returns a scene that ends with the stretch up to this time and is not pushed; None if nothing is felt there."""
    lasts_s, rate = STRETCH_S * slowness(loop), loop.clock.control_rate
    lone, ticks = LoneLoop(scene, installed_kinds()), round(lasts_s * rate)
    lone.go_on(round(at_s * rate) - ticks)
    seen, felt_N = lone.go_on(ticks), felt_force_N(loop)
    if not seen.gone[0] and buzz(seen.x, seen.measured, seen.command, rate, felt_N).times_felt[0] < 1.0:
        return None
    return replace(scene, duration=at_s, run=replace(scene.run, verdict="window"))
