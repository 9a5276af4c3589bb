"""The controller's core: from a sample to a force, with elements and gains that may change at a tick."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from haploop.controller.active_elements import Slots
from haploop.controller.changes import apply_change
from haploop.controller.dissipation import Element, ElementError, Motion
from haploop.controller.estimators.choose import Sample, estimators
from haploop.controller.recorder import MOTION_COLUMNS, Recorder
from haploop.controller.wall import NoWall, Wall
from haploop.protocol.changes import Change, Event
from haploop.protocol.ticks import DELAY, Timebase


class Controller:
    """Estimates, wall and dissipation elements of one loop; knows nothing of sockets.

    At tick k: f_d[k] = f_wall[k] + sum of the elements' forces[k], in the order of the scene's list.

    Attributes:
        tick: the next tick to be answered.
        recorder: what happened at every tick, in blocks.
    """

    # What makes an element's force a number, or raises.
    _number: Callable[[Any], Any] = float

    def __init__(self, scene: dict[str, Any], time: Timebase, kinds: dict[str, type[Element]]) -> None:
        self._kinds, self._control_rate = dict(kinds), time.control_rate
        self._start_estimates = estimators(scene, time.period_s)
        self._wall = Wall(scene["wall"]) if "wall" in scene else NoWall()
        self._slots = Slots(scene.get("dissipation", []), self._kinds)
        self._motion = Motion(time.period_s, self._wall.into_wall)
        self._changes: list[Change] = []
        self._next_change = math.inf
        self.recorder = Recorder(self._wall, self._slots, history_ticks=time.lookahead_ticks + 2)
        self.tick = 0

    @property
    def into_wall(self) -> float:
        """Direction that leads into the wall, 0.0 without one."""
        return self._motion.into_wall

    def schedule(self, tick: int, event: Event) -> None:
        """Have a checked swap or set take effect at ``tick``, before that tick's force."""
        change = Change.from_dict(tick, event)
        if DELAY in change.set:
            self.recorder.cover(math.ceil(change.set[DELAY] * self._control_rate) + 2)
        self._changes.append(change)
        self._next_change = self._changes[0].tick

    def answer(self, samples: Sequence[Sample]) -> list[float]:
        """The commands in N that answer the next samples, in order.

        Raises:
            ElementError: an element raised, or gave something that is no number.
        """
        if self.tick == 0:
            self._velocity, self._acceleration = self._start_estimates(samples[0])
        return [self._command(sample) for sample in samples]

    def _command(self, sample: Sample) -> float:
        if self.tick >= self._next_change:
            self._change()
        motion, wall = self._motion, self._wall
        motion.a_before = motion.a
        motion.x = x = sample[0]
        motion.v = v = self._velocity(x, sample)
        motion.a = a = self._acceleration(v, sample)
        contact, total = wall.meet(x)
        motion.contact = contact
        row = [x, v, a, total]
        try:
            for slot in self._slots.slots:
                force = self._number(slot.force(motion))
                total = total + force
                row.append(force)
        except Exception as error:
            raise self._blame(len(row) - len(MOTION_COLUMNS), error) from error
        row += (total, contact)
        self.recorder.add(row)
        self.tick += 1
        return total

    def _blame(self, index: int, error: Exception) -> ElementError:
        kind = self._slots.slots[index].element.kind
        what = f"{type(error).__name__}: {error}"
        return ElementError(f"Element {index} ({kind}) gave no force at tick {self.tick}: {what}.")

    def _change(self) -> None:
        """Carry out what is due; later ticks are written to a new block, since its columns may differ."""
        self.recorder.cut()
        while self._changes and self._changes[0].tick <= self.tick:
            refusal = apply_change(self._changes.pop(0), self._slots, self._wall, self._kinds)
            if refusal:
                self.recorder.refused.append(refusal)
        self._next_change = self._changes[0].tick if self._changes else math.inf
        self.recorder.open()
