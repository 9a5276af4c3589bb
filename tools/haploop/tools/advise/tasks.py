"""Tasks by which a wall is called steady: a tap and a press, or the scene's own task."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from haploop.protocol.scene.hand_force import MinimumJerk
from haploop.protocol.scene.paths import value_at, with_value
from haploop.protocol.scene.scene import ElementTable, Hand, Scene, Wall, accelerometer_is_used
from haploop.tools.render.units import amount

# Speed of a firm tap; more than that no task starts with.
TAP_M_S = 0.2
# Of each standard task the speed at which device and hand meet the wall, m/s, and the rise time of the push, s. The tap
# bounces as it may; the press is not at rest, so that both run in one array.
_STANDARD = {"a tap": (TAP_M_S, 0.1), "a press": (1e-3, 0.3)}
# The hand presses with this, or with this share of what the actuator can give where that is less.
PRESS_N, OF_THE_ACTUATOR = 1.0, 0.3
# Seconds that a standard task lasts, of which the last half second is judged, and round trips at least: what swings
# because of a delay does so in a few of them. A loop that is later than the last has no answer in a reasonable time.
DURATION_S, ROUND_TRIPS, MOST_DELAY_S = 1.0, 20, 0.5
SEEDS = 3
# A force of these kinds stays in the end.
_STAYS = (None, "constant", "ramp", "step", "minimum-jerk")


@dataclass(frozen=True)
class Tasks:
    """The runs that judge a loop.

    Attributes:
        scenes: one a task, the more demanding first; walls and elements are laid in place of theirs.
        seeds: of each task; one unless something is random.
    """

    scenes: tuple[Scene, ...]
    seeds: int
    words: str

    def make_runs(
        self,
        stiffness: float,
        elements: Sequence[ElementTable],
        vary: Callable[[Scene], Scene] = lambda scene: scene,
        thorough: bool = True,
    ) -> list[Scene]:
        """Makes every run that judges a wall of this stiffness with these elements; ``vary`` is applied to each scene.

        Unless ``thorough``, only the first task with one seed, which is where most walls fail that fail at all.
        """
        tasks, seeds = (self.scenes, self.seeds) if thorough else (self.scenes[:1], 1)
        varied = [vary(with_wall(scene, stiffness, elements)) for scene in tasks]
        return [replace(scene, seed=scene.seed + i) for scene in varied for i in range(seeds)]

    @property
    def is_one_run(self) -> bool:
        return len(self.scenes) == self.seeds == 1

    @property
    def first(self) -> Scene:
        return self.scenes[0]


def make_tasks(scene: Scene, has_task: bool) -> Tasks:
    """Makes the tasks of a resolved scene: its own where its hand keeps pressing to the end, else tap and press."""
    quiet = with_value(scene, "run.log", "none")
    seeds = SEEDS if _is_random(scene) else 1
    of_seeds = f", each with {seeds} seeds" if seeds > 1 else ""
    lasts_s = max(DURATION_S, float(math.ceil(ROUND_TRIPS * scene.clock.round_trip_delay)))
    keeps_pressing = value_at(scene, "hand.force.kind") in _STAYS
    if has_task and scene.wall and scene.duration >= lasts_s and keeps_pressing:
        return Tasks((quiet,), seeds, f"the scene's own task of {scene.duration:g} s{of_seeds}")
    most_N = value_at(scene, "actuator.saturation")
    force_N = PRESS_N if most_N is None else min(PRESS_N, OF_THE_ACTUATOR * most_N)
    words = f"a tap at {TAP_M_S:g} m/s and a slow press, both into a hold of {amount(force_N, 'N')} for {lasts_s:g} s"
    # Wall and rest of the hand's spring are at 0; the hand presses down, smoothly, and holds.
    standard = tuple(
        replace(
            quiet,
            title=f"{scene.title}: {name}",
            duration=lasts_s,
            device=replace(scene.device, position=2e-4, velocity=-speed),
            hand=replace(scene.hand or Hand(), rest=0.0, force=MinimumJerk(value=-force_N, rise_time=rise_s)),
            wall=Wall(position=0.0, stiffness=0.0),
        )
        for name, (speed, rise_s) in _STANDARD.items()
    )
    return Tasks(standard, seeds, words + of_seeds)


def is_held_by(scene: Scene, time_s: float) -> bool:
    """Tells whether from then on the hand's force is what it stays at."""
    begins, rises = (value_at(scene, f"hand.force.{key}") or 0.0 for key in ("at", "rise_time"))
    return value_at(scene, "hand.force.kind") in _STAYS and begins + rises <= time_s


def _is_random(scene: Scene) -> bool:
    noisy = accelerometer_is_used(scene) and value_at(scene, "accelerometer.noise_density")
    return bool(scene.noise or scene.jitter or scene.loss or noisy)


def with_wall(scene: Scene, stiffness: float, elements: Sequence[ElementTable]) -> Scene:
    """Returns the scene with a wall of this stiffness and these dissipation elements in place of its own."""
    return replace(with_value(scene, "wall.stiffness", stiffness), dissipation=tuple(elements))
