"""The controller of a loop: samples in, forces out, with elements and gains that may change at a tick."""

from __future__ import annotations

import math
from collections import ChainMap
from collections.abc import Sequence
from copy import copy, deepcopy
from typing import TYPE_CHECKING, Any

from haploop.controller.active_elements import ActiveElement, make_element
from haploop.controller.asked import Declared, shown
from haploop.controller.changes import Kinds, apply_change, code_of, take_back, try_element
from haploop.controller.dissipation import ElementError, Motion
from haploop.controller.dissipation.element import place_in
from haploop.controller.estimators.base import Sample
from haploop.controller.estimators.choose import make_estimators
from haploop.controller.recorder import Recorder
from haploop.controller.tick import (
    ControllerParams,
    ControllerState,
    NoForce,
    StateTuple,
    demand_finite,
    initial_state,
    tick,
)
from haploop.protocol.changes import Change, Event, restoration
from haploop.protocol.scene.scene import NO_ELEMENT, Scene
from haploop.protocol.ticks import DELAY, Timebase
from haploop.protocol.trees import tree_select
from haploop.protocol.walls.registry import make_wall

if TYPE_CHECKING:
    import numpy as np

# Later than any tick; compared as an int, which is quicker than infinity.
_NEVER = 2**62


def make_params(scene: Scene, period_s: float, kinds: Kinds) -> ControllerParams:
    """Makes the parameters of the controller of a resolved scene, or of a batch given as a stacked scene."""
    made = [make_element(table, kinds) for table in scene.dissipation]
    elements = tuple(ActiveElement(element, acts, book, 0) for book, (element, acts) in enumerate(made))
    wall = make_wall(scene.wall)
    motion = Motion(period_s, wall.inward)
    return ControllerParams(
        *make_estimators(scene, period_s), wall, elements, len(elements), motion, Declared.from_scene(scene)
    )


