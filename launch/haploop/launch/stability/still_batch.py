"""``StillHand`` for many loops: pushed copies of the members of a batch, in arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from haploop.controller.recorder import BatchRecorder
from haploop.launch.batch.batch import BatchEnd
from haploop.launch.batch.loop import BatchLoop
from haploop.launch.batch.stacking import stacked
from haploop.launch.stability.memory_drift import look_ticks, memory_of
from haploop.launch.stability.still_hand import held, push_ticks
from haploop.plant.choose import make_motion
from haploop.protocol.scene.scene import Scene
from haploop.protocol.trees import tree_select, tree_take

# NumPy copies an operand that all copies share into its buffers unless these are shorter than a row of copies.
_BUFFER = 512
# Records are dropped once in this many ticks.
_FORGET_TICKS = 256
# Copies that have left the limit are still computed, but ignored, until they are more than this share.
_UNHEEDED = 0.25


class StillBatch(BatchLoop):
    """Copies of members of a batch that continue with still hands; the batch itself is not touched.

    Args:
        end: where they continue from.
        member: place of each copy among the members of ``end``, shape (copies,).
        hold_N, push_N: force at which each hand is held, and force added to it in the push, shape (copies,).

    Attributes:
        copy: numbers of the copies that are still there, shape (those there,).
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
        self._traces, self._memory = np.empty((2, 0, len(member))), list[tuple[int, np.ndarray]]()
        # Friction might switch for ever in a copy that has left the limit.
        self._unheeded = 0.0 if scenes[0].friction else _UNHEEDED
        self._gone = np.zeros(len(member), bool)

    def go_to(self, seconds: float) -> list[tuple[int, np.ndarray]]:
        """Continues until so many seconds have passed since the push; drops copies that leave the limit on the way.

        Returns:
            (number of the copy, its positions at the ticks so far) for each that left the limit, in order.

        Raises:
            ElementError: an element raised.
        """
        left: list[tuple[int, np.ndarray]] = []
        with np.errstate(all="ignore"):  # which also restores the buffers
            np.setbufsize(_BUFFER)
            if self._tick < self._first:
                left += self._go_until(self._first)
                motion = make_motion(self._then, self._time, max(1, len(self.copy)))
                motion.restore(self._motion.state, self._motion.last)
                self._motion = motion
                self._traces, self._memory = self._traces[:, :0], []
            left += self._go_until(self._first + round(seconds * self._time.control_rate))
        return left

    def _go_until(self, end: int) -> list[tuple[int, np.ndarray]]:
        if not len(self.copy):
            return []
        ticks = self._traces.shape[1]
        more = np.empty((2, end - self._tick, len(self.copy)))
        remembers = memory_of(self._controller, len(self.copy)).size
        looks = look_ticks(ticks, ticks + more.shape[1]) if remembers else []
        self._traces = traces = np.concatenate([self._traces, more], axis=1)
        left: list[tuple[int, np.ndarray]] = []
        while self._tick < end and len(self.copy):
            traces[0, ticks] = self._motion.x
            [traces[1, ticks]] = self._work(self._tick)
            self._tick, ticks = self._tick + 1, ticks + 1
            inside = (np.abs(self._motion.x) <= self._limit_m) | self._gone
            if not inside.all():
                left += [(int(self.copy[place]), traces[0, :ticks, place].copy()) for place in np.flatnonzero(~inside)]
                self._gone |= ~inside
                if np.count_nonzero(self._gone) > self._unheeded * len(self._gone):
                    self.keep(~self._gone)
                    traces = self._traces
            if ticks in looks and len(self.copy):
                self._memory.append((ticks, memory_of(self._controller, len(self.copy))))
            if self._tick % _FORGET_TICKS == 0:
                self._forget()
        self._forget()
        self.keep(~self._gone)
        return left

    def _forget(self) -> None:
        self._motion.forget_record()
        self._rows.take_rows()
        self._elements.check()

    def positions(self) -> np.ndarray:
        """Returns the positions at the ticks since the push, shape (copies, ticks), m."""
        return np.ascontiguousarray(self._traces[0].T)

    def commands(self) -> np.ndarray:
        """Returns the commands at the ticks since the push, shape (copies, ticks), N."""
        return np.ascontiguousarray(self._traces[1].T)

    def memory(self) -> list[np.ndarray]:
        """Returns what elements remembered, at equal times from half the time since the push on, (numbers, copies)."""
        return [numbers for ticks, numbers in self._memory if 2 * ticks >= self._traces.shape[1]]

    def keep(self, kept: np.ndarray) -> None:
        """Drops the copies for which ``kept``, shape (copies,), is false."""
        if kept.all():
            return
        self._traces, self.copy, self._gone = self._traces[..., kept], self.copy[kept], self._gone[kept]
        self._memory = [(ticks, numbers[:, kept]) for ticks, numbers in self._memory]
        if len(self.copy):  # empty arrays would be taken for shared ones
            self._select(kept)
            self._limit_m, self._then = tree_select((self._limit_m, self._then), kept)


def _held(scenes: Sequence[Scene], force_N: np.ndarray) -> Scene:
    return stacked([held(scene, force) for scene, force in zip(scenes, force_N.tolist(), strict=True)])
