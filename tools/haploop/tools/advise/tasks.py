"""Tasks by which a wall is called steady: a tap and a press, or the scene's own task."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from haploop.plant.sensing.encoder import accelerometer_is_used
from haploop.tools.render.units import amount

Scene = dict[str, Any]
# Speed of a firm tap; more than that no task starts with.
TAP_M_S = 0.2
# The hand presses with this, or with this share of what the actuator can give where that is less.
PRESS_N, OF_THE_ACTUATOR = 1.0, 0.3
# Seconds that a standard task lasts, of which the last half second is judged, and round trips at least: what swings
# because of a delay does so in a few of them. A loop that is later than the last has no answer in a reasonable time.
DURATION_S, ROUND_TRIPS, MOST_DELAY_S = 1.0, 20, 0.5
SEEDS = 3
_NO_HAND = {"mass": 0.0, "damping": 0.0, "stiffness": 0.0}
# A force of these kinds stays in the end.
_STAYS = (None, "constant", "ramp", "step", "minimum-jerk")


@dataclass(frozen=True)
class Tasks:
    """The runs that judge a loop.

    Attributes:
        scenes: one a task, without dissipation elements in place of which others may be laid.
        seeds: of each task; one unless something is random.
        words: for what is done.
    """

    scenes: tuple[Scene, ...]
    seeds: int
    words: str

    def make_runs(
        self, stiffness: float, elements: Sequence[dict[str, Any]], vary: Any = None, thorough: bool = True
    ) -> list[Scene]:
        """Makes every run that judges a wall of this stiffness with these elements; ``vary`` is applied to each scene.

        Unless ``thorough``, only the first task with one seed, which is where most walls fail that fail at all.
        """
        placed = [with_wall(scene, stiffness, elements) for scene in self.scenes[: None if thorough else 1]]
        varied = [vary(scene) for scene in placed] if vary else placed
        return [{**scene, "seed": scene["seed"] + i} for scene in varied for i in range(self.seeds if thorough else 1)]

    @property
    def is_one_run(self) -> bool:
        """True where a loop is judged by one run."""
        return len(self.scenes) == self.seeds == 1

    @property
    def first(self) -> Scene:
        """The scene of the first task, the more demanding one."""
        return self.scenes[0]


def make_tasks(scene: Scene, has_task: bool) -> Tasks:
    """Makes the tasks of a resolved scene: its own where its hand keeps pressing to the end, else tap and press."""
    quiet = {**scene, "run": {**scene["run"], "log": "none"}}
    seeds = SEEDS if is_random(scene) else 1
    of_seeds = f", each with {seeds} seeds" if seeds > 1 else ""
    if has_task and keeps_pressing(scene):
        return Tasks((quiet,), seeds, f"the scene's own task of {scene['duration']:g} s{of_seeds}")
    force = press_N(scene)
    words = (
        f"a tap at {TAP_M_S:g} m/s and a slow press, both into a hold of {amount(force, 'N')} for "
        f"{lasts_s(scene):g} s"
        f"{of_seeds}"
    )
    return Tasks((_tap(quiet, force), _press(quiet, force)), seeds, words)


def keeps_pressing(scene: Scene) -> bool:
    """Tells whether a scene has a wall, lasts long enough to be judged and its force stays."""
    kind = scene.get("hand", {}).get("force", {}).get("kind")
    return "wall" in scene and scene["duration"] >= lasts_s(scene) and kind in _STAYS


def lasts_s(scene: Scene) -> float:
    """Returns the duration of the standard tasks of a scene, s."""
    return max(DURATION_S, float(math.ceil(ROUND_TRIPS * scene["clock"]["round_trip_delay"])))


def is_held_by(scene: Scene, time_s: float) -> bool:
    """Tells whether from then on the hand's force is what it stays at."""
    force = scene.get("hand", {}).get("force", {})
    return force.get("kind") in _STAYS and force.get("at", 0.0) + force.get("rise_time", 0.0) <= time_s


def press_N(scene: Scene) -> float:
    """Returns the force of the hand in the standard tasks, N."""
    most = scene.get("actuator", {}).get("saturation")
    return PRESS_N if most is None else min(PRESS_N, OF_THE_ACTUATOR * most)


def is_random(scene: Scene) -> bool:
    """Tells whether another seed gives another run."""
    noisy = accelerometer_is_used(scene) and scene.get("accelerometer", {}).get("noise_density")
    return bool(scene.get("noise") or scene.get("jitter") or scene.get("loss") or noisy)


def with_wall(scene: Scene, stiffness: float, elements: Sequence[dict[str, Any]]) -> Scene:
    """Returns the scene with a wall of this stiffness and these dissipation elements in place of its own."""
    laid = {**scene, "wall": {**scene["wall"], "stiffness": stiffness}, "dissipation": list(elements)}
    if not elements:
        del laid["dissipation"]
    return laid


def _tap(scene: Scene, force_N: float) -> Scene:
    """Makes the tap: device and hand meet the wall at full speed, bounce as they may, and are held to it."""
    return _standard(scene, "a tap", force_N, rise_time=0.1, position=2e-4, velocity=-TAP_M_S)


def _press(scene: Scene, force_N: float) -> Scene:
    """Makes the press: it touches the wall at 1 mm/s; not at rest, so that both tasks run in one array."""
    return _standard(scene, "a press", force_N, rise_time=0.3, position=2e-4, velocity=-1e-3)


def _standard(scene: Scene, name: str, force_N: float, rise_time: float, position: float, velocity: float) -> Scene:
    """Makes a task: wall and rest of the hand's spring at 0; the hand presses down, smoothly, and holds."""
    push = {"kind": "minimum-jerk", "value": -force_N, "rise_time": rise_time}
    return {
        **scene,
        "title": f"{scene['title']}: {name}",
        "duration": lasts_s(scene),
        "device": {**scene["device"], "position": position, "velocity": velocity},
        "hand": {**scene.get("hand", _NO_HAND), "rest": 0.0, "force": push},
        "wall": {"position": 0.0, "stiffness": 0.0, "occupies": "below"},
    }
