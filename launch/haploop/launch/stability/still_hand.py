"""The loop continued from the end of a run, its hand held still except for one push, without noise or events."""

from __future__ import annotations

import math
from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass, replace

import numpy as np

from haploop.controller.controller import Controller
from haploop.launch.stability.finding import Finding
from haploop.launch.stability.memory_drift import look_ticks, memory_of
from haploop.plant.motion.hand_force import HandForce
from haploop.plant.plant import Plant
from haploop.protocol.scene.hand_force import Constant, constant_from_s
from haploop.protocol.scene.scene import Hand, Scene
from haploop.protocol.ticks import Timebase
from haploop.protocol.walls.wall import Wall

# A push lasts this long.
PUSH_S = 0.05
# A force of the hand is a hold if it lasts this long; only this many seconds at the end of a run are searched.
_HOLD_S, _LATEST_S = 0.25, 60.0
# A hold that is harder by less than this factor is the same.
_HARDER = 1.2
# A hand that presses with less holds nothing.
LEAST_PRESS_N = 1e-3
# Parts of a count, or of a step of the force, by which a loop that rests is held deeper.
_DEEPER = (1.0 / 3.0, 2.0 / 3.0)


@dataclass(frozen=True)
class End:
    """The end of a run.

    Attributes:
        scene: what was at work at the end, after all changes.
        time: its timebase.
        plant, controller: in their state at the end, with their blocks taken.
        hold_N: the force at which the hand is held from there on; after a run that ended out of contact, the mean
            force of its last ticks.
        told: the finding if the end alone tells it: diverged or out of contact. None if the loop is to be pushed.
        on_exchange: called whenever a plant that continues from there asks for commands.
    """

    scene: Scene
    time: Timebase
    plant: Plant
    controller: Controller
    hold_N: float
    told: Finding | None = None
    on_exchange: Callable[[], object] = lambda: None

    @property
    def wall_m(self) -> float:
        """Position of the wall, which an event may have moved, m."""
        return float(self.controller.params.wall.position)


class StillHand:
    """A loop that continues with a still hand; the run itself is not touched.

    Args:
        end: where it continues from.
        push_N: force of the push, added to that of the hand.

    Attributes:
        x: position at the ticks since the push, m.
        command: command at the ticks since the push, N.
        stop_reason: why the plant has ended by itself, or None.
    """

    def __init__(self, end: End, push_N: float) -> None:
        self._time, self._rate = replace(end.time, ticks=2**53), end.time.control_rate
        self._plant = continue_plant(held(end.scene, end.hold_N + push_N), self._time, end.plant)
        self._controller = end.controller.fork()
        self._first, self._steps = end.plant.reached + push_ticks(self._rate), end.time.steps_per_tick
        self._then: Scene | None = held(end.scene, end.hold_N)
        self.x, self.command = np.zeros(0), np.zeros(0)
        self._memory: list[tuple[float, np.ndarray]] = []
        self._on_exchange = end.on_exchange

    @property
    def stop_reason(self) -> str | None:
        return self._plant.stop_reason

    def go_to(self, seconds: float) -> None:
        """Continues until so many seconds have passed since the push.

        Raises:
            ElementError: an element raised.
            ArithmeticError: the plant's arithmetic failed.
        """
        if self._then:
            self._run_until(self._first)
            if self.stop_reason:
                return
            self._plant, self._then = continue_plant(self._then, self._time, self._plant), None
            self.x, self.command = np.zeros(0), np.zeros(0)
        begun, end = len(self.x), round(seconds * self._rate)
        for tick in look_ticks(begun, end) if memory_of(self._controller).size else [end]:
            self._run_until(self._first + tick)
            self._memory.append((len(self.x), memory_of(self._controller)))

    def memory(self) -> list[np.ndarray]:
        """Returns what its elements remembered at equal times, from half the time since the push on."""
        return [numbers for ticks, numbers in self._memory if 2 * ticks >= len(self.x)]

    def _run_until(self, tick: int) -> None:
        commands: list[float] = []

        def exchange(_: int, samples: list[tuple[float, ...]]) -> list[float]:
            self._on_exchange()
            forces = [float(force) for force in self._controller.answer(samples)]
            commands.extend(forces)
            return forces

        self._plant.run_until(tick, exchange)
        _, ticks, columns = self._plant.take_block()
        self._controller.recorder.take()
        self.x = np.append(self.x, np.frombuffer(columns["x"])[: ticks * self._steps : self._steps])
        self.command = np.append(self.command, commands[:ticks])


