"""The largest wall stiffness that stays stable, from the one-tick map, and two runs that check it with the program."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from haploop.controller.dissipation import Element
from haploop.controller.estimators.kalman import assumed_noises
from haploop.launch.plan.effects import all_effects
from haploop.launch.runs.in_process import run_in_process
from haploop.logger.verdict.measures import NO_SWING, SWINGING, WINDOW_S
from haploop.plant.chain.chain import Chain
from haploop.protocol.scene.hand_force import Step
from haploop.protocol.scene.paths import without
from haploop.protocol.scene.scene import Hand, Scene, Wall
from haploop.tools.linear.one_tick import OneTickMap

BELOW, ABOVE = 0.97, 1.03
# How far inside the wall the loop rests, the amplitude its swings start with, and the factor by which they must change.
_DEPTH_M, _START_M, _CHANGE = 2e-3, 3e-6, 100.0
# Links that are stretched and an actuator that lags start with swings of up to the depth: it is then less.
_DEPTH_OF_MORE_STATES_M = 6e-5
_SPRING = Wall(position=0.0, stiffness=0.0)


@dataclass(frozen=True)
class StiffnessLimit:
    """A limit, rho(M) = 1, and the verdicts of the runs at 0.97 and 1.03 of it."""

    stiffness_N_m: float
    below: str
    above: str

    @property
    def confirmed(self) -> bool:
        return self.below in ("steady", NO_SWING) and self.above in ("limit-cycle", SWINGING, "diverged")


def stiffness_limit(scene: Scene, kinds: dict[str, type[Element]]) -> StiffnessLimit:
    """The limit of a resolved scene's loop, checked by a run on either side; NotLinear, NeverStable without one."""
    limit = OneTickMap.from_scene(scene, kinds).stiffness_limit()
    verdicts = [run_in_process(pressed_deep(scene, share * limit, kinds), kinds)["verdict"] for share in (BELOW, ABOVE)]
    return StiffnessLimit(limit, *verdicts)


def pressed_deep(scene: Scene, stiffness: float, kinds: dict[str, type[Element]] | None = None) -> Scene:
    """The scene's loop held 2 mm deep in a wall, 3 um away from where it rests, without what its map leaves out.

    The push sets in with the first command, so that little else sets it swinging. It lasts until the swings are a
    hundred times as wide as at the start, or a hundredth: far above or below what the verdict takes for a swing, and
    never out of the wall; with links, or an actuator that lags, the depth is 60 um, and what grows may leave it.
    """
    at, rate = scene.clock.round_trip_delay, scene.clock.control_rate
    depth_m = _DEPTH_M if len(Chain.from_scene(scene).states) == 2 else _DEPTH_OF_MORE_STATES_M
    push = Step(value=-stiffness * depth_m, at=at)
    pressed = smooth(scene)
    pressed = replace(
        pressed,
        hand=replace(pressed.hand or Hand(), rest=0.0, force=push),
        device=replace(pressed.device, position=_START_M, velocity=0.0),
        wall=replace(scene.wall or _SPRING, position=depth_m, stiffness=stiffness, occupies="below"),
        run=replace(pressed.run, log="none"),
    )
    growth = OneTickMap.from_scene(pressed, kinds).growth(stiffness)
    changed_s = math.log(_CHANGE) / abs(math.log(growth)) / rate
    return replace(pressed, duration=math.ceil((at + changed_s + WINDOW_S) * rate) / rate)


def smooth(scene: Scene) -> Scene:
    """The scene without what its one-tick map leaves out; a Kalman filter keeps the gains that it has with that."""
    rough = [key for effect in all_effects() for key in effect.left_out]
    smoothed = without(scene, "event", *rough)
    if scene.velocity and scene.velocity.estimator == "kalman":
        noises = assumed_noises(scene, 1.0 / scene.clock.control_rate)
        smoothed = replace(smoothed, velocity=replace(scene.velocity, **noises))
    return smoothed
