"""A line on which commands arrive late, overtake one another or are lost."""

from __future__ import annotations

from collections import deque
from itertools import repeat
from typing import Any

import numpy as np

from haploop.plant.counters import DROPPED, LOST, Counter
from haploop.plant.line import Hold
from haploop.plant.streams import Draw, RandomStream
from haploop.protocol.scene.effects import Jitter, Loss, UniformJitter
from haploop.protocol.ticks import Timebase


class LossyLine:
    """Command k takes effect at step e_k = k n + d + j_k, unless it is lost; the device holds the last one.

    Of two commands the later one prevails: command k is dropped if a later one has begun to act before e_k, and acts
    for no time if a later one takes effect at e_k too. Commands in flight are kept in a queue along which both k and
    e_k rise: a new one removes from its end all those that it overtakes. A command that would take effect beyond the
    end of the run neither acts nor counts.

    Since j_k >= 0, interval k still needs no command later than k - L.

    Attributes:
        delay_steps: delay of the commands still to come.
        additional_steps: returns j of the next command, whole plant steps, >= 0.
        is_lost: tells whether the next command is lost.
        state: (commands received, delay of those to come, those in flight as (step of effect, force, tick), the
            force and the tick of the one in effect, dropped commands, lost commands).
        counters: commands dropped and lost, each at the step at which it would have taken effect.
    """

    def __init__(self, time: Timebase, jitter: Jitter | None = None, loss: Loss | None = None, seed: int = 0) -> None:
        self._time, self._jitter, self._loss, self._seed = time, jitter, loss, seed
        self._steps, self.delay_steps = time.steps_per_tick, time.delay_steps
        self._end = time.ticks * time.steps_per_tick
        self._received = 0
        self._coming: deque[tuple[int, float, int]] = deque()
        self._acting = 0.0, -1
        self._dropped, self._lost = Counter(), Counter()
        self.counters = {DROPPED: self._dropped, LOST: self._lost}
        self._draw_from(0)

    def _draw_from(self, command: int) -> None:
        self.additional_steps = make_jitter(self._jitter, self._seed, self._time.plant_rate, command)
        self.is_lost = make_loss(self._loss, self._seed, command)

    @property
    def state(self) -> tuple[Any, ...]:
        counts = self._dropped.state, self._lost.state
        return self._received, self.delay_steps, tuple(self._coming), *self._acting, *counts

    def restore(self, state: tuple[Any, ...]) -> None:
        self._received, self.delay_steps, coming, force, command, dropped, lost = state
        self._coming, self._acting = deque(tuple(one) for one in coming), (force, command)
        self._dropped.restore(dropped)
        self._lost.restore(lost)
        self._draw_from(self._received)

    def retimed(self, delay_steps: int, _tick: int) -> LossyLine:
        self.delay_steps = delay_steps
        return self

    def receive(self, forces: list[float]) -> None:
        for command, force in enumerate(forces, self._received):
            effect = command * self._steps + self.delay_steps + self.additional_steps()
            if self.is_lost():
                self._lost.note(effect, effect < self._end)
            elif effect < self._end:
                self._overtake(effect)
                self._coming.append((effect, force, command))
        self._received += len(forces)

    def _overtake(self, effect: int) -> None:
        while self._coming and self._coming[-1][0] > effect:
            self._dropped.note(self._coming.pop()[0])

    def holds(self, tick: int) -> list[Hold]:
        step, end = tick * self._steps, (tick + 1) * self._steps
        coming, (force, command) = self._coming, self._acting
        holds: list[Hold] = []
        while coming and coming[0][0] < end:
            effect, next_force, next_command = coming.popleft()
            if effect > step:
                holds.append((effect - step, force, command))
                step = effect
            force, command = next_force, next_command
        holds.append((end - step, force, command))
        self._acting = force, command
        return holds

    def select(self, kept: np.ndarray) -> None:
        raise TypeError("A line with jitter, loss or a changed delay is not run in batches.")


def make_jitter(table: Jitter | None, seed: int, plant_rate: int, first: int = 0) -> Draw:
    """Makes the additional delays of the commands from ``first`` on, in whole plant steps, j_k >= 0.

    uniform   0, 1, ... most, equally likely
    gamma     shape (mean / deviation)^2, scale deviation^2 / mean, rounded to the nearest step
    """
    if table is None:
        return repeat(0).__next__
    stream = RandomStream(seed, "jitter")
    if isinstance(table, UniformJitter):
        return stream.whole(round(table.most * plant_rate) + 1, first)
    mean, deviation = table.mean, table.deviation
    gamma, scale_steps = stream.gamma((mean / deviation) ** 2, first), deviation / mean * deviation * plant_rate
    return lambda: round(scale_steps * gamma())


def make_loss(table: Loss | None, seed: int, first: int = 0) -> Draw:
    """Makes the losses of the commands from ``first`` on, independent of one another and of equal probability."""
    if table is None:
        return repeat(False).__next__
    uniform, probability = RandomStream(seed, "loss").uniform(first), table.probability
    return lambda: uniform() < probability
