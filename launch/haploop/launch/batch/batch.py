"""A batch: members of one structure, advanced together tick by tick."""

from __future__ import annotations

import gc
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from haploop.controller.active_elements import Unchanged
from haploop.controller.controller import Controller
from haploop.controller.recorder import BatchRecorder
from haploop.launch.batch.loop import BatchLoop
from haploop.launch.batch.stacking import stacked
from haploop.launch.scene.events import scene_events
from haploop.logger.batch import BatchLogger, MemberEnd
from haploop.logger.summary import Summary
from haploop.plant.motion.one_mass import OneMassMotion
from haploop.plant.plant import beyond
from haploop.plant.where_it_pays import WhereItPays
from haploop.protocol.changes import is_change
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
from haploop.protocol.trees import tree_select, tree_take

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element

# A column of a block holds about this many numbers: with fewer, NumPy calls take longer than their work; more do not
# stay in the cache. A chain with friction has some twenty columns, which are gone through twice.
BLOCK, _PARTS_WITH_FRICTION = 98_304, 4
# NumPy copies an operand that all members share, or all steps of a tick, into its buffers unless these are shorter than
# a row of members; the copying triples the time that such an operation takes.
_BUFFER = 512
# Members that have ended are still computed, but ignored, until they are more than this share; not with friction, which
# might switch in them for ever.
_UNHEEDED = 0.25


# For batches of this many ticks in all.
LOOPS = WhereItPays("haploop.launch.batch.loops", 6_000_000)


class BatchEnd(NamedTuple):
    """The end of some members of a batch; trees have the members on the last axis of their arrays.

    Attributes:
        numbers: numbers of their scenes among those of the batch, shape (members,).
        tick: tick at which they ended.
        controller: controller of the whole batch.
        params, state: those of the controller, for these members.
        motion, last, line, accelerometer: states of the plant's parts, and the last hold in effect.
        inside: whether each tick of the last half second, or of the second half of a shorter run, was in contact,
            shape (members, ticks).
    """

    numbers: np.ndarray
    scenes: list[Scene]
    time: Timebase
    tick: int
    controller: Controller
    params: Any
    state: Any
    motion: Any
    last: Any
    line: Any
    accelerometer: Any
    inside: np.ndarray


