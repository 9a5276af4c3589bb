"""The controller of a loop: samples in, forces out, with elements and gains that may change at a tick."""

from __future__ import annotations

import math
from collections.abc import Sequence
from copy import copy, deepcopy
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from haploop.controller.active_elements import ActiveElement, make_element
from haploop.controller.asked import Declared, first_memory
from haploop.controller.dissipation import Element, ElementError, Motion, load_plugin
from haploop.controller.estimators.base import Sample
from haploop.controller.estimators.choose import make_estimators
from haploop.controller.recorder import Recorder
from haploop.controller.tick import ControllerParams, ControllerState, NoForce, StateTuple, Wall, initial_state, tick
from haploop.protocol.changes import Change, Event
from haploop.protocol.scene.scene import NO_ELEMENT, ElementTable, Scene
from haploop.protocol.ticks import DELAY, Timebase
from haploop.protocol.trees import tree_select

if TYPE_CHECKING:
    import numpy as np

Kinds = dict[str, type[Element]]


def apply_change(
    change: Change, params: ControllerParams, state: ControllerState, kinds: Kinds
) -> tuple[ControllerParams, ControllerState]:
    """Returns parameters and state after a change that was checked before; whatever raises leaves both as they were.

    A plugin is loaded first; it lies in the run's own directory, put there by the launcher.
    """
    if change.plugin is not None:
        kinds.update(load_plugin(Path(change.plugin)))
    if change.swap is not None:
        params, state = _swapped(params, state, change, change.swap, kinds)
    for key, value in change.set.items():
        params = _set(params, change.tick, key.split("."), value)
    return params, state


def _swapped(
    params: ControllerParams, state: ControllerState, change: Change, table: ElementTable, kinds: Kinds
) -> tuple[ControllerParams, ControllerState]:
    """Returns both with a new element in its place, one more past the end, or one less; a new one's memory is fresh."""
    place, elements, memories, books = change.element, list(params.elements), list(state.elements), params.books
    if table.name == NO_ELEMENT:
        del elements[place]
        del memories[place]
    else:
        active = ActiveElement(*make_element(table, kinds), books, change.tick)
        elements[place : place + 1] = [active]
        memories[place : place + 1] = [first_memory(active.element, params.declared)]
        books += 1
    return replace(params, elements=tuple(elements), books=books), state._replace(elements=tuple(memories))


def _set(params: ControllerParams, tick: int, path: list[str], value: float) -> ControllerParams:
    match path:
        case ["wall", "stiffness" | "position" as name]:
            return replace(params, wall=replace(params.wall, **{name: value}))
        case ["clock", "round_trip_delay"]:  # the plant's to do; elements that ask are told
            steps = round(value * params.declared.steps / params.motion.period_s)
            return replace(params, declared=params.declared.delayed(steps))
        case ["dissipation", place, name]:
            elements = list(params.elements)
            active = elements[int(place)]
            setattr(active.element, name, value)  # in place: what an element keeps of its own stays
            elements[int(place)] = replace(active, book=params.books, from_tick=tick)
            return replace(params, elements=tuple(elements), books=params.books + 1)
    raise KeyError(f"{'.'.join(path)} cannot be set while a loop runs")


# Later than any tick; compared as an int, which is quicker than infinity.
_NEVER = 2**62


def make_params(scene: Scene, period_s: float, kinds: Kinds) -> ControllerParams:
    """Makes the parameters of the controller of a resolved scene, or of a batch in a stacked one."""
    made = [make_element(table, kinds) for table in scene.dissipation]
    elements = tuple(ActiveElement(element, acts, book, 0) for book, (element, acts) in enumerate(made))
    wall = Wall.from_scene(scene)
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
        """Returns a controller that goes on from here by itself, without the changes still to come.

        Args:
            params, state: of the members that go on; all of them when None.
            recorder: of a batch.
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

    def learn(self, kinds: Kinds) -> None:
        """Takes in kinds that a swap to come names; those of plugins stay what they are."""
        self._kinds = kinds | self._kinds

    def schedule(self, tick: int, event: Event) -> None:
        """Has a checked swap or set take effect at ``tick``, before that tick's force."""
        change = Change.from_dict(tick, event)
        if DELAY in change.set:
            self.recorder.cover(math.ceil(change.set[DELAY] * self._control_rate) + 2)
        self._changes.append(change)
        self._next_change = self._changes[0].tick

    def answer(self, samples: Sequence[Sample]) -> list[Any]:
        """Returns the commands in N that answer the next samples, in order.

        Raises:
            ElementError: an element raised, or gave something that is no number.
        """
        state, forces = self.state, []
        if state is None:
            state = self.state = initial_state(self.params, samples[0])
        for sample in samples:
            if self.tick >= self._next_change:
                state = self._change(ControllerState(*state))
            try:
                state, row = tick(self.params, state, sample)
            except NoForce as error:
                raise ElementError(error.sentence(self.params, self.tick)) from error.__cause__
            self.state = state
            self.tick += 1
            self.recorder.add(row)
            forces.append(row[-2])
        return forces

    def _change(self, state: ControllerState) -> ControllerState:
        """Carries out what is due; later ticks are written to a new block, since its columns may differ."""
        self.recorder.cut()
        while self._changes and self._changes[0].tick <= self.tick:
            change = self._changes.pop(0)
            try:
                self.params, state = apply_change(change, self.params, state, self._kinds)
            except (Exception, SystemExit) as error:
                self.recorder.refused.append(change.refuse(error))
        self._next_change = self._changes[0].tick if self._changes else _NEVER
        self.recorder.open(self.params)
        return state