class Controller:
    """Parameters and state of the controller of one loop, or of a batch with its recorder; knows nothing of sockets.

    Attributes:
        params, state: what ``tick`` is given, both replaced between ticks; the state is None before the first sample.
    """

    def __init__(self, scene: Scene, time: Timebase, kinds: Kinds, recorder: Recorder | None = None) -> None:
        self._kinds, self._control_rate = dict(kinds), time.control_rate
        # The code of plugins that came with a swap, with its tick and file: later code replaces earlier code.
        self._reloaded: tuple[tuple[int, str | None, Kinds], ...] = ()
        self._restores = scene.run.faulty_swap == "restore"
        # Before this tick some element is so new that it is taken back if it fails.
        self._new_until = 0
        self.params = make_params(scene, time.period_s, self._kinds)
        self.state: StateTuple | None = None
        self.tick = 0
        self._changes: list[Change] = []
        self._next_change = _NEVER
        self.recorder = recorder or Recorder(time.lookahead_ticks + 2)
        self.recorder.open(self.params)

    def fork(
        self, params: ControllerParams | None = None, state: Any = None, recorder: Recorder | None = None
    ) -> Controller:
        """Returns a controller that continues from here independently, without the changes still to come.

        Args:
            params, state: those of the members that continue; all of them when None.
            recorder: that of a batch.
        """
        other = copy(self)
        other.params = deepcopy(self.params if params is None else params)  # an element may keep attributes of its own
        other.state = self.state if params is None else state
        other.recorder = recorder or Recorder(0)
        other.recorder.open(other.params)
        other._changes, other._next_change = [], _NEVER
        return other

    def select(self, kept: np.ndarray) -> None:
        """Keeps these members of a batch, whose rows have been taken; ``kept`` is their mask, shape (members,)."""
        self.params, self.state = tree_select(self.params, kept), tree_select(self.state, kept)
        self._changes = tree_select(self._changes, kept)
        self.recorder.open(self.params)

    @property
    def kinds(self) -> Kinds:
        """Returns the kinds of elements that it knows, with the code that swaps have brought."""
        return self._with(self._reloaded)

    def _with(self, reloaded: Sequence[tuple[int, str | None, Kinds]]) -> Kinds:
        return dict(ChainMap(*(code for *_, code in reversed(reloaded)), self._kinds))

    def learn(self, kinds: Kinds) -> None:
        """Adds kinds that a coming swap names; those of plugins stay unchanged."""
        self._kinds = kinds | self._kinds

    def schedule(self, tick: int, event: Event) -> None:
        """Schedules a checked swap or set to take effect at ``tick``, before that tick's force."""
        change = Change.from_dict(tick, event)
        if DELAY in change.set:
            self.recorder.cover(math.ceil(change.set[DELAY] * self._control_rate) + 2)
        self._changes.append(change)
        self._next_change = self._changes[0].tick

    def answer(self, samples: Sequence[Sample]) -> list[Any]:
        """Returns the commands in N that answer the next samples, in order.

        Raises:
            ElementError: an element raised, or gave something that is not a number.
        """
        state, forces, recorder = self.state, [], self.recorder
        if state is None:
            state = self.state = initial_state(self.params, samples[0])
        for sample in samples:
            now = self.tick
            if now >= self._next_change:
                state = self._change(ControllerState(*state), sample)
            try:
                after, row = tick(self.params, state, sample)
                if now < self._new_until:
                    demand_finite(self.params, row, now - self._control_rate + 1)
            except NoForce as error:
                after, row = self._without(error, ControllerState(*state), sample)
            state = self.state = after
            self.tick = now + 1
            forces.append(row[-2])
            for index, names in recorder.own:
                row += self._shown(index, state[3][index], names)
            recorder.add(row)
        return forces

    def _shown(self, index: int, memory: Any, names: Sequence[str]) -> list[float]:
        try:
            return shown(memory, names)
        except ElementError as error:
            kind = self.params.elements[index].element.kind
            raise ElementError(f"Element {index} ({kind}) failed at tick {self.tick - 1}: {error}") from error

    def _change(self, state: ControllerState, sample: Sample) -> ControllerState:
        """Carries out the changes that are due; later ticks go to a new block, since its columns may differ."""
        self.recorder.cut()
        while self._changes and self._changes[0].tick <= self.tick:
            change = self._changes.pop(0)
            params = self.params
            try:
                reloaded = (*self._reloaded, (change.tick, change.plugin, code_of(change)))
                params, after = apply_change(change, self.params, state, self._with(reloaded))
                if change.swap is not None and change.swap.name != NO_ELEMENT:
                    try_element(change.element, params, after, sample)
            except NoForce as error:
                cause, kind = error.__cause__ or error, type(params.elements[error.index].element)
                self.recorder.refused.append(change.refuse(cause, place_in(kind, cause)))
            except (Exception, SystemExit) as error:
                self.recorder.refused.append(change.refuse(error, place_in(None, error)))
            else:
                self.params, state = params, after
                self._reloaded = reloaded if change.plugin else self._reloaded
                if change.swap is not None and self._restores:
                    self._new_until = change.tick + self._control_rate
        self._next_change = self._changes[0].tick if self._changes else _NEVER
        self.recorder.open(self.params)
        return state

    def _without(self, error: NoForce, state: ControllerState, sample: Sample) -> tuple[StateTuple, list[Any]]:
        """Returns state and row of this tick after taking back the swaps of the last second whose elements fail.

        Raises:
            ElementError: an element fails that no such swap has brought, or the scene asks to end the run then.
        """
        while True:
            why, place = error.sentence(self.params, self.tick), error.index
            swapped = self.params.elements[place].swapped
            if not self._restores or swapped is None or self.tick - swapped[0] >= self._control_rate:
                raise ElementError(why) from error.__cause__
            self.recorder.cut()
            since, before, plugin = swapped
            change, self.params, state = take_back(place, before, self.params, state, self.tick)
            self._reloaded = tuple(each for each in self._reloaded if each[:2] != (since, plugin))
            self.recorder.open(self.params)
            sentence = f"{why} The swap is taken back: {change.describe()}."
            self.recorder.restored.append(restoration(change, sentence, since, plugin))
            try:
                after, row = tick(self.params, state, sample)
                demand_finite(self.params, row, self.tick - self._control_rate + 1)
            except NoForce as other:
                error = other
            else:
                return after, row