class Batch(BatchLoop):
    """Scenes of one structure, each a place in arrays: sensor, line, motion, controller and books.

    The computing code is that of a single run, on arrays. The code that decides when a single run ends is written here
    for many. A member that diverged gets its results and leaves the arrays; one whose numbers cease to be finite leaves
    them without results.

    Args:
        scenes: resolved scenes for which ``is_batchable`` holds and ``structure`` is the same.

    Attributes:
        results: summary entries of each scene, in their order; None while it runs, or if it has to be run alone.
    """

    def __init__(
        self,
        scenes: Sequence[Scene],
        kinds: dict[str, type[Element]],
        *,
        energy: bool = True,
        trajectories: bool = False,
    ) -> None:
        WhereItPays.may_wait = True
        self._scenes, scene = scenes, stacked(scenes)
        time = Timebase.from_scene(scene)
        rows = BatchRecorder()
        super().__init__(scene, time, Controller(scene, time, kinds, rows), rows, len(scenes))
        self._logger = BatchLogger(scene, time, len(scenes), energy=energy, trajectories=trajectories)
        if self._logger.books and (loops := LOOPS.module_for(len(scenes) * time.ticks)):
            self._logger.books.sum_by(loops.SUMS)
            if isinstance(self._motion, OneMassMotion):
                self._motion.fill = loops.fill
        self._positions_only = not (energy or trajectories)
        self._in_flight: deque[Any] = deque(maxlen=time.lookahead_ticks + 1)
        self._limit_m, self._usual_buffer = scene.diverged_beyond, np.getbufsize()
        self._scene_of = np.arange(len(scenes))
        self._ended = np.zeros(len(scenes), bool)
        self._unheeded = 0.0 if scene.friction else _UNHEEDED
        self._most = BLOCK // (_PARTS_WITH_FRICTION if scene.friction else 1)
        self._schedule(scene)
        self.results: list[Summary | None] = [None] * len(scenes)

    def _schedule(self, scene: Scene) -> None:
        self._end, self._changes = self._time.ticks, set[int]()
        for tick, event in scene_events(scene, self._time):
            if is_change(event):
                self._controller.schedule(tick, event)
                self._logger.changes.note(tick, event)
                self._changes.add(tick)
            elif event.get("stop"):
                self._end = min(self._end, tick)

    def run(self) -> None:
        """Runs all members to their ends; on an ElementError the results are void."""
        _keep_freed_memory()
        with np.errstate(all="ignore"):  # members that have ended may reach any values
            np.setbufsize(_BUFFER)
            for tick in range(self._end):
                if tick in self._changes:
                    self._book()
                self._work(tick)
                self._look_for_ends(tick)
                if self._ended.all() or self._was_refused():
                    return
            self._book()
            if self._end:
                whole = self._end == self._time.ticks
                self._finish(np.flatnonzero(~self._ended), "done" if whole else "stopped")

    def _was_refused(self) -> bool:
        """Tells whether a change could not be made; it is not known for which members it could have been made."""
        if self._rows.refused:
            self.results = [None] * len(self.results)
            return True
        return False

    def _work(self, tick: int) -> list[Any]:
        forces = super()._work(tick)
        if tick in self._changes:
            self._elements = Unchanged(self._controller.params.elements)
        self._in_flight += forces
        waiting = tick + 1 - self._logger.tick
        if waiting * self._time.steps_per_tick * len(self._ended) >= self._most:
            self._book()
        return forces

    def _book(self) -> None:
        rows = self._rows.take_rows()
        self._elements.check()
        if rows:
            plant = self._motion.take_record(self._logger.tick, positions_only=self._positions_only)
            self._logger.book(plant, rows, self._controller.params.wall)

    def _look_for_ends(self, tick: int) -> None:
        inside = np.abs(self._motion.x) <= self._limit_m
        if (inside | self._ended).all():
            return
        self._book()
        ends = np.flatnonzero(~inside & ~self._ended)
        x, limit_m = self._motion.x[ends].tolist(), np.broadcast_to(self._limit_m, inside.shape)[ends].tolist()
        reasons = [f"{beyond(*where)}, at tick {tick + 1}" for where in zip(x, limit_m, strict=True)]
        self._finish(ends, "diverged", reasons)
        self._ended[ends] = True
        if np.count_nonzero(self._ended) > self._unheeded * len(self._ended):
            self._drop_ended()

    def _finish(self, places: np.ndarray, ended: str, reasons: list[str] | None = None) -> None:
        """Takes the results of members that end here; one whose numbers are not all finite has none."""
        x, v, sound = self._motion.x, self._motion.v, np.isfinite(self._motion.x)
        for force in self._in_flight:
            sound = sound & np.isfinite(force)
        ends: dict[int, MemberEnd] = {}
        for place, reason in zip(places.tolist(), reasons or [None] * len(places), strict=True):
            if sound[place]:
                index = int(self._scene_of[place])
                ends[index] = MemberEnd(place, self._scenes[index], float(x[place]), float(v[place]), reason)
        counters = self._line.counters | (self._sensor.counters if self._sensor else {})
        counted = {name: counter.state for name, counter in counters.items()}
        with _as_alone(self._usual_buffer):
            outcomes = self._logger.outcomes(list(ends.values()), ended, counted)
            for index, outcome in zip(ends, outcomes, strict=True):
                self.results[index] = outcome

    def end(self, members: Sequence[int]) -> BatchEnd:
        """Returns the end of members that ran to their end, given the numbers of their scenes, at least two."""
        places = np.flatnonzero(np.isin(self._scene_of, members))
        index = self._scene_of[places]
        controller, sensor = self._controller, self._sensor
        return BatchEnd(
            index,
            [self._scenes[i] for i in index],
            self._time,
            self._end,
            controller,
            *tree_take(
                (
                    controller.params,
                    controller.state,
                    self._motion.state,
                    self._motion.last,
                    self._line.state,
                    sensor.state if sensor else None,
                ),
                places,
            ),
            self._logger.window.contacts(places),
        )

    def _drop_ended(self) -> None:
        on = ~self._ended
        self._select(on)
        self._logger.select(on)
        in_flight = tree_select([*self._in_flight], on)
        self._in_flight.clear()
        self._in_flight.extend(in_flight)
        self._limit_m, self._scene_of, self._ended = tree_select((self._limit_m, self._scene_of, self._ended), on)


@contextmanager
def _as_alone(buffer: int) -> Iterator[None]:
    """Gives NumPy the buffers of a run alone, for equal sums: before 2.3 it adds as many numbers at once as they hold.

    It also stops the search for cycles among thousands of dictionaries without any, which takes as long as making them.
    """
    was_at_work = gc.isenabled()
    gc.disable()
    try:
        with np.errstate():  # which also restores the buffers
            np.setbufsize(buffer)
            yield
    finally:
        if was_at_work:
            gc.enable()


def _keep_freed_memory() -> None:
    """Makes glibc's malloc keep what is freed: it raises its thresholds to the largest block that it saw freed.

    Otherwise it gives the columns of every block back and has their pages zeroed again, which takes a third of the
    time.
    """
    np.empty(31 << 17)  # 31 MiB; it learns from no more than 32
