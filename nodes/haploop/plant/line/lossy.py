"""A line on which commands arrive late, overtake one another or are lost."""

from __future__ import annotations

from collections import deque
from itertools import repeat
from typing import Any

from haploop.plant.counters import DROPPED, LOST, Tally
from haploop.plant.line.delay import Hold
from haploop.plant.random.streams import Draw
from haploop.protocol.ticks import Timebase


class UncertainLine:
    """Command k takes effect at step e_k = k n + d + j_k, unless it is lost; the device holds the last one.

    Of two commands the later one has the last word: command k is dropped if a later one has begun to act before e_k,
    and acts for no time if a later one takes effect at e_k too. Commands on their way are kept in a queue along which
    both k and e_k rise: one that arrives removes from its end all those it overtakes. What would take effect beyond
    the end of the run neither acts nor counts.

    Since j_k >= 0, interval k still needs no command later than k - L.

    Args:
        time: the integers of the run.
        additional_steps: j of the next command, whole plant steps, >= 0.
        is_lost: whether the next command is lost.

    Attributes:
        tallies: commands dropped and lost, each at the step at which it would have taken effect.
    """

    def __init__(self, time: Timebase, additional_steps: Draw, is_lost: Draw) -> None:
        self._additional_steps, self._is_lost = additional_steps, is_lost
        self._steps, self._delay = time.steps_per_tick, time.delay_steps
        self._end = time.ticks * time.steps_per_tick
        self._received = 0
        self._coming: deque[tuple[int, float, int]] = deque()
        self._acting = 0.0, -1
        self._dropped, self._lost = Tally(), Tally()
        self.tallies = {DROPPED: self._dropped, LOST: self._lost}

    def take_over(self, force: float, command: int, coming: list[tuple[int, float, int]], received: int) -> None:
        """Go on for another line: what acts now, what is on its way as (step of effect, force, command), and how many
        commands have come."""
        self._acting, self._received = (force, command), received
        self._coming.extend(coming)

    def retimed(self, delay_steps: int, _tick: int) -> UncertainLine:
        """The same line with another delay of the commands still to come."""
        self._delay = delay_steps
        return self

    def receive(self, forces: list[float]) -> None:
        """Take the next commands, in order of their ticks."""
        for command, force in enumerate(forces, self._received):
            effect = command * self._steps + self._delay + self._additional_steps()
            if self._is_lost():
                if effect < self._end:
                    self._lost.note(effect)
            elif effect < self._end:
                self._overtake(effect)
                self._coming.append((effect, force, command))
        self._received += len(forces)

    def _overtake(self, effect: int) -> None:
        while self._coming and self._coming[-1][0] > effect:
            self._dropped.note(self._coming.pop()[0])

    def holds(self, tick: int) -> list[Hold]:
        """The forces held in interval ``tick``, in order; to be called for every interval, once, from 0 on.

        Commands up to tick - L must have been received.
        """
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


def uncertain_line(scene: dict[str, Any], time: Timebase) -> UncertainLine:
    """The line of a resolved scene with ``[jitter]``, ``[loss]`` or both."""
    return UncertainLine(time, _jitter(scene, time), _loss(scene))


def _jitter(scene: dict[str, Any], time: Timebase) -> Draw:
    if "jitter" not in scene:
        return repeat(0).__next__
    from haploop.plant.line.jitter import additional_delays

    return additional_delays(scene["jitter"], scene["seed"], time.plant_rate)


def _loss(scene: dict[str, Any]) -> Draw:
    if "loss" not in scene:
        return repeat(False).__next__
    from haploop.plant.line.loss import losses

    return losses(scene["loss"], scene["seed"])