def push_ticks(rate: int) -> int:
    """Returns how many ticks a push lasts at ``rate`` ticks a second, at least one."""
    return max(1, round(PUSH_S * rate))


def held(scene: Scene, force_N: float) -> Scene:
    """Returns the scene with a constant force of the hand, without noise and events."""
    sensor = scene.accelerometer and replace(scene.accelerometer, noise_density=0.0)
    hand = replace(scene.hand or Hand(), force=Constant(value=force_N))
    return replace(scene, hand=hand, event=(), noise=None, accelerometer=sensor)


def continue_plant(scene: Scene, time: Timebase, plant: Plant) -> Plant:
    """Returns a plant of the scene that goes on from where another one is."""
    other = Plant(scene, time)
    other.restore(deepcopy(plant.checkpoint()))
    return other


def hold_of(scene: Scene, time: Timebase, last: int, inside: np.ndarray) -> float:
    """Returns the mean force of the hand in N over the ticks before ``last`` that were in contact.

    ``inside`` tells which these are, shape (ticks,).
    """
    n = time.steps_per_tick
    force = HandForce(scene.hand.force if scene.hand else None, time.plant_rate)
    return float(force.at_steps((last - len(inside)) * n, last * n)[::n][inside].mean())


def press_of(hold_N: float, hand: Hand | None, wall_m: float) -> float:
    """Returns the force that a hand held at a force presses with, N: with its spring at the wall if that is more."""
    with_spring_N = hold_N + hand.stiffness * (hand.rest - wall_m) if hand else hold_N
    return max(hold_N, with_spring_N, key=abs)


def deeper_holds(scene: Scene, wall: Wall, hold_N: float) -> list[float]:
    """Returns holds at which the device rests a third and two thirds of an encoder's count deeper, N.

    Without an encoder, they are harder by these parts of a step of the actuator's force; none without that, too.

    The response of a wall behind an encoder depends on where within a count the device rests: a loop that rests at one
    hold may chatter at the next. The missing force is that of wall and hand on the way, at most V'(p + q) - V'(p) and
    k q, where V'(p) is the force that the hand presses with, q the count and k the stiffness of the hand through its
    grip.
    """
    press_N = press_of(hold_N, scene.hand, wall.position)
    if not wall.inward:
        return []
    if scene.encoder:
        count_m, depth_m = scene.encoder.resolution, depth_of(wall, abs(press_N))
        count_N = wall.held(depth_m + count_m) - wall.held(depth_m) + _stiffness_of(scene.hand) * count_m
    else:
        count_N = (scene.actuator and scene.actuator.resolution) or 0.0
    return [hold_N + math.copysign(part * count_N, press_N) for part in _DEEPER] if count_N > 0.0 else []


def depth_of(wall: Wall, press_N: float) -> float:
    """Returns the depth, m, at which a wall balances a press; one metre if it answers with less there."""
    low, high = 0.0, 1.0
    for _ in range(60):
        middle = (low + high) / 2.0
        low, high = (middle, high) if wall.held(middle) < press_N else (low, middle)
    return high


def _stiffness_of(hand: Hand | None) -> float:
    """Returns the stiffness of a hand, felt through its grip, N/m."""
    if hand is None or not hand.stiffness:
        return 0.0
    return 1.0 / (1.0 / hand.stiffness + (1.0 / hand.grip.stiffness if hand.grip else 0.0))


def harder_hold(scene: Scene, time: Timebase, last: int, hold_N: float, wall_m: float) -> float | None:
    """Returns the hardest hold in N of a moving hand, before tick ``last``; None if ``hold_N`` is about as hard.

    The wall is at ``wall_m``. The hold is the largest mean over a quarter of a second: a hand that trembles faster
    holds with its average force.
    """
    table = scene.hand.force if scene.hand else None
    if math.isfinite(constant_from_s(table)):
        return None
    n, ticks = time.steps_per_tick, max(1, round(_HOLD_S * time.control_rate))
    first = max(0, last - round(_LATEST_S * time.control_rate))
    force = HandForce(table, time.plant_rate).at_steps(first * n, last * n)[::n]
    sums = np.cumsum(np.concatenate([[0.0], force]))
    means = (sums[ticks:] - sums[:-ticks]) / ticks
    press_N = press_of(hold_N, scene.hand, wall_m)
    hardest = float(means[np.argmax(means * np.sign(press_N))]) if len(means) else hold_N
    most_N = press_of(hardest, scene.hand, wall_m)
    is_harder = abs(most_N) > max(_HARDER * abs(press_N), LEAST_PRESS_N) and most_N * press_N > 0.0
    return hardest if is_harder else None
