"""``StillHand`` of many: pushed copies of the members of a batch, in arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from haploop.controller.recorder import BatchRecorder
from haploop.launch.batch.batch import BatchEnd
from haploop.launch.batch.loop import BatchLoop
from haploop.launch.batch.stacking import stacked
from haploop.launch.stability.still_hand import held, push_ticks
from haploop.plant.choose import make_motion
from haploop.protocol.scene.scene import Scene
from haploop.protocol.trees import tree_select, tree_take

# An operand that all copies share is copied into buffers of NumPy's unless these are shorter than a row of copies.
_BUFFER = 512
# Records are dropped once so many ticks.
_FORGET_TICKS = 256


class StillBatch(BatchLoop):
    """Copies of members of a batch that go on with still hands; the batch itself is not touched.

    Args:
        end: where they go on from.
        member: place of each copy among the members of ``end``, shape (copies,).
        hold_N, push_N: force at which each hand is held, and what is added to it in the push, shape (copies,).

    Attributes:
        copy: number of each of the copies that are still there, shape (those there,).
    """

    def __init__(self, end: BatchEnd, member: np.ndarray, hold_N: np.ndarray, push_N: np.ndarray) -> None:
        params, state, motion, self._last, line, accelerometer = tree_take(
            (end.params, end.state, end.motion, end.last, end.line, end.accelerometer), member
        )
        rows, time = BatchRecorder(), replace(end.time, ticks=2**53)
        scenes = [end.scenes[place] for place in member]
        controller = end.controller.fork(params, state, rows)
        super().__init__(_held(scenes, hold_N + push_N), time, controller, rows, len(member))
        self._motion.restore(motion, self._last)
        self._line.restore(line)
        if self._sensor:
            self._sensor.restore(accelerometer)
        self.copy = np.arange(len(member))
        self._then = _held(scenes, hold_N)
        self._limit_m = np.array([scene.diverged_beyond for scene in scenes])
        self._tick, self._first = end.tick, end.tick + push_ticks(time.control_rate)
        self._x: list[np.ndarray] = []
        self._commands: list[np.ndarray] = []

    def go_to(self, seconds: float) -> list[tuple[int, np.ndarray]]:
        """Goes on until so many seconds have passed since the push; what leaves the limit on the way is dropped.

        Returns:
            (number of the copy, its positions at the ticks so far) of each that left the limit, in order.

        Raises:
            ElementError: an element raised.
        """
        gone: list[tuple[int, np.ndarray]] = []
        with np.errstate(all="ignore"):  # which gives back the buffers as well
            np.setbufsize(_BUFFER)
            while self._tick < self._first + round(seconds * self._time.control_rate) and len(self.copy):
                if self._tick == self._first:
                    self._let_go()
                gone += self._go_on()
        self._motion.forget_record()
        self._rows.take_rows()
        self._elements.check()
        return gone

    def _let_go(self) -> None:
        """Ends the push."""
        motion = make_motion(self._then, self._time, len(self.copy))
        motion.restore(self._motion.state, self._motion.last)
        self._motion, self._x, self._commands = motion, [], []

    def _go_on(self) -> list[tuple[int, np.ndarray]]:
        self._x.append(self._motion.x)
        [force] = self._work(self._tick)
        self._commands.append(np.broadcast_to(force, self._limit_m.shape))
        self._tick += 1
        if self._tick % _FORGET_TICKS == 0:
            self._motion.forget_record()
            self._rows.take_rows()
        inside = np.abs(self._motion.x) <= self._limit_m
        if inside.all():
            return []
        x = self.positions()
        gone = [(int(self.copy[place]), x[place]) for place in np.flatnonzero(~inside)]
        self.keep(inside)
        return gone

    def positions(self) -> np.ndarray:
        """Returns the positions at the ticks since the push, shape (copies, ticks), m."""
        return np.ascontiguousarray(np.stack(self._x, axis=-1))

    def commands(self) -> np.ndarray:
        """Returns the commands at the ticks since the push, shape (copies, ticks), N."""
        return np.ascontiguousarray(np.stack(self._commands, axis=-1))

    def keep(self, kept: np.ndarray) -> None:
        """Drops the copies for which ``kept``, shape (copies,), is false."""
        if kept.all():
            return
        if not kept.any():
            self.copy = self.copy[kept]
            return
        self._select(kept)
        self.copy, self._limit_m, self._x, self._commands, self._then = tree_select(
            (self.copy, self._limit_m, self._x, self._commands, self._then), kept
        )


def _held(scenes: Sequence[Scene], force_N: np.ndarray) -> Scene:
    return stacked([held(scene, force) for scene, force in zip(scenes, force_N.tolist(), strict=True)])
