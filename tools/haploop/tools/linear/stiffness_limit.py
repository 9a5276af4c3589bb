"""The largest wall stiffness that stays stable, from the one-tick map, and two runs that hold it to the program."""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from haploop.controller.estimators.kalman import assumed_noises
from haploop.launch.plan.effects import all_effects
from haploop.launch.runs.in_process import run_in_process
from haploop.logger.verdict.measures import WINDOW_S
from haploop.plant.chain.chain import Chain
from haploop.protocol.scene.paths import without
from haploop.protocol.scene.scene import Scene
from haploop.tools.linear.one_tick import OneTickMap

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element

BELOW, ABOVE = 0.97, 1.03
# The surface is this far from where the loop rests inside the wall; its swings start with this and must change by this.
_DEPTH_M, _START_M, _CHANGE = 2e-3, 3e-6, 100.0
# Keys that every [accelerometer] has; they are 0 where there is none of it.
_NOT_ABSENT = ("accelerometer.noise_density", "accelerometer.bias")
# Links that are stretched and an actuator that lags start with swings of up to the depth: it is then less.
_DEPTH_OF_MORE_STATES_M = 6e-5


@dataclass(frozen=True)
class StiffnessLimit:
    """A limit and what runs beside it came to.

    Attributes:
        stiffness_N_m: rho(M) = 1.
        below, above: the verdicts at 0.97 and 1.03 of it.
    """

    stiffness_N_m: float
    below: str
    above: str

    @property
    def confirmed(self) -> bool:
        """Steady below, and not steady above."""
        return self.below == "steady" and self.above in ("limit-cycle", "diverged")


def stiffness_limit(scene: dict[str, Any], kinds: dict[str, type[Element]]) -> StiffnessLimit:
    """The limit of a resolved scene's loop, confirmed by a run on either side.

    Raises:
        NotLinear, NeverStable: there is no limit to ask for.
    """
    limit = OneTickMap.from_scene(scene, kinds).stiffness_limit()
    verdicts = [run_in_process(pressed_deep(scene, share * limit, kinds), kinds)["verdict"] for share in (BELOW, ABOVE)]
    return StiffnessLimit(limit, *verdicts)


def pressed_deep(
    scene: dict[str, Any], stiffness: float, kinds: dict[str, type[Element]] | None = None
) -> dict[str, Any]:
    """The scene's loop held 2 mm deep in a wall, 3 um away from where it rests, without what its map leaves out.

    The push sets in with the first command, so that little else sets it swinging. It lasts until the swings are a
    hundred times as wide as at the start, or a hundredth: far above or below what the verdict takes for a swing, and
    never out of the wall. Where there are links, or an actuator that lags, the depth is 60 um, and what
    grows may leave the wall.
    """
    pressed = smooth(scene)
    clock = pressed["clock"]
    at = clock["round_trip_delay"]
    depth_m = _DEPTH_M if len(Chain.from_scene(scene).states) == 2 else _DEPTH_OF_MORE_STATES_M
    push = {"kind": "step", "value": -stiffness * depth_m, "at": at}
    hand = pressed.get("hand", {"mass": 0.0, "damping": 0.0, "stiffness": 0.0})
    pressed["hand"] = {**hand, "rest": 0.0, "force": push}
    pressed["device"] |= {"position": _START_M, "velocity": 0.0}
    pressed["wall"] = {"position": depth_m, "stiffness": stiffness, "occupies": "below"}
    pressed["run"] = {**pressed["run"], "log": "none"}
    growth = OneTickMap.from_scene(pressed, kinds).growth(stiffness)
    changed_s = math.log(_CHANGE) / abs(math.log(growth)) / clock["control_rate"]
    pressed["duration"] = math.ceil((at + changed_s + WINDOW_S) * clock["control_rate"]) / clock["control_rate"]
    return pressed


def smooth(scene: dict[str, Any]) -> dict[str, Any]:
    """The scene without what its one-tick map leaves out; a Kalman filter keeps the gains that it has with it."""
    smoothed = copy.deepcopy(scene)
    period_s = 1.0 / scene["clock"]["control_rate"]
    if scene.get("velocity", {}).get("estimator") == "kalman":
        smoothed["velocity"] |= assumed_noises(Scene.from_dict(scene), period_s)
    rough = [key for effect in all_effects() for key in effect.left_out if key not in _NOT_ABSENT]
    smoothed = without(smoothed, "event", *rough)
    if "accelerometer" in smoothed:
        smoothed["accelerometer"] |= dict.fromkeys((key.partition(".")[2] for key in _NOT_ABSENT), 0.0)
    return smoothed
