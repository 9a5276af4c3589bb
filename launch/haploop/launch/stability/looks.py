"""The pushes, the times of the looks and the finding of a look, shared by the judging of one loop and of many."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from haploop.launch.stability.decide import decide
from haploop.launch.stability.finding import HAND_MOVES, NOISE, Finding
from haploop.launch.stability.still_hand import LEAST_PRESS_N, press_of
from haploop.launch.stability.swing import Pushed, measure
from haploop.plant.line.actuator import Actuator
from haploop.protocol.scene.hand_force import constant_from_s
from haploop.protocol.scene.scene import Hand, Scene
from haploop.protocol.ticks import Timebase
from haploop.protocol.walls.wall import Wall

# The larger push as a share of the force that the hand holds the wall with; the smaller one as a share of the larger.
PUSH, SMALLER = 0.3, 0.1
# Blows, as multiples of the larger push: three times the force that the hand holds the wall with, into it and off it.
BLOWS = (10.0, -10.0)
# Times since the push at which the loop is looked at, in s: as part of a run, and if somebody asks.
LOOKS_S = (1.0, 2.0, 4.0, 8.0, 16.0)
PATIENT_S = (*LOOKS_S, 32.0, 64.0)
# A loop is watched for at least this many ticks.
_LEAST_TICKS = 240
# A third copy, pushed harder by this share, shows whether the swing is chaotic: whether that copy ends apart from the
# second by this share of the width.
BESIDE, _APART = 1e-3, 0.2
_LINEAR = ("damping", "bidirectional-inertia")


def watch_times(time: Timebase, delay_steps: int, looks_s: Sequence[float]) -> list[float]:
    """Returns when to look, s: not before a command has gone round eight times, and after enough ticks to tell."""
    least_s = max(8.0 * delay_steps / time.plant_rate, _LEAST_TICKS / time.control_rate)
    return sorted({max(least_s, look_s) for look_s in looks_s})


def parts(one: np.ndarray, other: np.ndarray, width_m: float) -> bool:
    """Tells whether two copies that began together end apart by a fifth of their swing or more.

    A copy that is shorter has left the limit, and so has parted.
    """
    if len(one) != len(other):
        return True
    apart = np.abs(one - other)
    eighth = len(apart) // 8
    return bool(apart[:eighth].min() < 0.01 * width_m and apart[-2 * eighth :].max() > _APART * width_m)


def push_of(hold_N: float, hand: Hand | None, wall_m: float) -> float:
    """Returns the larger push, N, for a loop whose hand is held at a force against a wall at a position."""
    press_N = press_of(hold_N, hand, wall_m)
    return PUSH * max(abs(press_N), LEAST_PRESS_N) * (1.0 if press_N > 0.0 else -1.0)


def is_struck(found: Finding) -> bool:
    """Tells whether a loop is also struck, since a loop that rests after a push may swing on after a blow.

    Friction holds a small swing; a saturating actuator gives way to a wide one, as a switching element does, and an
    element that acts in contact does nothing off the wall.
    """
    return found.word == "steady" and found.why != "decays"


def moved_beside(scene: Scene, from_s: float) -> list[str]:
    """Returns what moves a run besides its loop after a time in s: hand, noise, both, or nothing."""
    still = constant_from_s(scene.hand.force if scene.hand else None) <= from_s
    is_noisy = scene.noise is not None or (scene.accelerometer is not None and scene.accelerometer.noise_density > 0.0)
    unmodelled = scene.hand is not None and scene.hand.kind == "unmodelled"
    return [HAND_MOVES] * (unmodelled or not still) + [NOISE] * is_noisy


def failed(push_N: float, seconds: float, detail: str) -> Finding:
    return Finding("undecided", "failed", abs(push_N), seconds, detail=detail)


def left_limit(push_N: float, seconds: float, wall: Wall, x: np.ndarray) -> Finding:
    """Returns the finding on a loop of which a copy left the limit; x is the position of the copy at its ticks, m."""
    if not _is_inside(wall, x[None, len(x) // 2 :])[0]:
        return Finding("undecided", "leaves the wall", abs(push_N))
    return Finding("growing", "leaves the limit", abs(push_N), seconds)


def _is_inside(wall: Wall, x: np.ndarray, reduce: Callable[..., np.ndarray] = np.any) -> np.ndarray:
    """Tells which loops touched their wall at any (or all) of their ticks; x: position, m, shape (loops, ticks)."""
    position = np.reshape(wall.position, (-1, 1))
    return reduce(wall.inward * (x - position) > 0.0, axis=1)


def findings(
    traces: list[np.ndarray], time: Timebase, wall: Wall, scenes: Sequence[Scene], push_N: np.ndarray, *, last: bool
) -> list[Finding]:
    """Returns the findings so far, from traces of position after both pushes and of the command, (loops, ticks)."""
    small, large, command = traces
    quarter = -(-large.shape[1] // 4)
    half = large.shape[1] // 2
    inside = _is_inside(wall, small[:, -quarter:]) & _is_inside(wall, large[:, -quarter:])
    stays = _is_inside(wall, small[:, half:], np.all) & _is_inside(wall, large[:, half:], np.all)
    count_m = np.array([scene.count_m for scene in scenes])
    smooth = np.array([is_smooth(scene) for scene in scenes])
    pushed = Pushed(small, large, command, np.abs(push_N), count_m, inside, stays, smooth)
    swings = measure(pushed, time.control_rate)
    found = [decide(swing, last=last) for swing in swings]
    limited = [_is_limited(scene, some) for scene, some in zip(scenes, command[:, -quarter:], strict=True)]
    return [replace(each, saturated=is_limited) for each, is_limited in zip(found, limited, strict=True)]


def _is_limited(scene: Scene, command: np.ndarray) -> bool:
    """Tells whether the actuator of a scene cuts off any of these commands, N."""
    actuator = scene.actuator and Actuator(scene.actuator.resolution, scene.actuator.saturation)
    return actuator is not None and bool(np.any(actuator.drive(command)[1]))


def is_smooth(scene: Scene) -> bool:
    """Tells whether nothing but the encoder rounds, nothing saturates, and no estimator filters small swings more.

    Nor may an element behind an encoder be nonlinear: one count may switch on all of its force.
    """
    limits = [
        (table.resolution, getattr(table, "saturation", None))
        for table in (scene.actuator, scene.accelerometer)
        if table
    ]
    switches = scene.encoder and any(element.kind not in _LINEAR for element in scene.dissipation)
    return not (switches or any(map(any, limits)) or scene.estimate("velocity").estimator == "foaw")
